// kernel_text.cpp: programs of scripted effects as the text that a kernel has them in.
#include <algorithm>

#include "base/error.h"
#include "physics/scripted/program.h"

namespace limax::scripted {

std::string kernel_text(const std::vector<const program*>& laws, int& registers) {
    std::string text;
    registers = 0;
    for (const program* law : laws) {
        registers = std::max(registers, law->registers());
        int next = inputs;
        for (const double constant : law->constants)
            text += format("LIMAX_CONSTANT(%d,%a)", next++, constant);
        for (const instruction& step : law->instructions)
            text += format("LIMAX_OPERATION(%d,%d,%d,%d,%d)", next++, int(step.what), step.a,
                           step.b, step.c);
        text += format("LIMAX_FORCE(%d,%d,%d)", law->force[0], law->force[1], law->force[2]);
    }
    return text;
}

}  // namespace limax::scripted
