// time_step.h: how long a step may be (the closed-form bound of bound.h, per body and integrator)
// and how steps fall on samples. SI units.
#pragma once

#include "body/springs.h"
#include "limax.h"
#include "physics/scene.h"

namespace limax {

// The bound of a body: the least over its masses; infinite where nothing acts on any. s.
double time_step_bound(const spring_body& body, const scene& scene, limax_integrator integrator,
                       limax_bound kind = LIMAX_BOUND_SPRINGS);

// How a run of one body falls on steps: dt = base / ceil(base / dt), base one over the least
// common multiple of the record rates (at least 20 Hz), so that every sample and both ends lie on
// whole steps.
struct schedule {
    double time_step = 0;                     // s
    int64_t settle_steps = 0;                 // before t = 0
    int64_t steps = 0;                        // in all
    int64_t tick = 0;                         // steps between ticks of control; 0 without it
    int64_t every[LIMAX_TRACE_KINDS] = {};    // steps between samples; 0 where nothing is recorded
    int64_t samples[LIMAX_TRACE_KINDS] = {};  // from t = 0 to the end, both included
};

// Values per sample of a trace kind.
int64_t trace_width(int32_t kind, int64_t masses, int64_t voxels, const scene& scene);

// The longest step that is not coarse (origin.h) at the speed that a body starts with or has when
// it first reaches what is below it: 0.1 h / sqrt(|v|^2 + 2 |g| H). H is the distance along gravity
// of its lowest corner to the ground, a plane or terrain, or of the box around the lattice to a box
// or the box around a sphere, the shortest of them; 0 without gravity or any of them, and at most
// the distance that it falls in the whole run. The same for rigid blocks. s; infinite for a body
// that starts at rest on the ground.
double accuracy_cap(const limax_simulation_options& options, const scene& scene,
                    const lattice& grid);

// Refuses a fixed step that does not divide the base, naming the nearest that does. `bound` is the
// body's own; it and the cap above count where the step is left to the engine. `amplitude` is the
// largest of a muscle: no rest length changes by more than a tenth of an edge in a step.
schedule make_schedule(const limax_simulation_options& options, const scene& scene,
                       const lattice& grid, double bound, double amplitude = 0);

}  // namespace limax
