// wind.h: air that draws every mass towards its own velocity w: dv/dt = (w - v) c / m. Linear drag,
// as in slow or very viscous flow (Stokes). SI units.
//
// It acts as an impulse, implicit in the new velocity: v' - w = (v - w) / (1 + c h / m). So it is
// stable at any step and never overshoots the air's velocity, and the steady fall under gravity,
// v - w = m g / c, is exact.
#pragma once

#include "physics/effects/effect.h"

namespace limax::effects {

struct wind {
    static constexpr const char* name = "wind";
    static constexpr const char* summary = "air with linear drag on every mass";
    static constexpr unsigned needs = 0;
    static constexpr unsigned hooks = hook_impulse;
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
    LIMAX_LAW static vector<R> impulse(const params<R>& p, const node_state<R>& s,
                                       const vector<R>& velocity, R h) {
        const R share = p.drag * h * s.inverse_mass;
        // of the difference to the air; 0 at a site that is not in use
        const R closed = share / (R(1) + share);
        return {fma(closed, p.velocity.x - velocity.x, velocity.x),
                fma(closed, p.velocity.y - velocity.y, velocity.y),
                fma(closed, p.velocity.z - velocity.z, velocity.z)};
    }
};

}  // namespace limax::effects
