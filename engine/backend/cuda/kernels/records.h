// records.h: what host and device exchange about robots and launches: plain structs of fixed
// layout, read by both. Includes laws only. SI units.
#pragma once

#include "body/spring_laws.h"
#include "physics/effects/all.h"
#include "physics/origin.h"
#include "physics/scripted/operations.h"
#include "physics/solid_pairs.h"
#include "physics/summary.h"

namespace limax::cuda {

// Kinds of samples, as in limax_trace_kind. The step kernel takes the centre of mass and the
// contact itself; where another sample is due it pauses for the measure kernel.
enum sample_kind {
    sample_center = 0,
    sample_position = 1,
    sample_velocity = 2,
    sample_contact = 3,
    sample_energy = 4,
    sample_strain = 5,
    uncontrolled_kinds = 6,
    sample_activation = 6,
    sample_sensor = 7,
    sample_kinds = 8
};
LIMAX_LAW constexpr bool taken_by_step(int kind) {
    return kind == sample_center || kind == sample_contact;
}

// As in limax_robot_status and limax_divergence.
enum robot_status : int32_t { robot_running = 1, robot_done = 2, robot_diverged = 4 };
enum divergence : int32_t {
    divergence_nonfinite = 1,
    divergence_speed = 2,
    divergence_stretch = 3,
    divergence_control = 4
};

// One robot: its plan, written by the host, and how far it is, written by the step kernel.
struct robot_record {
    double time_step;         // s
    uint64_t phase_per_step;  // of the muscles, 2^-64 turns; of a controller's clock per tick
    double ramp;              // s over which their amplitude rises
    int64_t settle_steps, steps;
    int64_t every[sample_kinds];   // steps between samples; 0 where nothing is recorded
    int64_t offset[sample_kinds];  // of the robot's first sample in its trace, in doubles
    double total_mass;             // kg
    double origin[3];              // the robot's own, m
    double center[3][3];           // centre of mass at t = 0, after half of the steps, at the end
    int64_t step;                  // done since the start of settling
    int64_t goal;                  // where the slice under way ends
    int64_t taken[sample_kinds];   // samples so far
    int64_t next_sample[sample_kinds];  // step of the next one; beyond every step without any
    int32_t status;                     // robot_status
    int32_t reason;                     // limax_divergence
    uint8_t begun;   // 1 between kick and drift, where both velocities are stored
    uint8_t coarse;  // as in limax_outcome
    int32_t masses;
    int64_t tick;         // steps between ticks of the controller
    int64_t ticks;        // so far
    int64_t next_tick;    // step of the next
    uint64_t noise_seed;  // of its sensors
};

// Columns of a controlled robot's memory, [column][voxel]; of two halves one is of the last tick,
// the other of the next.
struct control_layout {
    int states, messages;
    int measured, slots;  // inputs that are kept, and for how many ticks, where they are delayed
    int seen;             // inputs that are kept for samples

    LIMAX_LAW constexpr int activation() const { return 0; }  // two halves
    LIMAX_LAW constexpr int drive() const { return 2; }       // gain times activation, two halves
    LIMAX_LAW constexpr int said() const { return 4; }        // two halves
    LIMAX_LAW constexpr int state() const { return said() + 2 * messages; }
    LIMAX_LAW constexpr int past() const { return state() + states; }
    LIMAX_LAW constexpr int last_seen() const { return past() + measured * slots; }
    LIMAX_LAW constexpr int count() const { return last_seen() + seen; }
};
// Columns of `muscles` below.
LIMAX_LAW constexpr int muscle_columns_of(bool grows) { return grows ? 4 : 3; }
// Genes that a block keeps in shared memory; a controller with more reads them from global memory.
inline constexpr int most_shared_genes = 1024;
// Null in a scene without control.
template <class R>
struct control_memory {
    R* columns;          // [robot][column][voxel]
    const float* genes;  // of control, [robot][gene]
    float* muscles;      // gain, NaN where a voxel is empty, phase, 1/kg of the corners, and in a
                         // scene with growth the material, [robot][muscle_columns_of()][voxel]
};

// Where the components of the fields of an effect begin among those of all effects and instances.
LIMAX_LAW constexpr int first_value(int effect) {
    int first = 0, index = 0;
    effects::for_each([&]<class E>(E) {
        if (index++ < effect) first += effects::components<E> * effects::most_instances<E>;
    });
    return first;
}
LIMAX_LAW constexpr int components_of(int effect) {
    int count = 0, index = 0;
    effects::for_each([&]<class E>(E) {
        if (index++ == effect) count = effects::components<E>;
    });
    return count;
}

// Numbers of instances of effects that may be there several times, packed into one, and taken out
// again: as many bits for each such effect as its largest number has, in the order of effects::all.
// An effect without hooks acts between steps, where kernels count instances in scene_values.
template <class E>
LIMAX_LAW constexpr int instances_bits() {
    int bits = 0;
    if (effects::repeatable<E> && E::hooks != 0)
        for (int most = effects::most_instances<E>; most > 0; most /= 2) ++bits;
    return bits;
}
template <class E>
LIMAX_LAW constexpr int instances_shift() {
    int shift = 0, index = 0;
    effects::for_each([&]<class F>(F) {
        if (index++ < effects::index_of<E>) shift += instances_bits<F>();
    });
    return shift;
}
template <class E>
LIMAX_LAW constexpr int instances_in(uint64_t code) {
    constexpr int shift = instances_shift<E>(), bits = instances_bits<E>();
    static_assert(shift + bits < 64, "more effects than the code has room for");
    return int(code >> shift & ((uint64_t(1) << bits) - 1));
}
template <class Scene>
LIMAX_LAW uint64_t instances_code(const Scene& scene) {
    uint64_t code = 0;
    effects::for_each([&]<class E>(E) {
        if (instances_bits<E>() > 0)
            code |= uint64_t(scene.instances(effects::index_of<E>)) << instances_shift<E>();
    });
    return code;
}

// A scene's parameters: the components of all fields of each instance of each effect, one after the
// other.
struct scene_values {
    double value[first_value(effects::all::count)];
    effects::height_table heights;       // in the memory of the GPU
    int32_t count[effects::all::count];  // instances; 0 of effects that the scene lacks

    LIMAX_LAW const double* of(int effect, int instance = 0) const {
        return value + first_value(effect) + instance * components_of(effect);
    }
    LIMAX_LAW double* of(int effect, int instance = 0) {
        return value + first_value(effect) + instance * components_of(effect);
    }
};

// One cell of the lattice (cells.h). Axes are bits: x = 1, y = 2, z = 4.
struct cell_entry {
    int32_t site;  // its lowest corner; of a lane without a cell -1 - a place that no mass has
    int32_t axes;  // along which it reaches, and 8 times those of a cube or square in its place
};

// The parameters of every effect on masses, made for an origin at 0; those of effects that a scene
// lacks are never read. Kernels read them directly from constant memory, except for those
// that depend on the robot's origin. Repeatable effects make theirs in the kernel.
template <class R, class E, bool acts = effects::acts_on_masses<E> && !effects::repeatable<E>>
struct params_slot {};
template <class R, class E>
struct params_slot<R, E, true> {
    typename E::template params<R> value;
};
template <class R, class List = effects::all>
struct mass_params;
template <class R, class... E>
struct mass_params<R, effects::list<E...>> : params_slot<R, E>... {
    template <class F>
    LIMAX_LAW typename F::template params<R>& of() {
        return static_cast<params_slot<R, F>&>(*this).value;
    }
    template <class F>
    LIMAX_LAW const typename F::template params<R>& of() const {
        return static_cast<const params_slot<R, F>&>(*this).value;
    }
};

// Masses of a robot's surface that are, or soon may be, within reach of each other. Null in a scene
// where none meet.
struct pair_lists {
    const int32_t* surface;     // sites of the masses of the surface, ascending, then -1s,
                                // [robot][site]
    int32_t* partners;          // [robot][1 + most_partners][site]: how many, then their sites
    float* listed_at;           // where masses were when lists were made, m, [robot][3][site]
    unsigned long long* moved;  // the last step after which a mass was too far from there, [robot];
                                // on the grid path
};
// Partners of a mass that fit in its list. A mass with more searches the whole surface.
inline constexpr int most_partners = 24;

// A rigid block of one robot: put in its place by the host, moved by the step kernel. It is called
// "solid" in names, since a block is also one of threads.
struct solid_record {
    solid::body body;
    solid::view seen;     // as masses see it
    double center[3][3];  // as in robot_record, of the block
    int64_t every;        // steps between samples of its trace; 0 where nothing is recorded
    int64_t offset;       // of its first sample, in doubles
    int64_t taken;        // samples so far
};
// A mass that touches solids of its robot.
template <class R>
struct touching_mass {
    double mass, inverse_mass;  // kg, 1/kg
    effects::vector<R> before;  // velocity before the kick and after it, m/s
    effects::vector<R> after;
};
// The same with how it touches each; all have its site, and one that it does not touch no push.
template <class R, int solids>
struct solid_touch : touching_mass<R> {
    solid::touch of[solids];
};
// Its size in doubles.
template <class R>
LIMAX_LAW constexpr int doubles_of_touch(int solids) {
    return (int(sizeof(touching_mass<R>)) + solids * int(sizeof(solid::touch))) / 8;
}
// Places of the block at fixed contacts: at each instance all eight corners, or with `edges` as
// many as it may have.
LIMAX_LAW constexpr int corners_of_solid(int contacts, bool edges) {
    return (edges ? solid::most_touches : 8) * contacts;
}

// Places of solids in each other.
LIMAX_LAW constexpr int pairs_of_solids(int solids) {
    return solids * (solids - 1) / 2 * solid::most_of_pair;
}

// The blocks of all robots; null in a scene without a block.
template <class R>
struct solid_columns {
    solid_record* records;     // [robot][solid]
    uint32_t* marked;          // a bit for each mass that touches, [robot][marks_of(sites)]
    double* touches;           // solid_touch<R> of masses that touch, [robot][2][site]: by their
                               // site; listed
    solid::touch* corners;     // [robot][solid][corners_of_solid(contacts)]
    solid::pair_touch* pairs;  // [robot][pairs_of_solids()]
    R* after;                  // velocities after the kick, [robot][3][site]; on the grid path
                               // those of grid_launch serve
    double* samples;           // [sample][solid][solid::sample_width]
};
LIMAX_LAW constexpr int marks_of(int64_t sites) { return int((sites + 31) / 32); }

// The arguments of the step kernel; R is the type of state and forces. Columns of robots are
// `sites` elements apart.
template <class R>
struct step_launch {
    robot_record* records;    // [robot]
    const int32_t* running;   // indices of the robots of this launch, [block]
    const cell_entry* cells;  // block_plan: [slot][32], cubes first, then the rim
    const float* mass;        // kg, [robot][site]; below 0, with this size, that of a held mass
    const float* springs;     // k, then c, then A and B as the scene needs them,
                              // [robot][parameter][direction][site]
    R* state;                 // [robot][column][site]: see state_column
    const float* faces;       // as in prepare_launch
    pair_lists pairs;
    double* samples[sample_kinds];
    int64_t most;    // steps of each robot in the slice; 0 to go on with the slice under way
    double rest[3];  // L0 of edges, face diagonals and space diagonals, m
    float rest_single[3];
    double max_speed;    // m/s
    double max_stretch;  // times L0
    scene_values scene;
    mass_params<R> params;
    solid_columns<R> solids;
    control_memory<R> control;
    R parameters[scripted::most_parameters];  // of scripted effects, then of the controller
};

// The arguments of the grid kernel, in which several blocks share a robot.
template <class R>
struct grid_launch {
    step_launch<R> step;
    R* after;     // velocities after the kick and impulses of faces, [robot][2][3][site]
    R* exchange;  // masses as springs see them, [robot][2][value][site]
    unsigned long long* sums;  // over all masses, modulo 2^64, [robot][sum_sets][grid_sums]
    unsigned* arrived;         // blocks that came to a barrier so far, [robot]
    lattice grid;
    int blocks_of_robot;
};

// What tiles exchange: 16 bytes that are written and read as one, twelve of a value and the number
// of the step that it is of.
struct alignas(16) packet {
    uint32_t word[3], number;
};
// Rows of a tile's table, [tile][row][thread]: what its threads own and receive.
struct tile_rows {
    int rounds;       // cells of a thread
    int halo, inbox;  // most masses and forces that a thread receives

    LIMAX_LAW constexpr int site() const { return 0; }  // of a cell, -1 without one, [round]
    // Of its lowest corner: the place; bit 16: other tiles read the mass; bits 17 to 23: corners
    // that are masses of this tile, bits 24 to 30: of another.
    LIMAX_LAW constexpr int cell() const { return rounds; }
    LIMAX_LAW constexpr int mass() const { return 2 * rounds; }  // its packet, [halo]
    LIMAX_LAW constexpr int place() const { return mass() + halo; }
    LIMAX_LAW constexpr int mass_site() const { return place() + halo; }  // -1 without one
    // Corners of cells that it is.
    LIMAX_LAW constexpr int ends() const { return mass_site() + halo; }
    LIMAX_LAW constexpr int force() const { return ends() + halo; }  // its packet, [inbox]
    LIMAX_LAW constexpr int sum() const { return force() + inbox; }
    LIMAX_LAW constexpr int force_site() const { return sum() + inbox; }  // -1 without one
    LIMAX_LAW constexpr int count() const { return force_site() + inbox; }
};
// The arguments of the tiles kernel, in which several blocks share a robot. Robots are counted in
// the launch here. All but the table is 0.
template <class R>
struct tile_launch {
    step_launch<R> step;
    const int32_t* table;  // see tile_rows
    packet* masses;        // as springs see them, [robot][part of a mass][tile][round][thread]
    packet*
        forces;  // on corners 1 to 7, [robot][part of a force][tile][sender][corner - 1][thread]
    unsigned long long* sums;  // as in grid_launch
    unsigned* arrived;         // at barriers; at the first one; tiles with masses, [robot][3]
};

// Sums over all masses of a robot: two words of the centre of mass along each axis, masses that
// touch a contact; on the grid path also masses and springs beyond a limit. Whole numbers add
// up to the same in any order, so that no path and no number of threads or blocks changes a bit.
enum sum_over_masses {
    sum_center = 0,
    sum_touching = 6,
    block_sums = 7,
    sum_nonfinite = 7,
    sum_speed = 8,
    sum_stretch = 9,
    sum_coarse = 10,
    grid_sums = 11
};
inline constexpr int sum_sets = 3;  // of a robot that several blocks share

// Results of the prepare kernel for one robot.
struct prepared_robot {
    double total_mass;       // kg
    double time_step_bound;  // s
    int32_t corner[3];       // lowest site of its bounding box
    int32_t masses;
};

// The arguments of the prepare kernel: one block for each robot.
template <class R>
struct prepare_launch {
    const int32_t* robots;  // places in the population
    const uint8_t* voxels;  // of the population, [robot][voxel]
    const float* weights;   // [robot][3][voxel]
    prepared_robot* prepared;
    float* mass;  // this and the following as in step_launch and measure_launch
    float* springs;
    int32_t* ranks;
    R* state;
    float* faces;      // kg, mass of the lightest corner of each exposed face, 0 where no face is
                       // exposed, [robot][axis][site]; null in a scene without laws on faces
    int32_t* surface;  // as in pair_lists
    lattice grid;
    int32_t summed;     // stiffness is the sum over a spring's owners
    int32_t effects;    // bits of the scene's, which the kernel's include
    int32_t by_voxels;  // as in spring_constants
    double edge;        // h, m
    double position[3], origin[3], velocity[3];
    scene_values scene;
    material_law materials[16];
    float* muscles;  // as in control_memory
};

// The arguments of the measure kernel: one block for each robot.
template <class R>
struct measure_launch {
    robot_record* records;
    const int32_t* running;
    const int32_t* ranks;  // number of a site's mass, -1 without one, [robot][site]
    const float* mass;
    const float* springs;
    const R* state;
    const int32_t* surface;  // as in pair_lists
    double* samples[sample_kinds];
    lattice grid;
    double rest[3];
    scene_values scene;
    const R* control;  // columns, as in control_memory
};

// Threads of a block of these kernels.
inline constexpr int prepare_threads = 512, measure_threads = 256, summarize_threads = 64;

// Bytes of arguments that drivers and compilers support since CUDA 12.1.
static_assert(sizeof(grid_launch<double>) <= 32764 && sizeof(tile_launch<double>) <= 32764 &&
              sizeof(prepare_launch<double>) <= 32764 && sizeof(measure_launch<double>) <= 32764);

// The arguments of the summarize kernel.
struct summarize_launch {
    const robot_record* records;
    const int32_t* ended;      // robots
    trace_summary* summaries;  // [place in `ended`]
    const double* samples[sample_kinds];
    int32_t count;  // of `ended`
};

// Columns of a robot's state: three axes each, in this order; the last two in `compensated` only.
enum state_column {
    column_position = 0,
    column_velocity = 3,
    column_next_velocity = 6,
    column_lost_position = 9,
    column_lost_velocity = 12
};

}  // namespace limax::cuda
