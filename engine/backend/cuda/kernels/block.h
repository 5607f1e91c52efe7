// block.h: how a robot is stored in the shared memory of a block: places, masses, sums over all
// masses. Compiled with the defines of step.h. SI units.
#pragma once

#include "backend/cuda/kernels/block_memory.h"
#include "backend/cuda/kernels/contact_pairs.h"
#include "backend/cuda/kernels/control.h"
#include "backend/cuda/kernels/faces.h"
#include "backend/cuda/kernels/run.h"
#include "backend/cuda/kernels/springs.h"

namespace limax::cuda {

constexpr int sites = site_grid(lattice{}).count();
constexpr int sites_before = site_grid(lattice{}).corner(corners - 1);  // the first, in `drive`
constexpr int places = LIMAX_PLACES;
constexpr int threads = LIMAX_THREADS, warps = threads / 32;
constexpr int slots = LIMAX_CUBE_SLOTS + LIMAX_RIM_SLOTS;
// Warps take slots round by round. In a round with a cube every thread has room for its parameters.
constexpr int cell_rounds = (slots + warps - 1) / warps;
constexpr int cube_rounds = (LIMAX_CUBE_SLOTS + warps - 1) / warps;
constexpr int rim_rounds = cell_rounds - cube_rounds;
// A robot that is alone on its multiprocessor has registers for all corners of a cell at once.
constexpr bool alone = LIMAX_BLOCKS == 1 && warps <= 8;

// Offset of a corner from its cell in shared memory.
LIMAX_LAW constexpr int corner_place(int number) {
    return (number & 1) + (number >> 1 & 1) * LIMAX_ROW + (number >> 2) * LIMAX_PLANE;
}
// Offsets of a corner's sum from its cell's place.
LIMAX_LAW constexpr int corner_sum(int number) {
    return (number - 1) * places + corner_place(number);
}
// A square across these axes: offsets of its corners, numbered 0 to 3, and of their sums.
template <int axes>
struct square_across {
    static constexpr int first = axes & -axes, second = axes & ~first;
    __device__ static constexpr int number(int c) {
        return (c & 1 ? first : 0) | (c & 2 ? second : 0);
    }
    __device__ constexpr int place(int c) const { return corner_place(number(c)); }
    __device__ constexpr int sum(int c) const { return corner_sum(number(c)); }
};
// One whose axes differ from lane to lane.
struct alignas(16) any_square {
    int first, second, first_sum, second_sum;

    __device__ void across(int axes) {
        const int low = axes & -axes, high = axes & ~low;
        first = corner_place(low);
        second = corner_place(high);
        first_sum = corner_sum(low);
        second_sum = corner_sum(high);
    }
    __device__ int place(int c) const { return (c & 1 ? first : 0) + (c & 2 ? second : 0); }
    __device__ int sum(int c) const {
        return (c & 1 ? first_sum : 0) + (c & 2 ? second_sum : 0) + (c == 3 ? places : 0);
    }
};
// The place of a lane without a cell; no mass has it. The lane reads and adds 0 there.
__device__ inline int unused_place(const cell_entry& cell) { return -1 - cell.site; }
// Which of its multiprocessor's blocks this is, if the GPU has nothing else to do: they are
// assigned to the multiprocessors in turn.
__device__ inline int block_of_multiprocessor() {
    unsigned multiprocessors;
    asm("mov.u32 %0, %%nsmid;" : "=r"(multiprocessors));
    return int(blockIdx.x / multiprocessors);
}
__device__ inline int place_of(int site) {
    constexpr site_grid grid{lattice{}};
    const int row = site / grid.x;
    const int layer = row / grid.y;
    return site % grid.x + row % grid.y * LIMAX_ROW + layer * LIMAX_PLANE;
}
// The site at a place: the inverse of place_of().
__device__ inline int site_at(int place) {
    constexpr site_grid grid{lattice{}};
    const int in_layer = place % LIMAX_PLANE;
    return grid.at(in_layer % LIMAX_ROW, in_layer / LIMAX_ROW, place / LIMAX_PLANE);
}
// Whether a place is on the low side of the lattice across an axis; axis 3 is 0 again.
__device__ inline bool is_lowest(int axis, int place) {
    const int in_layer = place % LIMAX_PLANE;
    return axis % 3 == 0   ? in_layer % LIMAX_ROW == 0
           : axis % 3 == 1 ? in_layer < LIMAX_ROW
                           : place < LIMAX_PLANE;
}

// Parameters of the squares of a round in shared memory, as held_parameters has them, [..][thread].
constexpr int storing_threads = rim_rounds > 0 ? threads : 1;
struct stored_squares {
    spring_parameters first[rim_classes][storing_threads];
    float others[storing_threads];
    any_square mixed[LIMAX_MIXED ? storing_threads : 1];
};
// The constants of the masses of such a round, by thread.
struct stored_weights {
    typename wide<real>::four of[storing_threads];

    __device__ void store(const mass_state& m) {
        of[threadIdx.x] = {m.mass, m.inverse_mass, m.root_mass, 0};
    }
    __device__ void load(mass_state& m) const {
        const auto stored = of[threadIdx.x];
        m.mass = stored.x;
        m.inverse_mass = stored.y;
        m.root_mass = stored.z;
    }
};
struct stored_square {
    stored_squares& of_round;
    __device__ spring_parameters& of_class(int i) const { return of_round.first[i][threadIdx.x]; }
    __device__ float& damping(int) const { return of_round.others[threadIdx.x]; }
};

// Where laws act on faces: velocities after the kick, and the impulse on each corner of the face
// whose lowest corner is at a place, N s.
constexpr int face_places = has_faces ? places : 1;
struct face_memory {
    real after[3][face_places], impulse[3][face_places];
};
struct block_memory {
    corner_columns<places> at;   // every mass
    sum_columns<places, 1> sum;  // forces of springs on masses of other threads
    face_memory faces;
    stored_squares squares[rim_rounds > 0 ? rim_rounds : 1];
    stored_weights weights[rim_rounds > 0 ? rim_rounds : 1];
    effects::actuation::moment<real> moments[check_interval];  // of the muscles, from the
                                                               // last event on
    int64_t part[block_sums][warps];                           // of sums over all masses
    int64_t stop;                                              // last step of this launch
    int64_t sum_of[block_sums];
    step_times times;
    double shift[3];  // of the origin, m
    int moved;        // whether any of it is not 0
    robot_record record;
    control_block control;
    // gain times activation of the voxel whose lowest corner a site is, at the last tick and at the
    // next: 0 of sites without one, also before the first site
    real drive[2][controlled ? sites_before + sites : 1];
};
static_assert(sizeof(block_memory) <= LIMAX_SHARED_BYTES);

// ---- masses ----

// Stores what all threads may read of a mass.
__device__ inline void publish(const mass_state& m, int place, block_memory& shared) {
    shared.at.store(place, corner_of(m));
}

// This block's robot and its state, computed at each use so that they occupy no register between.
__device__ inline int64_t robot_of(const launch_arguments& launch) {
    return launch.running[blockIdx.x];
}
__device__ inline real* state_of(const launch_arguments& launch) {
    return launch.state + robot_of(launch) * (state_columns * sites);
}

// Adds up parts first .. first + count - 1 for the first thread.
__device__ inline void add_over_block(block_memory& shared, int first, int count) {
    __syncthreads();
    if (threadIdx.x == 0)
        for (int i = first; i < first + count; ++i) {
            int64_t sum = shared.part[i][0];
            for (int warp = 1; warp < warps; ++warp) sum += shared.part[i][warp];
            shared.sum_of[i] = sum;
        }
}
// Whether `value` is not 0 on any thread.
__device__ inline bool any_of_robot(int value) { return __syncthreads_or(value) != 0; }

}  // namespace limax::cuda
