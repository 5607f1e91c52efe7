// stiffness.cpp: a scripted force at one mass, and its slopes.
#include "physics/scripted/stiffness.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace limax::scripted {

namespace {

using apply_operation = double (*)(double, double, double);

template <int... k>
constexpr std::array<apply_operation, sizeof...(k)> operations_of(
    std::integer_sequence<int, k...>) {
    return {apply<operation(k), double>...};
}
constexpr auto operations = operations_of(std::make_integer_sequence<int, operation_count>{});

// |df| / (2 step) for a change of one input by +- step.
double slope(const program& law, const double in[force_inputs], int input, double step) {
    double at[force_inputs], before[3], after[3];
    std::copy_n(in, int(force_inputs), at);
    at[input] = in[input] - step;
    evaluate(law, at, before);
    at[input] = in[input] + step;
    evaluate(law, at, after);
    return std::hypot(after[0] - before[0], after[1] - before[1], after[2] - before[2]) /
           (2 * step);
}

// The largest slope over three inputs from `first`.
double largest_slope(const program& law, const double in[force_inputs], int first, double step) {
    constexpr double alike = 0.1;
    double largest = 0;
    for (int input = first; input < first + 3; ++input) {
        const double wide = slope(law, in, input, step), narrow = slope(law, in, input, step / 2);
        if (std::fabs(wide - narrow) <= alike * wide) largest = std::max(largest, narrow);
    }
    return largest;
}

}  // namespace

void evaluate(const program& law, const double in[force_inputs], double force[3]) {
    std::vector<double> registers(in, in + force_inputs);
    registers.insert(registers.end(), law.constants.begin(), law.constants.end());
    for (const instruction& each : law.instructions)
        registers.push_back(operations[std::size_t(each.what)](registers[std::size_t(each.a)],
                                                               registers[std::size_t(each.b)],
                                                               registers[std::size_t(each.c)]));
    for (int axis = 0; axis < 3; ++axis)
        force[axis] = registers[std::size_t(law.results[std::size_t(axis)])];
}

effects::stiffness_damping steepness(const program& law, const double in[force_inputs],
                                     double step) {
    return {largest_slope(law, in, input_position, step),
            largest_slope(law, in, input_velocity, step)};
}

}  // namespace limax::scripted
