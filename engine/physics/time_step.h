// time_step.h: how long a step may be (a closed-form bound per body and integrator) and how steps
// fall on samples. SI units.
//
// The bound. Linearise about any pose in which every spring is at least half its rest length: a
// spring's stiffness block then has norm at most k, so by Gershgorin's theorem on M^-1 K and M^-1
// C each mass i gives w^2 <= A_i and gamma <= B_i with
//     A_i = (2 sum_j k_ij + k_g) / m_i,   B_i = (2 sum_j c_ij + c_g) / m_i.
// One mode, x'' = -w^2 x - gamma x', under each integrator, with W = (w dt)^2 and G = gamma dt:
//   symplectic Euler: z^2 + (W + G - 2) z + (1 - G) = 0. Jury: p(1) = W > 0, |1 - G| < 1, and
//   p(-1) = 4 - W - 2 G > 0, the sharpest.
//       dt < (-B + sqrt(B^2 + 4 A)) / A.
//   leapfrog: z^3 + (W + 3 G / 2 - 2) z^2 + (1 - 2 G) z + G / 2 = 0. Jury: p(1) = W > 0; -p(-1) =
//   4 - W - 4 G > 0; |G / 2| < 1; and
//       1 - G^2 / 4 > |G W / 2 + 3 G^2 / 4 + G - 1|, which p(-1) implies: with W < 4 - 4 G the
//       right side's upper branch asks (G - 1)(G - 2) > 0, true for G < 1, and its lower branch 0
//       < G W / 2 + G^2 / 2 + G. So z = -1 leaves the unit circle first: dt < 2 (-B + sqrt(B^2 +
//       A)) / A, symplectic Euler's formula with B doubled.
// It is a result about the frozen linear system in every such pose, not about switching contacts:
// the run-time guard stays.
#pragma once

#include <cmath>

#include "body/springs.h"
#include "limax.h"
#include "physics/scene.h"

namespace limax {

// Largest stable step of one mass; infinite where nothing acts on it. A in 1/s^2, B in 1/s.
inline double stable_step(limax_integrator integrator, double a, double b) {
    if (!(a > 0)) return b > 0 ? (integrator == LIMAX_LEAPFROG ? 1.0 : 2.0) / b : HUGE_VAL;
    const double damping = integrator == LIMAX_LEAPFROG ? 2.0 * b : b;
    // (-B + sqrt(B^2 + 4 A)) / A without cancellation
    return 4.0 / (damping + std::sqrt(damping * damping + 4.0 * a));
}

// The bound of a body: the least over its masses. s.
double time_step_bound(const spring_body& body, const scene& scene, limax_integrator integrator);

// How a run of one body falls on steps: dt = base / ceil(base / dt), base one over the least
// common multiple of the record rates (at least 20 Hz), so that every sample and both ends lie on
// whole steps.
struct schedule {
    double time_step = 0;                     // s
    int64_t settle_steps = 0;                 // before t = 0
    int64_t steps = 0;                        // in all
    int64_t every[LIMAX_TRACE_KINDS] = {};    // steps between samples; 0 where nothing is recorded
    int64_t samples[LIMAX_TRACE_KINDS] = {};  // from t = 0 to the end, both included
};

// Values per sample of a trace kind.
int64_t trace_width(int32_t kind, int64_t masses);

// Refuses a fixed step that does not divide the base, naming the nearest that does.
schedule make_schedule(const limax_simulation_options& options, double bound);

}  // namespace limax
