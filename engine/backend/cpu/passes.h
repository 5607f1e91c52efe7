// passes.h: what a step on the CPU is made of: loops over all sites or springs of one robot, each
// instantiated for what it uses and compiled once per instruction set, and the memory that they
// work on. SI units.
#pragma once

#include "body/springs.h"
#include "genome/network.h"
#include "physics/effects/all.h"

namespace limax::cpu {

// One robot as the passes see it. Columns of sites have `count` elements, a multiple of
// site_block, on aligned memory.
template <class R>
struct robot_arrays {
    int64_t count;                  // sites, padded
    int64_t step[direction_count];  // from a spring's near site to its far one
    int64_t used[direction_count];  // near sites that can have a spring along it, padded
    R rest[direction_count];        // L0, m
    R* position[3];                 // x, relative to the robot's own origin, m
    R* velocity[3];                 // u, m/s
    R* next_velocity[3];            // u after the kick of this step, m/s
    R* predicted[3];  // p, what forces read, m/s; the same memory as `velocity` in symplectic Euler
    R* lost_position[3];  // compensation; null unless compensated
    R* lost_velocity[3];
    const R* mass;           // kg
    const R* inverse_mass;   // 1/kg; 0 at a site that is not in use
    const float* stiffness;  // [direction][count]
    const float* damping;
    const float* sine;
    const float* cosine;
    // Scratch of the thread, written before it is read within one step.
    R* force[3];     // N
    R* normal;       // N
    R* transfer[3];  // one direction's spring forces, N; zeros lie before them for the longest step
};

// Adds the forces of all springs.
template <class R>
using pair_pass = void (*)(const robot_arrays<R>&, const effects::actuation::moment<R>&);
// Adds the forces of one effect on the masses. `params` is the effect's own params<R>.
template <class R>
using node_pass = void (*)(const robot_arrays<R>&, const void* params);
// Changes next_velocity by one effect's impulses over h.
template <class R>
using impulse_pass = void (*)(const robot_arrays<R>&, const void* params, R h);
template <class R>
using kick_pass = void (*)(const robot_arrays<R>&, R h);
// `share` as in predict(); not used without prediction.
template <class R>
using drift_pass = void (*)(const robot_arrays<R>&, R dt, R share);

// Counts of masses and springs that broke a limit.
struct limit_breaks {
    int32_t nonfinite, speed, stretch;
};
template <class R>
using limit_pass = limit_breaks (*)(const robot_arrays<R>&, R max_speed, R max_stretch);

// Pair passes are chosen by the effects that act on springs, counted in the order of effects::all,
// springs left out.
inline constexpr unsigned pair_variants = 4;

// Which pair pass serves a scene.
constexpr unsigned pair_variant(unsigned scene_mask) {
    return (scene_mask & effects::bit<effects::damping> ? 1u : 0u) |
           (scene_mask & effects::bit<effects::actuation> ? 2u : 0u);
}

template <class R>
struct step_passes {
    pair_pass<R> pair[pair_variants];
    node_pass<R> node[effects::all::count];        // null where the effect has no such hook
    impulse_pass<R> impulse[effects::all::count];  // likewise
    kick_pass<R> kick[2];                          // [compensated]
    drift_pass<R> drift[2][2];                     // [compensated][predicted]
    limit_pass<R> limit;
};

struct pass_table {
    const char* isa;
    step_passes<float> single;
    step_passes<double> twice;
    express_pass express;
};

// The tables of this build, and the one that `isa` names (null or empty: the best that this
// processor runs).
const pass_table& choose_passes(const char* isa);
// Names of the instruction sets that this processor runs, best first, comma-separated.
const char* available_isas();

template <class R>
const step_passes<R>& passes_of(const pass_table& table) {
    if constexpr (sizeof(R) == 4)
        return table.single;
    else
        return table.twice;
}

}  // namespace limax::cpu
