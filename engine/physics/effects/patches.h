// patches.h: parts of the world in which contacts have more or less friction. SI units.
#pragma once

#include "physics/effects/contact.h"

namespace limax::effects {

struct patches {
    static constexpr const char* name = "patches";
    static constexpr const char* summary = "parts of the world with more or less friction";
    static constexpr unsigned needs = hook_slip;
    static constexpr unsigned hooks = hook_grip;
    static constexpr int most_instances = 8;
    static constexpr field fields[] = {
        {"from", "m", "lowest corner in the world", 3, -1e6, 1e6, {0.5, -1e6, -1e6}},
        {"to", "m", "highest corner", 3, -1e6, 1e6, {1e6, 1e6, 1e6}},
        {"factor",
         "1",
         "on both coefficients; those of patches that overlap multiply",
         1,
         0.0,
         1000.0,
         {0.1, 0, 0}}};
    static constexpr int field_count = 3;

    // Why the values are refused, or null.
    static const char* problem(const double* values) {
        for (int axis = 0; axis < 3; ++axis)
            if (!(values[axis] < values[3 + axis]))
                return "every component of 'from' must be below that of 'to'";
        return nullptr;
    }

    template <class R>
    struct params {
        vector<R> from, to;  // m, relative to the robot's own origin
        R factor;            // 1
    };
    template <class R>
    LIMAX_LAW static params<R> make(const double* values, const double* origin) {
        return {{R(values[0] - origin[0]), R(values[1] - origin[1]), R(values[2] - origin[2])},
                {R(values[3] - origin[0]), R(values[4] - origin[1]), R(values[5] - origin[2])},
                R(values[6])};
    }

    template <class R>
    LIMAX_LAW static R grip(const params<R>& p, const vector<R>& place) {
        const bool inside = place.x >= p.from.x && place.x < p.to.x && place.y >= p.from.y &&
                            place.y < p.to.y && place.z >= p.from.z && place.z < p.to.z;
        return inside ? p.factor : R(1);
    }
};

}  // namespace limax::effects
