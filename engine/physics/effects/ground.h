// ground.h: a horizontal plane that pushes what is below it and never pulls. SI units.
#pragma once

#include "physics/effects/contact.h"

namespace limax::effects {

struct ground {
    static constexpr const char* name = "ground";
    static constexpr const char* summary = "the ground: a plane that pushes and never pulls";
    static constexpr unsigned needs = 0;
    static constexpr unsigned hooks = hook_contact;
    static constexpr field fields[] = {contact_stiffness,
                                       contact_damping_ratio,
                                       {"height", "m", "of the plane", 1, -1e6, 1e6, {0.0, 0, 0}}};
    static constexpr int field_count = 3;

    template <class R>
    struct params {
        R stiffness;  // N/m
        R damping;    // of unit_damping(), N s/(m kg^1/2)
        R height;     // m, relative to the robot's own origin
    };
    template <class R>
    LIMAX_LAW static params<R> make(const double* values, const double* origin) {
        return {R(values[0]), R(unit_damping(values[0], values[1])), R(values[2] - origin[2])};
    }
    template <class R>
    LIMAX_LAW static void follow(params<R>& p, const double* values, const double* origin) {
        p.height = R(values[2] - origin[2]);
    }

    template <class R>
    LIMAX_LAW static surface_point<R, up> surface(const params<R>& p, const vector<R>& position) {
        return {p.height - position.z, {}};
    }
};

}  // namespace limax::effects
