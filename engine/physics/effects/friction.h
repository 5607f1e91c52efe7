// friction.h: Coulomb friction as an impulse on each mass that touches, which can stop a slip and
// never reverse it. SI units.
#pragma once

#include "physics/effects/effect.h"

namespace limax::effects {

struct friction {
    static constexpr const char* name = "friction";
    static constexpr const char* summary =
        "Coulomb friction, static and kinetic, of masses that touch";
    static constexpr const char* needs = "ground";
    static constexpr unsigned hooks = hook_impulse;
    static constexpr bool in_contact_only = true;
    static constexpr field fields[] = {
        {"static", "1", "mu_s: a mass that this can stop, stops", 1, 0.0, 1000.0, {1.0, 0, 0}},
        {"kinetic", "1", "mu_k: else this opposes the slip", 1, 0.0, 1000.0, {0.6, 0, 0}}};
    static constexpr int field_count = 2;

    template <class R>
    struct params {
        R static_coefficient, kinetic_coefficient;  // 1
    };
    template <class R>
    LIMAX_LAW static params<R> make(const double* values, const double* /*origin*/) {
        return {R(values[0]), R(values[1])};
    }

    // `velocity` is the mass's after all forces of this step of length h; `normal` its normal
    // force. Stopping the slip takes m |v_t|: at most mu_s N h of it is there at once, else mu_k N
    // h, capped at what stops the mass.
    template <class R>
    LIMAX_LAW static vector<R> impulse(const params<R>& p, const node_state<R>& s,
                                       const vector<R>& velocity, R normal, R h) {
        // (m/s)^2: far below any speed that matters, so that a mass at rest has an inverse speed
        const R tiny = R(1e-30);
        const R squared = fma(velocity.x, velocity.x, fma(velocity.y, velocity.y, tiny));
        const R inverse = inverse_length(squared);
        const R speed = squared * inverse;
        const R available = normal * h * s.inverse_mass;  // m/s per unit of mu
        const R kinetic = smaller(p.kinetic_coefficient * available, speed);
        const R removed = speed <= p.static_coefficient * available ? speed : kinetic;
        // 1 exactly where nothing is removed, and never below 0, whatever was rounded
        const R kept = removed >= speed ? R(0) : larger(fma(-removed, inverse, R(1)), R(0));
        return {normal > R(0) ? velocity.x * kept : velocity.x,
                normal > R(0) ? velocity.y * kept : velocity.y, velocity.z};
    }
};

}  // namespace limax::effects
