// slabs.h: how a robot is stored in the shared memory of a block, or of a cluster of blocks that
// share the lattice in slabs along z: places, cells, masses, data exchanged between blocks, sums
// over all masses. Compiled with the defines of step.h. SI units.
#pragma once

#include "backend/cuda/kernels/block_memory.h"
#include "backend/cuda/kernels/cluster.h"
#include "backend/cuda/kernels/contact_pairs.h"
#include "backend/cuda/kernels/faces.h"
#include "backend/cuda/kernels/run.h"
#include "backend/cuda/kernels/springs.h"

namespace limax::cuda {

constexpr int sites = site_grid(lattice{}).count();
constexpr int places = LIMAX_PLANE * LIMAX_LAYERS;
constexpr int threads = LIMAX_THREADS, warps = threads / 32;
LIMAX_LAW constexpr int rounds(int items, int at_once) { return (items + at_once - 1) / at_once; }
// Warps take slots round by round. In a round with a cube every thread has room for its parameters.
constexpr int cell_rounds = rounds(LIMAX_CUBE_SLOTS + LIMAX_RIM_SLOTS, warps);
constexpr int cube_rounds = rounds(LIMAX_CUBE_SLOTS, warps);
constexpr int rim_rounds = cell_rounds - cube_rounds;
constexpr int mass_rounds = rounds(LIMAX_MASS_SLOTS, warps);

// Offset of a corner from its cell in shared memory.
LIMAX_LAW constexpr int corner_place(int number) {
    return (number & 1) + (number >> 1 & 1) * LIMAX_ROW + (number >> 2) * LIMAX_PLANE;
}
// The lowest layer of voxels of a block.
__device__ inline int first_layer(int rank) { return rank * LIMAX_NZ / cluster_blocks; }
__device__ inline int place_of(int site) {
    constexpr site_grid grid{lattice{}};
    const int row = site / grid.x;
    const int layer = row / grid.y - first_layer(cluster_rank());
    return site % grid.x + row % grid.y * LIMAX_ROW + layer * LIMAX_PLANE;
}
// The site at a place: the inverse of place_of().
__device__ inline int site_at(int place) {
    constexpr site_grid grid{lattice{}};
    const int in_layer = place % LIMAX_PLANE;
    return grid.at(in_layer % LIMAX_ROW, in_layer / LIMAX_ROW,
                   place / LIMAX_PLANE + first_layer(cluster_rank()));
}
// Whether a place is on the low side of the lattice across an axis; axis 3 is 0 again.
__device__ inline bool is_lowest(int axis, int place) {
    const int in_layer = place % LIMAX_PLANE;
    return axis % 3 == 0   ? in_layer % LIMAX_ROW == 0
           : axis % 3 == 1 ? in_layer < LIMAX_ROW
                           : place < LIMAX_PLANE && cluster_rank() == 0;
}
// The masses of a block's lowest layer are also the topmost of the block below: offset of their
// places there from those here, 0 for a mass that no other block has.
__device__ inline int place_below(int place) {
    if (cluster_blocks == 1) return 0;
    const int rank = cluster_rank();
    if (rank == 0 || place >= LIMAX_PLANE) return 0;
    return (first_layer(rank) - first_layer(rank - 1)) * LIMAX_PLANE;
}

// Parameters of the springs of one cell: the first in registers, the others in shared memory,
// [spring][thread].
template <int in_registers>
struct spring_set {
    spring_parameters held[in_registers > 0 ? in_registers : 1];
    spring_parameters* shared;

    __device__ spring_parameters& operator[](int i) {
        return i < in_registers ? held[i] : shared[(i - in_registers) * threads];
    }
    __device__ const spring_parameters& operator[](int i) const {
        return i < in_registers ? held[i] : shared[(i - in_registers) * threads];
    }
};
constexpr int cube_in_memory = cube_springs - LIMAX_CUBE_HELD;
constexpr int parameters_in_memory =
    threads * (cube_rounds * cube_in_memory + rim_rounds * rim_springs);

// Where laws act on faces: velocities after the kick, and the impulse on each corner of the face
// whose lowest corner is at a place, N s.
constexpr int face_places = has_faces ? places : 1;
struct face_memory {
    mass_real after[3][face_places], impulse[3][face_places];
};
// What any_of_robot() may be called for between two barriers.
enum question {
    limits_broken,
    nonfinite_found,
    speed_found,
    divergence_found,
    coarse_found,
    mass_moved,
    questions
};

struct block_memory {
    corner_columns<places> at;  // every mass
    sum_columns<places> sum;    // forces of springs
    private_columns<places> own;
    face_memory faces;
    spring_parameters parameters[parameters_in_memory > 0 ? parameters_in_memory : 1];
    effects::actuation::moment<spring_real> now;   // of the muscles
    int64_t part[block_sums][warps];               // of sums over all masses
    int64_t of_block[block_sums][cluster_blocks];  // the same, of every block
    int64_t sum_of[block_sums];                    // and of all
    int answer[questions][cluster_blocks];         // of any_of_robot(), by block
    double shift[3];                               // of the origin, m
    int moved;                                     // whether any of it is not 0
    robot_record record;
    int64_t stop;  // last step of this launch
};
static_assert(sizeof(block_memory) <= LIMAX_SHARED_BYTES);

// ---- cells ----

// Places of a cell. The axes of a square or bar differ from lane to lane.
struct cell_place {
    int at;                     // its lowest corner; below 0 for no cell
    int first, second;          // offsets of the ends of its axes; 0 for the second of a bar
    int first_sum, second_sum;  // the same among the sums
};

__device__ inline cell_place place_of_cell(const cell_entry& cell) {
    if (cell.site < 0) return {-1, 0, 0, 0, 0};
    const int first = cell.axes & -cell.axes, second = cell.axes & ~first;
    return {place_of(cell.site), corner_place(first), corner_place(second),
            first * places + corner_place(first), second * places + corner_place(second)};
}
__device__ inline int rim_corner(const cell_place& place, int c) {
    return place.at + (c & 1 ? place.first : 0) + (c & 2 ? place.second : 0);
}

template <class Set>
__device__ inline void load_cube(Set&& set, const float* columns, const cell_entry& cell) {
    constexpr site_grid grid{lattice{}};
#pragma unroll
    for (int i = 0; i < cube_springs; ++i) {
        const cube_spring s = cube_spring_at(i);
        set[i].load(grid, columns, s.direction * sites + cell.site + grid.corner(s.near));
    }
}
template <class Set>
__device__ inline void load_rim(Set&& set, const float* columns, const cell_entry& cell) {
    constexpr site_grid grid{lattice{}};
    const int first = cell.axes & -cell.axes;
    const bool bar = cell.axes == first;
#pragma unroll
    for (int i = 0; i < rim_springs; ++i) {
        const int near = rim_near(i) ? grid.corner(first) : 0;
        if (i == 0 || !bar)
            set[i].load(grid, columns, rim_direction(cell.axes, i) * sites + cell.site + near);
        else
            set[i] = {};
    }
}

// ---- masses ----

__device__ inline void add_sums(force& total, const block_memory& shared, int first, int place) {
#pragma unroll
    for (int c = first; c < first + 4; ++c) {
        const force part = shared.sum.load(c * places + place);
        total.x += part.x;
        total.y += part.y;
        total.z += part.z;
    }
}
// The sums on the upper corners of the cells below may be another block's.
__device__ inline force force_on(int place, block_memory& shared) {
    force total{};
    add_sums(total, shared, 0, place);
    const int below = place_below(place);
    if (below == 0)
        add_sums(total, shared, 4, place);
    else
        add_sums(total, in_block(shared, cluster_rank() - 1), 4, place + below);
    return total;
}

// Stores what all threads may read of a mass, and what registers do not keep until the next step.
__device__ inline void publish(const mass_state& m, int place, block_memory& shared) {
    shared.at.store(place, corner_of(m));
    shared.own.store(place, m);
    if (const int below = place_below(place); below != 0)
        in_block(shared, cluster_rank() - 1).at.store(place + below, corner_of(m));
}
// Loads what publish() stored.
__device__ inline void recall(mass_state& m, int place, const block_memory& shared) {
    shared.own.load(place, m);
    if constexpr (shares_state) take_corner(m, shared.at.load(place));
}

// This block's robot and its state, computed at each use so that they occupy no register between.
__device__ inline int64_t robot_of(const launch_arguments& launch) {
    return launch.running[blockIdx.x / cluster_blocks];
}
__device__ inline mass_real* state_of(const launch_arguments& launch) {
    return launch.state + robot_of(launch) * (state_columns * sites);
}

// A mass of this block or another as springs read it.
__device__ inline corner corner_of_robot(int site, block_memory& shared) {
    if constexpr (cluster_blocks == 1) return shared.at.load(place_of(site));
    constexpr site_grid grid{lattice{}};
    const int z = site / (grid.x * grid.y);
    // the topmost masses are the last block's
    int rank = cluster_blocks - 1;
    while (rank > 0 && z < first_layer(rank)) --rank;
    const int in_layer = site % (grid.x * grid.y);
    return in_block(shared, rank)
        .at.load(in_layer % grid.x + in_layer / grid.x * LIMAX_ROW +
                 (z - first_layer(rank)) * LIMAX_PLANE);
}

// The site of this thread's mass in round k.
__device__ inline int site_of(const launch_arguments& launch, int k) {
    return launch.masses[cluster_rank() * (LIMAX_MASS_SLOTS * 32) + k * threads + threadIdx.x];
}

// Sums over all masses of a robot: by warp, by block, by cluster.
__device__ inline void add_over_warp(int64_t value, int64_t part[warps]) {
    value = sum_over_warp(value);
    if (threadIdx.x % 32 == 0) part[threadIdx.x / 32] = value;
}
// Adds up parts first .. first + count - 1 for the first thread of every block.
__device__ inline void add_over_blocks(block_memory& shared, int first, int count) {
    __syncthreads();
    if (threadIdx.x == 0)
        for (int i = first; i < first + count; ++i) {
            int64_t sum = shared.part[i][0];
            for (int warp = 1; warp < warps; ++warp) sum += shared.part[i][warp];
            if constexpr (cluster_blocks == 1)
                shared.sum_of[i] = sum;
            else
                for (int block = 0; block < cluster_blocks; ++block)
                    in_block(shared, block).of_block[i][cluster_rank()] = sum;
        }
    if constexpr (cluster_blocks == 1) return;
    meet_cluster();
    if (threadIdx.x == 0)
        for (int i = first; i < first + count; ++i) {
            int64_t sum = shared.of_block[i][0];
            for (int block = 1; block < cluster_blocks; ++block) sum += shared.of_block[i][block];
            shared.sum_of[i] = sum;
        }
}
// Whether `value` is not 0 on any thread of any block.
__device__ inline bool any_of_robot(block_memory& shared, question asked, int value) {
    const int here = __syncthreads_or(value);
    if constexpr (cluster_blocks == 1) return here != 0;
    if (threadIdx.x < cluster_blocks)
        in_block(shared, int(threadIdx.x)).answer[asked][cluster_rank()] = here;
    meet_cluster();
    int any = 0;
    for (int block = 0; block < cluster_blocks; ++block) any |= shared.answer[asked][block];
    return any != 0;
}

}  // namespace limax::cuda
