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
    {"duration", "s", "from the start of actuation to the end; ten periods", 1, 0, 1e-9, 1e6, {5}},
    {"settle", "s", "rest before actuation starts at t = 0", 1, 0, 0, 1e6, {0}},
    {"time_step", "s", "\"auto\" (0): from each body's own bound", 1, 0, 1e-9, 1, {0}},
    {"bound_fraction", "1", "share of the bound that \"auto\" takes", 1, 0, 1e-3, 1, {0.9}},
    {"time_step_most", "s", "largest step of \"auto\"; 0: no cap", 1, 0, 0, 1, {0}},
    {"edge", "m", "of a voxel; the paper's rest length", 1, 0, 1e-4, 100, {0.1}},
    {"position", "m", "start of the body's lowest corner", 3, 0, -1e9, 1e9, {0, 0, 0}},
    {"velocity", "m/s", "of all masses at the start", 3, 0, -1e6, 1e6, {0, 0, 0}},
    {"max_speed", "m/s", "a faster mass is divergence", 1, 0, 1e-3, 1e30, {1000}},
    {"max_stretch", "L0", "a longer spring is divergence", 1, 0, 1, 1e15, {10}},
    {"record", "Hz", "samples of a trace per second; 0: none", 1, 1, 0, 100000, {0}},
};
inline constexpr limax_field_info genome_fields[] = {
    {"features", "rows of B", "half the inputs of the network", 1, 1, 1, 1024, {16}},
    {"sigma", "1", "of B; 1: periods of about one lattice", 1, 0, 0, 100, {1}},
    {"hidden", "neurons", "width of a hidden layer", 1, 1, 1, 1024, {32}},
    {"initial_scale", "1", "of the initial weights, N(0, 1 / fan_in)", 1, 0, 0, 100, {1}},
};
inline constexpr limax_field_info breeding_fields[] = {
    {"mutation_rate", "per gene", "chance; the paper's value", 1, 0, 0, 1, {0.1}},
    {"mutation_scale", "1", "standard deviation; the paper's value", 1, 0, 0, 100, {0.1}},
    {"crossover_rate", "per gene", "chance; the paper's value", 1, 0, 0, 1, {0.4}},
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
