// passes.h: the parts of a step on the CPU: loops over all sites or springs of one robot, each
// instantiated for what it uses and compiled once per instruction set, and the memory that they
// work on. SI units.
#pragma once

#include <span>

#include "body/springs.h"
#include "genome/network.h"
#include "physics/drive.h"
#include "physics/effects/all.h"
#include "physics/scripted/program.h"

namespace limax::cpu {

// One robot's springs as the passes see them, in the precision S of its state. Columns of sites
// have `count` elements, a multiple of site_block, on aligned memory.
template <class S>
struct spring_arrays {
    int64_t count;                  // sites, padded
    int64_t sites;                  // sites of the lattice
    int64_t step[direction_count];  // from a spring's near site to its far one
    int64_t used[direction_count];  // near sites that can have a spring along it, padded
    S rest[direction_count];        // L0, m
    const S* position[3];           // x, relative to the robot's own origin, m
    const S* velocity[3];           // p, what forces read, m/s
    const float* stiffness;         // [direction][count]
    const float* damping;
    const float* sine;
    const float* cosine;
    // Scratch of the thread, written before it is read within one step.
    S* force[3];  // N, [count]
    S* sums;      // [step][corner][3][sums_column]: what cells add to their corners, N
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

// One robot's masses.
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
    S* force[3];  // N; the same memory as the springs'
};

// Between two force evaluations of a Runge-Kutta step, columns of [count].
template <class S>
struct stage_arrays {
    S* position[3];        // where the masses are for the next evaluation, m
    S* velocity[3];        // m/s
    S* position_slope[3];  // weighted sum of the velocities so far, m/s
    S* velocity_slope[3];  // weighted sum of the accelerations so far, m/s^2
};

// How far the forces of springs are computed: the next cell, and where the sums of it and of the
// one before are kept.
struct pair_place {
    int64_t cell = 0, slot = 0, last_slot = 0;
};
// Computes the forces of springs, from `place` on for all cells before `end`, a multiple of
// site_block. Afterwards the forces on all sites before end - site_block are complete, at the
// lattice's end all.
template <class S>
using pair_pass = void (*)(const spring_arrays<S>&, const effects::actuation::moment<S>&,
                           pair_place& place, int64_t end);
// Sites from `first` to before `end`.
struct site_range {
    int64_t first, end;
};
// Adds the forces of one effect on the masses. `params` is the effect's own params<S>. Returns
// sites beyond which no mass touches, if the effect is a contact.
template <class S>
using node_pass = site_range (*)(const mass_arrays<S>&, const void* params);
// Parts of the world with more or less friction, in the robot's coordinates.
template <class S>
using patch_list = std::span<const effects::patches::params<S>>;
// Changes next_velocity by one effect's impulses over h on exposed faces, or by the
// friction of one contact on the masses that touch it.
template <class S>
using face_pass = void (*)(const mass_arrays<S>&, const void* params, S h);
template <class S>
using slip_pass = void (*)(const mass_arrays<S>&, site_range touching, const void* contact,
                           const void* friction, const patch_list<S>& patches, S h);
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
// A controller as its pass sees it: the program, and the registers of one block of voxels, whose
// inputs are filled.
template <class S>
struct controller_law {
    const scripted::program& program;
    const float* genes;
    S* registers;  // [register][scripted_block]
};
// Voxels whose corners are sensed.
template <class S>
struct voxel_senses {
    int count;
    const int64_t* lowest;  // site of the lowest corner, [count]
    int64_t corner[8];      // from there to the others
    S edge;                 // m
    const S* per_weight;    // as in sensors::sense_voxel(), [count]
    const S* push;          // of contacts, without their damping, N, [site]; null if none is read
    S* registers;           // inputs of the controller
};
template <class S>
using sense_pass = void (*)(const mass_arrays<S>&, const voxel_senses<S>&);
template <class S>
using controller_pass = void (*)(const controller_law<S>&, int voxels);
template <class S>
using scripted_pass = void (*)(const mass_arrays<S>&, const scripted_law<S>&);
template <class S>
using kick_pass = void (*)(const mass_arrays<S>&, S h);
// `share` as in predict(); not used without prediction.
template <class S>
using drift_pass = void (*)(const mass_arrays<S>&, S dt, S share);
// The parts of a Runge-Kutta step from `start`, whose forces have just been evaluated. A stage adds
// its slopes by `weight` and moves on to where they lead in h; the end adds the last ones and moves
// the masses, a sixth of dt for each weight.
template <class S>
using stage_pass = void (*)(const mass_arrays<S>& start, const stage_arrays<S>&, S weight, S h);
template <class S>
using stage_end_pass = void (*)(const mass_arrays<S>& start, const stage_arrays<S>&, S sixth);

// Masses that broke a limit, and those faster than `coarse`.
struct limit_breaks {
    int32_t nonfinite, speed, coarse;
};
template <class S>
using mass_limit_pass = limit_breaks (*)(const mass_arrays<S>&, S max_speed, S coarse);
// Counts springs that are too long.
template <class S>
using spring_limit_pass = int32_t (*)(const spring_arrays<S>&, S max_stretch);

// What moves the muscles.
enum drive { no_drive, sine_drive, controlled_drive, drives };
// Pair passes are chosen by damping and by what moves the muscles.
inline constexpr unsigned pair_variants = 2 * drives;

// Which pair pass serves a scene.
constexpr unsigned pair_variant(unsigned scene_mask) {
    const drive driven = scene_mask & effects::bit<effects::control>     ? controlled_drive
                         : scene_mask & effects::bit<effects::actuation> ? sine_drive
                                                                         : no_drive;
    return (scene_mask & effects::bit<effects::damping> ? 1u : 0u) + 2u * driven;
}

// The passes of one precision.
template <class S>
struct step_passes {
    pair_pass<S> pair[pair_variants];
    node_pass<S> node[effects::all::count];  // null where the effect has no such hook
    slip_pass<S> slip[effects::all::count];  // null where the effect is no contact
    face_pass<S> face[effects::all::count];  // null where the effect has no such hook
    scripted_pass<S> scripted;
    controller_pass<S> controller;
    sense_pass<S> sense;
    kick_pass<S> kick[2];            // [compensated]
    drift_pass<S> drift[2][2];       // [compensated][predicted]
    stage_pass<S> stage[2][2];       // [compensated][first]
    stage_end_pass<S> stage_end[2];  // [compensated]
    mass_limit_pass<S> limit_masses;
    spring_limit_pass<S> limit_springs;
};

struct pass_table {
    const char* isa;
    step_passes<float> in_float;
    step_passes<double> in_double;
    express_pass express;
};

// The tables of this build, and the one that `isa` names (null or empty: the best that this
// processor runs).
const pass_table& choose_passes(const char* isa);
// Names of the instruction sets that this processor runs, best first, comma-separated.
const char* available_isas();

template <class S>
const step_passes<S>& passes_of(const pass_table& table) {
    if constexpr (sizeof(S) == sizeof(float))
        return table.in_float;
    else
        return table.in_double;
}

}  // namespace limax::cpu
