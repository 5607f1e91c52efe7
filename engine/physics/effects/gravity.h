// gravity.h: a constant acceleration in any direction; a tilted one is a slope. SI units.
#pragma once

#include "physics/effects/effect.h"

namespace limax::effects {

struct gravity {
    static constexpr const char* name = "gravity";
    static constexpr const char* summary = "a constant acceleration in any direction";
    static constexpr unsigned needs = 0;
    static constexpr unsigned hooks = hook_node | hook_energy;
    static constexpr field fields[] = {
        {"acceleration", "m/s^2", "along x, y, z", 3, -1e4, 1e4, {0.0, 0.0, -9.81}}};
    static constexpr int field_count = 1;

    template <class R>
    struct params {
        vector<R> acceleration;  // m/s^2
    };
    // Energy is counted from the world's origin, so the robot's own origin enters it.
    template <class R>
    LIMAX_LAW static params<R> make(const double* values, const double* /*origin*/) {
        return {{R(values[0]), R(values[1]), R(values[2])}};
    }

    template <class R>
    LIMAX_LAW static void node(const params<R>& p, const node_state<R>& s, vector<R>& force) {
        force.x = fma(s.mass, p.acceleration.x, force.x);
        force.y = fma(s.mass, p.acceleration.y, force.y);
        force.z = fma(s.mass, p.acceleration.z, force.z);
    }

    // -m g.x, J, in the coordinates of `s`.
    template <class R>
    LIMAX_LAW static R energy(const params<R>& p, const node_state<R>& s) {
        return -s.mass * (p.acceleration.x * s.position.x + p.acceleration.y * s.position.y +
                          p.acceleration.z * s.position.z);
    }
};

}  // namespace limax::effects
