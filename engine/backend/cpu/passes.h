// passes.h: what a step on the CPU is made of: loops over all sites or springs of one robot, each
// instantiated for what it uses and compiled once per instruction set, and the memory that they
// work on. SI units.
#pragma once

#include "body/springs.h"
#include "genome/network.h"
#include "physics/effects/all.h"
#include "physics/scripted/operations.h"

namespace limax::cpu {

// One robot's springs as the passes see them, in the precision F of their forces. Columns of sites
// have `count` elements, a multiple of site_block, on aligned memory.
template <class F>
struct spring_arrays {
    int64_t count;                  // sites, padded
    int64_t sites;                  // sites of the lattice
    int64_t step[direction_count];  // from a spring's near site to its far one
    int64_t used[direction_count];  // near sites that can have a spring along it, padded
    F rest[direction_count];        // L0, m
    const F* position[3];           // x, relative to the robot's own origin, m
    const F* velocity[3];           // p, what forces read, m/s
    const float* stiffness;         // [direction][count]
    const float* damping;
    const float* sine;
    const float* cosine;
    // Scratch of the thread, written before it is read within one step.
    F* force[3];     // N, [count]
    F* transfer[3];  // one direction's spring forces, N; zeros lie before them for the longest step
    F* sums;         // [corner][3][sums_column]: what cells add to their corners, N
    int64_t sums_window, sums_column;  // cells that it holds, and those with the first ones again
    // [count / site_block][cell_rows][site_block]: the columns above by cells, see cell_springs
    const float* cells;
    int64_t cell_rows;
};

// Every site is the lowest corner of one cell, whose corners are numbered by bits: x = 1, y = 2,
// z = 4. A cell owns these 13 springs, so every spring has one owner; on the high faces of a
// lattice those that it has not have no stiffness. Springs of one class have the same voxels as
// owners, and so the same stiffness, sine and cosine.
struct cell_spring {
    int near, far, direction, owners;
};
inline constexpr int cell_corners = 8, owner_classes = 7;
// Sorted by the far corner: registers hold the low face and one high corner at once.
inline constexpr cell_spring cell_springs[direction_count] = {
    {0, 1, 0, 0}, {0, 2, 1, 1},  {1, 2, 4, 3}, {0, 3, 3, 3},   // low face
    {0, 4, 2, 2}, {1, 4, 6, 4},  {2, 4, 8, 5}, {3, 4, 12, 6},  // to the corner above its lowest
    {0, 5, 5, 4}, {2, 5, 11, 6}, {0, 6, 7, 5}, {1, 6, 10, 6}, {0, 7, 9, 6}};  // to the others
// Rows of a cell's parameters: stiffness by class, damping by spring, then sine and cosine by
// class.
constexpr int damping_row = owner_classes;
constexpr int sine_row(bool damped) { return owner_classes + (damped ? direction_count : 0); }
constexpr int cosine_row(bool damped) { return sine_row(damped) + owner_classes; }

// Its masses, in the precision S of its state.
template <class S>
struct mass_arrays {
    int64_t count;        // sites, padded
    S* position[3];       // x, relative to the robot's own origin, m
    S* velocity[3];       // u, m/s
    S* next_velocity[3];  // u after the kick of this step, m/s
    S* predicted[3];      // p, m/s; the same memory as `velocity` in symplectic Euler
    S* lost_position[3];  // compensation; null unless compensated
    S* lost_velocity[3];
    const S* mass;          // kg
    const S* inverse_mass;  // 1/kg; 0 at a site that is not in use
    int64_t step[3];        // from a site to the next along each axis
    const float* faces;     // as in spring_body, [axis][count]; null without faces
    // Scratch of the thread, as above; zeros lie before it for the longest step.
    S* force[3];  // N; the same memory as the springs' in equal precision
};

// Between two force evaluations of a Runge-Kutta step, columns of [count].
template <class S>
struct stage_arrays {
    S* position[3];        // where the masses are for the next evaluation, m
    S* velocity[3];        // m/s
    S* position_slope[3];  // weighted sum of the velocities so far, m/s
    S* velocity_slope[3];  // weighted sum of the accelerations so far, m/s^2
};

// Adds the forces of all springs.
template <class F>
using pair_pass = void (*)(const spring_arrays<F>&, const effects::actuation::moment<F>&);
// What the springs of an XPBD step change and need besides: they see their ends at x + dt w, one
// after the other, and each changes w by its force, which is added to the forces.
template <class F>
struct sweep_arrays {
    F* velocity[3];         // w, m/s, [count]
    const F* inverse_mass;  // 1/kg, [count]
    const F* stiffness;     // k and c, times what reaction() leaves of them, [direction][count]
    const F* damping;       // null without damping
    const F* odd[3];        // 1 at sites of odd index along each axis, else 0, [count]
    int halves[3];          // along each axis, 2, or 1 where no spring starts at an odd index
    F dt;                   // s
};
template <class F>
using sweep_pass = void (*)(const spring_arrays<F>&, const sweep_arrays<F>&,
                            const effects::actuation::moment<F>&);
// Sites from `first` to before `end`.
struct site_range {
    int64_t first, end;
};
// Adds the forces of one effect on the masses. `params` is the effect's own params<S>. Returns
// sites beyond which no mass touches, if the effect is a contact.
template <class S>
using node_pass = site_range (*)(const mass_arrays<S>&, const void* params);
// Changes next_velocity by one effect's impulses over h on exposed faces, or by the
// friction of one contact on the masses that touch it.
template <class S>
using face_pass = void (*)(const mass_arrays<S>&, const void* params, S h);
template <class S>
using slip_pass = void (*)(const mass_arrays<S>&, site_range touching, const void* contact,
                           const void* friction, S h);
// Changes next_velocity by the push of one contact at the end of a step of h, and leaves that push
// (N) in force[0]; and by its friction, from there.
template <class S>
using press_pass = void (*)(const mass_arrays<S>&, const void* contact, S h);
// A scripted effect as its pass sees it: a program (physics/scripted/program.h) and the registers
// of one block of masses, scripted_block numbers each, written before they are read.
inline constexpr int scripted_block = 128;
template <class S>
struct scripted_law {
    const scripted::instruction* instructions;
    const double* constants;
    int instruction_count, constant_count;
    int16_t force[3];
    S* registers;
    double time;       // s
    double origin[3];  // the robot's own, m
};
// Adds its forces.
template <class S>
using scripted_pass = void (*)(const mass_arrays<S>&, const scripted_law<S>&);
template <class S>
using kick_pass = void (*)(const mass_arrays<S>&, S h);
// `share` as in predict(); not used without prediction.
template <class S>
using drift_pass = void (*)(const mass_arrays<S>&, S dt, S share);
// Of a Runge-Kutta step from `start`, whose forces have just been evaluated. A stage adds its
// slopes by `weight` and goes on to where they lead in h; the end adds the last ones and moves the
// masses, a sixth of dt for each weight.
template <class S>
using stage_pass = void (*)(const mass_arrays<S>& start, const stage_arrays<S>&, S weight, S h);
template <class S>
using stage_end_pass = void (*)(const mass_arrays<S>& start, const stage_arrays<S>&, S sixth);
// Rounds, or widens, `count` numbers.
using narrow_pass = void (*)(int64_t count, const double* from, float* to);
using widen_pass = void (*)(int64_t count, const float* from, double* to);

// Masses that broke a limit, and those faster than `coarse`.
struct limit_breaks {
    int32_t nonfinite, speed, coarse;
};
template <class S>
using mass_limit_pass = limit_breaks (*)(const mass_arrays<S>&, S max_speed, S coarse);
// Counts springs that are too long.
template <class F>
using spring_limit_pass = int32_t (*)(const spring_arrays<F>&, F max_stretch);

// Pair passes are chosen by the effects that act on springs, counted in the order of effects::all,
// springs left out.
inline constexpr unsigned pair_variants = 4;

// Which pair pass serves a scene.
constexpr unsigned pair_variant(unsigned scene_mask) {
    return (scene_mask & effects::bit<effects::damping> ? 1u : 0u) |
           (scene_mask & effects::bit<effects::actuation> ? 2u : 0u);
}

template <class F>
struct spring_passes {
    pair_pass<F> pair[pair_variants];
    sweep_pass<F> sweep[pair_variants];
    spring_limit_pass<F> limit;
};
template <class S>
struct mass_passes {
    node_pass<S> node[effects::all::count];    // null where the effect has no such hook
    slip_pass<S> slip[effects::all::count];    // null where the effect is no contact
    press_pass<S> press[effects::all::count];  // likewise
    slip_pass<S> pressed_slip[effects::all::count];
    face_pass<S> face[effects::all::count];  // null where the effect has no such hook
    scripted_pass<S> scripted;
    kick_pass<S> kick[2];            // [compensated]
    drift_pass<S> drift[2][2];       // [compensated][predicted]
    stage_pass<S> stage[2][2];       // [compensated][first]
    stage_end_pass<S> stage_end[2];  // [compensated]
    mass_limit_pass<S> limit;
};

struct pass_table {
    const char* isa;
    spring_passes<float> springs_single;
    spring_passes<double> springs_double;
    mass_passes<float> masses_single;
    mass_passes<double> masses_double;
    narrow_pass narrow;
    widen_pass widen;
    express_pass express;
};

// The tables of this build, and the one that `isa` names (null or empty: the best that this
// processor runs).
const pass_table& choose_passes(const char* isa);
// Names of the instruction sets that this processor runs, best first, comma-separated.
const char* available_isas();

template <class F>
const spring_passes<F>& spring_passes_of(const pass_table& table) {
    if constexpr (sizeof(F) == sizeof(float))
        return table.springs_single;
    else
        return table.springs_double;
}
template <class S>
const mass_passes<S>& mass_passes_of(const pass_table& table) {
    if constexpr (sizeof(S) == sizeof(float))
        return table.masses_single;
    else
        return table.masses_double;
}

}  // namespace limax::cpu
