// change.h: what a controlled body undergoes as time goes on: muscles that stop, and tissue that
// grows or shrinks. A tick of the controller takes both into account, so a step costs nothing more.
// SI units.
#pragma once

#include "physics/effects/effect.h"

namespace limax::effects {

struct damage {
    static constexpr const char* name = "damage";
    static constexpr const char* summary = "muscles of a part of the body that stop at a time";
    static constexpr unsigned needs = 0;
    static constexpr unsigned hooks = 0;
    static constexpr int most_instances = 4;
    static constexpr field fields[] = {
        {"time", "s", "after which the controller has no effect there", 1, 0.0, 1e6, {1.0, 0, 0}},
        {"from",
         "1",
         "lowest corner of that part, as the sensor place has it",
         3,
         -1.0,
         1.0,
         {0.0, -1.0, -1.0}},
        {"to", "1", "highest corner", 3, -1.0, 1.0, {1.0, 1.0, 1.0}}};
    static constexpr int field_count = 3;

    // Why the values are refused, or null.
    static const char* problem(const double* values) {
        for (int axis = 0; axis < 3; ++axis)
            if (!(values[1 + axis] < values[4 + axis]))
                return "every component of 'from' must be below that of 'to'";
        return nullptr;
    }

    // Whether the muscle of the voxel there has stopped.
    template <class R>
    LIMAX_LAW static bool stops(const double* values, const vector<R>& place, double time) {
        const auto within = [&](R x, int axis) {
            return x >= R(values[1 + axis]) && x <= R(values[4 + axis]);
        };
        return time >= values[0] && within(place.x, 0) && within(place.y, 1) && within(place.z, 2);
    }
};

struct growth {
    static constexpr const char* name = "growth";
    static constexpr const char* summary = "rest lengths of a material that change slowly";
    static constexpr unsigned needs = 0;
    static constexpr unsigned hooks = 0;
    static constexpr int most_instances = 4;
    static constexpr field fields[] = {
        {"material",
         "1",
         "its place among the materials, whole; the empty one is 0",
         1,
         1.0,
         15.0,
         {1.0, 0, 0}},
        {"strain", "1", "relative change of the rest length at the end", 1, -0.4, 1.0, {0.2, 0, 0}},
        {"begin", "s", "when it begins", 1, 0.0, 1e6, {0.0, 0, 0}},
        {"duration", "s", "until it is complete", 1, 0.1, 1e6, {2.0, 0, 0}}};
    static constexpr int field_count = 4;

    // Why the values are refused, or null.
    static const char* problem(const double* values) {
        return values[0] == static_cast<double>(static_cast<int64_t>(values[0]))
                   ? nullptr
                   : "material must be a whole number";
    }

    // The relative change of rest length so far.
    LIMAX_LAW static double strain_at(const double* values, double time) {
        const double share = (time - values[2]) / values[3];
        return values[1] * smaller(1.0, larger(0.0, share));
    }
};

}  // namespace limax::effects
