// operations.h: what the law of a scripted effect is made of: arithmetic on one number of each
// mass. Truth is 1, falsehood 0, and any other number counts as true. Includes base/ only.
#pragma once

#include "base/math.h"

namespace limax::scripted {

enum class operation : uint8_t {
    negate,
    add,
    subtract,
    multiply,
    divide,
    root,
    sine,
    cosine,
    exponential,
    absolute,
    smaller,
    larger,
    less,
    at_most,
    equal,
    both,
    either,
    inverted,
    choose,  // b where a is true, else c
    tangent,
    soft,   // a / sqrt(1 + a^2)
    clamp,  // a between b and c
    // of controllers; their operands are not registers
    gene,      // number a of the robot
    layer,     // number a of the program's layers: writes as many registers as it has outputs
    of_layer,  // a place that a layer before it wrote
};
// Those of one number each.
inline constexpr int operation_count = int(operation::clamp) + 1;

// The first registers of a force: the state of a mass.
enum input {
    input_position = 0,
    input_velocity = 3,
    input_mass = 6,
    input_time = 7,
    force_inputs = 8
};

// Numbers that scripts of a scene set as parameters, those of a vector counted as three.
inline constexpr int most_parameters = 256;

// Writes the next register. Operands are earlier registers.
struct instruction {
    operation what;
    int32_t a, b, c;
};

// Genes of a hidden unit of a layer (program.h), and of a layer.
inline constexpr int layer_alignment = 4;
LIMAX_LAW constexpr int row_of_layer(int inputs, int outputs) {
    return (inputs + outputs + layer_alignment - 1) / layer_alignment * layer_alignment;
}
LIMAX_LAW constexpr int genes_of_layer(int inputs, int hidden, int outputs) {
    return hidden * (row_of_layer(inputs, outputs) + 1) + outputs;
}

// The result of an operation on as many of a, b and c as it takes.
template <operation what, class R>
LIMAX_LAW R apply(R a, R b, R c) {
    const auto truth = [](bool is) { return is ? R(1) : R(0); };
    if constexpr (what == operation::negate) return -a;
    if constexpr (what == operation::add) return a + b;
    if constexpr (what == operation::subtract) return a - b;
    if constexpr (what == operation::multiply) return a * b;
    if constexpr (what == operation::divide) return a / b;
    if constexpr (what == operation::root) return square_root(a);
    if constexpr (what == operation::sine || what == operation::cosine) {
        constexpr double turns_per_radian = 0x1.45f306dc9c883p-3;  // 1 / (2 pi)
        double sine, cosine;
        sine_cosine_turns(double(a) * turns_per_radian, sine, cosine);
        return R(what == operation::sine ? sine : cosine);
    }
    if constexpr (what == operation::exponential) return limax::exponential(a);
    if constexpr (what == operation::absolute) return limax::absolute(a);
    if constexpr (what == operation::smaller) return limax::smaller(a, b);
    if constexpr (what == operation::larger) return limax::larger(a, b);
    if constexpr (what == operation::less) return truth(a < b);
    if constexpr (what == operation::at_most) return truth(a <= b);
    if constexpr (what == operation::equal) return truth(a == b);
    if constexpr (what == operation::both) return truth(a != R(0) && b != R(0));
    if constexpr (what == operation::either) return truth(a != R(0) || b != R(0));
    if constexpr (what == operation::inverted) return truth(a == R(0));
    if constexpr (what == operation::choose) return a != R(0) ? b : c;
    if constexpr (what == operation::tangent) return tangent_of_controller(a);
    if constexpr (what == operation::soft) return a * inverse_length(fma(a, a, R(1)));
    if constexpr (what == operation::clamp) return limax::smaller(c, limax::larger(b, a));
}

}  // namespace limax::scripted
