// kernel_text.cpp: programs of scripted effects as the text that a kernel has them in.
#include <algorithm>

#include "base/error.h"
#include "physics/scripted/program.h"

namespace limax::scripted {

namespace {

// `parameter` is the number of the next one.
std::string operations_of(const program& law, int& parameter) {
    std::string text;
    int next = law.inputs;
    const int first = program::first_parameter, end = first + law.parameters;
    for (int i = 0; i < int(law.constants.size()); ++i)
        text += i >= first && i < end
                    ? format("LIMAX_PARAMETER(%d,%d)", next++, parameter++)
                    : format("LIMAX_CONSTANT(%d,%a)", next++, law.constants[std::size_t(i)]);
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
    int parameter = 0;
    for (const program* law : laws) {
        registers = std::max(registers, law->registers());
        text += operations_of(*law, parameter) +
                format("LIMAX_FORCE(%d,%d,%d)", law->results[0], law->results[1], law->results[2]);
    }
    return text;
}

std::string kernel_text(const program& controller, int first_parameter) {
    std::string text = operations_of(controller, first_parameter);
    for (std::size_t i = 0; i < controller.results.size(); ++i)
        text += format("LIMAX_RESULT(%zu,%d)", i, controller.results[i]);
    return text;
}

}  // namespace limax::scripted
