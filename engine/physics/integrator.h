// integrator.h: how forces become motion: the laws of one component of one mass. SI units.
//
// Leapfrog: positions x at t_n, velocities u at t_(n-1/2). Forces that depend on velocity read the
// prediction
//     p_n = u_(n-1/2) + a_(n-1) dt / 2 = u + (u - u_before) / 2,
// so that damping is of second order too; a_(n-1) includes friction, else a stuck mass would be
// predicted to slip. At n = 0, p = u and the kick lasts dt/2, so u_(1/2) - u_0 = a_0 dt / 2 and
// the next prediction adds it whole. Symplectic Euler is the same loop with p = u and whole kicks.
// Order two while no contact switches; one through that and, since friction opposes the slip of
// t_(n+1/2), where a slip turns.
//
// RK4: the classical Runge-Kutta method on (x, v), both at t_n; the slopes are (v, a). Four force
// evaluations: at t_n, twice at t_n + dt/2, and at t_n + dt, each at the state that the previous
// slopes lead to; the step is their mean with weights 1, 2, 2, 1. Order four in smooth scenes, less
// where a contact switches within a step; impulses are not supported.
#pragma once

#include "base/portable.h"

namespace limax {

// sum + factor term. Compensated: `lost` carries what rounding took away (Kahan), and stays 0
// otherwise.
template <bool compensated, class R>
LIMAX_LAW R accumulate(R sum, R factor, R term, R& lost) {
    if constexpr (compensated) {
        const R corrected = fma(factor, term, -lost);
        const R result = sum + corrected;
        lost = (result - sum) - corrected;
        return result;
    } else {
        return fma(factor, term, sum);
    }
}

// Velocity after a force F acted for h: u + h F / m.
template <bool compensated, class R>
LIMAX_LAW R kick(R velocity, R force, R inverse_mass, R h, R& lost) {
    return accumulate<compensated>(velocity, h * inverse_mass, force, lost);
}

// Position after dt at the new velocity.
template <bool compensated, class R>
LIMAX_LAW R drift(R position, R velocity, R dt, R& lost) {
    return accumulate<compensated>(position, dt, velocity, lost);
}

// Where a slope leads in h from where the step started, which compensation knows better than
// `start`.
template <class R>
LIMAX_LAW R lead(R start, R slope, R h, R lost) {
    return start + fma(h, slope, -lost);
}

// The velocity that the next forces read: new + share (new - old), share 1/2, and 1 after the half
// kick of n = 0.
template <class R>
LIMAX_LAW R predict(R before, R after, R share) {
    return fma(share, after - before, after);
}

}  // namespace limax
