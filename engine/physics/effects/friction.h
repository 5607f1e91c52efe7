// friction.h: Coulomb friction as an impulse on each mass in contact, which can stop a slip and
// never reverses it. Contacts are processed one after the other, with any surface normal. SI units.
//
// Static friction holds a mass that was at rest before the step, and one whose slip the forces of
// the step reverse, since it was at rest for a moment. Any other slipping mass is stopped by
// kinetic friction only. If static friction stopped it too, every stop would apply up to mu_s N h
// instead of mu_k N h, and the error of a walk would be ten times larger and converge more slowly
// in h. If static friction did not hold masses that reverse, a force F between mu_k N and mu_s N
// would pull the slip back through zero in a share (F - mu_k N) / (F + mu_k N) of all reversals,
// for any h.
#pragma once

#include "physics/effects/contact.h"

namespace limax::effects {

struct friction {
    static constexpr const char* name = "friction";
    static constexpr const char* summary = "Coulomb friction on every contact, static and kinetic";
    static constexpr unsigned needs = hook_contact;
    static constexpr unsigned hooks = hook_slip;
    static constexpr field fields[] = {
        {"static", "1", "static coefficient", 1, 0.0, 1000.0, {1.0, 0, 0}},
        {"kinetic", "1", "kinetic coefficient", 1, 0.0, 1000.0, {0.6, 0, 0}}};
    static constexpr int field_count = 2;

    template <class R>
    struct params {
        R static_coefficient, kinetic_coefficient;  // 1
    };
    template <class R>
    LIMAX_LAW static params<R> make(const double* values, const double* /*origin*/) {
        return {R(values[0]), R(values[1])};
    }

    // The same on a surface with `factor` times the friction.
    template <class R>
    LIMAX_LAW static params<R> scaled(const params<R>& p, R factor) {
        return {factor * p.static_coefficient, factor * p.kinetic_coefficient};
    }

    // m/s: far below any slip that matters, and above what rounding leaves of one that was stopped
    // on a slanted surface.
    static constexpr double at_rest = 1e-6;

    // `before` and `velocity` are the mass's before and after all forces of this step of length h;
    // `push` is the normal force on it, N. Stopping the slip takes m |v_t|: up to mu_s N h is
    // available for a mass that was at rest or reverses, else mu_k N h, capped at what stops it.
    template <class R, class Direction>
    LIMAX_LAW static vector<R> slip(const params<R>& p, const Direction& normal, R push,
                                    R inverse_mass, const vector<R>& before,
                                    const vector<R>& velocity, R h) {
        // (m/s)^2: far below any speed that matters, so that a mass at rest has an inverse speed
        const R tiny = R(1e-30);
        const vector<R> sliding = across(normal, velocity);
        const R squared = square_across(normal, sliding, tiny);
        const R inverse = inverse_length(squared);
        const R speed = squared * inverse;
        const R available = push * h * inverse_mass;  // m/s per unit of mu
        const R kinetic = smaller(p.kinetic_coefficient * available, speed);
        const bool rested =
            square_across(normal, across(normal, before), R(0)) <= R(at_rest * at_rest);
        const bool turned = product_across(normal, before, sliding) < R(0);
        const bool held = (rested | turned) & (speed <= p.static_coefficient * available);
        const R removed = held ? speed : kinetic;
        // 1 exactly where nothing is removed, and never below 0, whatever was rounded
        const R kept = removed >= speed ? R(0) : larger(fma(-removed, inverse, R(1)), R(0));
        const vector<R> slowed = slowed_across(normal, velocity, sliding, kept);
        return {push > R(0) ? slowed.x : velocity.x, push > R(0) ? slowed.y : velocity.y,
                push > R(0) ? slowed.z : velocity.z};
    }
};

}  // namespace limax::effects
