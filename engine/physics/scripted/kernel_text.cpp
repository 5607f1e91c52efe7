// kernel_text.cpp: programs of scripted effects as the text that a kernel has them in.
#include <algorithm>

#include "base/error.h"
#include "physics/scripted/program.h"

namespace limax::scripted {

namespace {

std::string operations_of(const program& law) {
    std::string text;
    int next = law.inputs;
    for (const double constant : law.constants)
        text += format("LIMAX_CONSTANT(%d,%a)", next++, constant);
    for (const instruction& step : law.instructions) {
        const int to = next++;
        if (step.what == operation::gene) {
            text += format("LIMAX_GENE(%d,%d)", to, step.a);
        } else if (step.what == operation::layer) {
            const layer& own = law.layers[std::size_t(step.a)];
            text += format("LIMAX_LAYER(%d,%d,%d,%d,%zu", to, own.first, own.hidden, own.outputs,
                           own.inputs.size());
            for (const int16_t input : own.inputs) text += format(",at[%d]", input);
            text += ")";
        } else if (step.what != operation::of_layer) {
            text += format("LIMAX_OPERATION(%d,%d,%d,%d,%d)", to, int(step.what), step.a, step.b,
                           step.c);
        }
    }
    return text;
}

}  // namespace

std::string kernel_text(const std::vector<const program*>& laws, int& registers) {
    std::string text;
    registers = 0;
    for (const program* law : laws) {
        registers = std::max(registers, law->registers());
        text += operations_of(*law) +
                format("LIMAX_FORCE(%d,%d,%d)", law->results[0], law->results[1], law->results[2]);
    }
    return text;
}

std::string kernel_text(const program& controller) {
    std::string text = operations_of(controller);
    for (std::size_t i = 0; i < controller.results.size(); ++i)
        text += format("LIMAX_RESULT(%zu,%d)", i, controller.results[i]);
    return text;
}

}  // namespace limax::scripted
