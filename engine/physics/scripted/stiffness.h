// stiffness.h: how steep a scripted force is: what its bound must cover. SI units.
#pragma once

#include "physics/effects/effect.h"
#include "physics/scripted/program.h"

namespace limax::scripted {

// The force on a mass: `in` as numbered in operations.h, `force` in N.
void evaluate(const program& law, const double in[force_inputs], double force[3]);

// The largest change of the force along an axis, by central differences over `step` m and over
// `step` m per second: |df/dx|, N/m, and |df/dv|, N s/m. 0 where half of the step gives another
// slope: there the force jumps.
effects::stiffness_damping steepness(const program& law, const double in[force_inputs],
                                     double step);

}  // namespace limax::scripted
