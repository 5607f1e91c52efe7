// fields.h: name, unit, range, default and explanation of the numbers among the options of limax.h.
// Scripts read them through limax_option_field. Includes error.h and limax.h.
#pragma once

#include <cstring>
#include <string_view>

#include "base/error.h"
#include "limax.h"

namespace limax {

// name, unit, note, components, whole, minimum, maximum, default
inline constexpr limax_field_info simulation_fields[] = {
    {"duration", "s", "from t = 0 to the end, in whole samples", 1, 0, 1e-9, 1e6, {5}},
    {"settle", "s", "before t = 0, without actuation, in whole steps", 1, 0, 0, 1e6, {0}},
    {"time_step", "s", "a number, or auto: from the body's bound", 1, 0, 1e-9, 1, {0}},
    {"bound_fraction", "1", "share of the body's bound for auto", 1, 0, 1e-3, 1, {0.9}},
    {"time_step_most", "s", "largest step of auto, 0 for no limit", 1, 0, 0, 1, {0}},
    {"edge", "m", "of a voxel at rest", 1, 0, 1e-4, 100, {0.1}},
    {"position", "m", "of the body's lowest corner at the start", 3, 0, -1e9, 1e9, {0, 0, 0}},
    {"velocity", "m/s", "at the start, x, y, z", 3, 0, -1e6, 1e6, {0, 0, 0}},
    {"max_speed", "m/s", "of any mass; above it a body diverged", 1, 0, 1e-3, 1e30, {1000}},
    {"max_stretch", "L0", "of any spring; above it a body diverged", 1, 0, 1, 1e15, {10}},
    {"record", "Hz", "samples of a trace, 0 for none", 1, 1, 0, 100000, {0}},
};
// sigma: robots of 20 generations of README.md's first experiment moved 3.4 m along x at 0.05 to
// 0.15, 1.3 m at 0.25, 0.6 m at 0.5 and 0.5 m at 1 (mean best of three seeds). Below 0.15 some
// bodies of the first generation are of one material, without a muscle; at 0 all are of one.
inline constexpr limax_field_info genome_fields[] = {
    {"features", "rows of B", "of the positional encoding; two inputs each", 1, 1, 1, 1024, {16}},
    {"sigma", "1", "standard deviation of B's entries; low: large pieces", 1, 0, 1e-3, 100, {0.15}},
    {"hidden", "neurons", "of each hidden layer", 1, 1, 1, 1024, {32}},
    {"initial_scale", "1", "factor on the initial weights", 1, 0, 0, 100, {1}},
    {"control_spread",
     "1",
     "standard deviation of the initial genes of control",
     1,
     0,
     0,
     100,
     {0}},
};
inline constexpr limax_field_info breeding_fields[] = {
    {"mutation_rate", "per gene", "probability of a mutation", 1, 0, 0, 1, {0.1}},
    {"mutation_scale", "1", "standard deviation of a mutation", 1, 0, 0, 100, {0.1}},
    {"crossover_rate", "per gene", "probability of a gene of the second parent", 1, 0, 0, 1, {0.4}},
    {"control_mutation_rate",
     "per gene",
     "mutation_rate of the genes of control",
     1,
     0,
     0,
     1,
     {0.1}},
    {"control_mutation_scale", "1", "mutation_scale of the genes of control", 1, 0, 0, 100, {0.1}},
};

template <std::size_t n>
constexpr const limax_field_info& field_named(const limax_field_info (&fields)[n],
                                              std::string_view name) {
    for (const limax_field_info& field : fields)
        if (name == field.name) return field;
    throw "no such field";
}

// Refuses a value outside the range of its field; messages call it `label`.
template <std::size_t n>
void require_field(const limax_field_info (&fields)[n], const char* name, double value,
                   const char* label = nullptr) {
    const limax_field_info& field = field_named(fields, name);
    require_range(label ? label : name, value, field.minimum, field.maximum,
                  std::strcmp(field.unit, "1") == 0 ? "" : field.unit);
}

}  // namespace limax
