// wind.h: air that draws every mass towards its own velocity w: dv/dt = (w - v) c / m. Linear drag,
// as in slow or very viscous flow (Stokes). SI units.
//
// A force that reads the velocity of t_n, as that of dashpots does, so it has the order of the
// integrator. The steady fall under gravity, v - w = m g / c, is exact. The automatic step resolves
// m / c; a longer fixed one may be unstable.
#pragma once

#include "physics/effects/effect.h"

namespace limax::effects {

struct wind {
    static constexpr const char* name = "wind";
    static constexpr const char* summary = "air with linear drag on every mass";
    static constexpr unsigned needs = 0;
    static constexpr unsigned hooks = hook_node | hook_bound;
    static constexpr field fields[] = {
        {"velocity", "m/s", "of the air, along x, y, z", 3, -1000.0, 1000.0, {1.0, 0.0, 0.0}},
        {"drag", "N s/m", "on each mass", 1, 0.0, 1000.0, {0.01, 0, 0}}};
    static constexpr int field_count = 2;

    template <class R>
    struct params {
        vector<R> velocity;  // m/s
        R drag;              // N s/m
    };
    template <class R>
    LIMAX_LAW static params<R> make(const double* values, const double* /*origin*/) {
        return {{R(values[0]), R(values[1]), R(values[2])}, R(values[3])};
    }

    template <class R>
    LIMAX_LAW static void node(const params<R>& p, const node_state<R>& s, vector<R>& force) {
        force.x = fma(p.drag, p.velocity.x - s.velocity.x, force.x);
        force.y = fma(p.drag, p.velocity.y - s.velocity.y, force.y);
        force.z = fma(p.drag, p.velocity.z - s.velocity.z, force.z);
    }
    LIMAX_LAW static stiffness_damping bound(const params<double>& p, double /*mass*/) {
        return {0.0, p.drag};
    }
};

}  // namespace limax::effects
