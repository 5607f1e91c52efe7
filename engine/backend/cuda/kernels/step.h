// step.h: whole runs of robots that fit the shared memory of a block, or of a cluster of blocks
// that share the lattice in slabs along z: one block or cluster per robot, the time loop inside.
// Springs dealt out by cells.h, their parameters in registers; positions and the velocities that
// forces read in shared memory. Compiled for one scene (scene.h), lattice (springs.h) and plan of
// the block (block_plan.h):
//   LIMAX_ROW, LIMAX_PLANE             places between neighbours along y and z in shared memory
//   LIMAX_CLUSTER, LIMAX_LAYERS        blocks of a robot, layers of places in each
//   LIMAX_CUBE_SLOTS, LIMAX_RIM_SLOTS  slots of cells
//   LIMAX_MASS_SLOTS                   slots of masses
//   LIMAX_THREADS, LIMAX_BLOCKS        threads of a block, blocks of a multiprocessor
//   LIMAX_CUBE_HELD                    springs of a cube whose parameters registers hold
//   LIMAX_SHARED_BYTES                 dynamic shared memory of a block
// SI units.
#pragma once

#include "backend/cuda/kernels/block_memory.h"
#include "backend/cuda/kernels/cluster.h"
#include "backend/cuda/kernels/run.h"
#include "backend/cuda/kernels/springs.h"

namespace limax::cuda {

constexpr int sites = site_grid(lattice{}).count();
constexpr int places = LIMAX_PLANE * LIMAX_LAYERS;
constexpr int threads = LIMAX_THREADS, warps = threads / 32;
LIMAX_LAW constexpr int rounds(int items, int at_once) { return (items + at_once - 1) / at_once; }
// Warps take slots in turn. A round that has a cube keeps parameters for one on every thread.
constexpr int cell_rounds = rounds(LIMAX_CUBE_SLOTS + LIMAX_RIM_SLOTS, warps);
constexpr int cube_rounds = rounds(LIMAX_CUBE_SLOTS, warps);
constexpr int rim_rounds = cell_rounds - cube_rounds;
constexpr int mass_rounds = rounds(LIMAX_MASS_SLOTS, warps);

// How far a corner lies from its cell in shared memory.
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
// The masses of a block's lowest layer are also the topmost that the block below sees: how far
// their places there lie from those here, 0 for a mass that no other block sees.
__device__ inline int place_below(int place) {
    if (cluster_blocks == 1) return 0;
    const int rank = cluster_rank();
    if (rank == 0 || place >= LIMAX_PLANE) return 0;
    return (first_layer(rank) - first_layer(rank - 1)) * LIMAX_PLANE;
}

// Parameters of the springs of one cell: the first in registers, and those for which registers are
// too scarce in shared memory, [spring][thread].
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

struct block_memory {
    corner_columns<places> at;  // every mass
    sum_columns<places> sum;    // forces of springs
    private_columns<places> own;
    spring_parameters parameters[parameters_in_memory > 0 ? parameters_in_memory : 1];
    effects::actuation::moment<spring_real> now;   // of the muscles
    int64_t part[block_sums][warps];               // of sums over all masses
    int64_t of_block[block_sums][cluster_blocks];  // the same, of every block
    int64_t sum_of[block_sums];                    // and of all
    int broken[5][cluster_blocks];                 // limits, by block
    double shift[3];                               // of the origin, m
    int moved;                                     // whether any of it is not 0
    robot_record record;
    int64_t stop;  // last step of this launch
};
static_assert(sizeof(block_memory) <= LIMAX_SHARED_BYTES);
static_assert(!has_faces && !meets, "effects between masses that no spring joins need grid.h");

// ---- cells ----

// Where a cell lies. A square's or bar's axes are its lane's own.
struct cell_place {
    int at;                     // its lowest corner; below 0 for no cell
    int first, second;          // how far the ends of its axes lie; 0 for the second of a bar
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

// Stores what all threads may read of a mass, and what no register holds until the next step.
__device__ inline void publish(const mass_state& m, int place, block_memory& shared) {
    shared.at.store(place, corner_of(m));
    shared.own.store(place, m);
    if (const int below = place_below(place); below != 0)
        in_block(shared, cluster_rank() - 1).at.store(place + below, corner_of(m));
}
// Takes back what publish() stored.
__device__ inline void recall(mass_state& m, int place, const block_memory& shared) {
    shared.own.load(place, m);
    if constexpr (shares_state) take_corner(m, shared.at.load(place));
}

// This block's robot and its state, found anew at both ends of a launch so that no register holds
// them meanwhile.
__device__ inline int64_t robot_of(const launch_arguments& launch) {
    return launch.running[blockIdx.x / cluster_blocks];
}
__device__ inline mass_real* state_of(const launch_arguments& launch) {
    return launch.state + robot_of(launch) * (state_columns * sites);
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
// Whether any thread of any block says so. `use` tells apart what is asked at the same step.
__device__ inline bool any_of_robot(block_memory& shared, int use, int value) {
    const int here = __syncthreads_or(value);
    if constexpr (cluster_blocks == 1) return here != 0;
    if (threadIdx.x < cluster_blocks)
        in_block(shared, int(threadIdx.x)).broken[use][cluster_rank()] = here;
    meet_cluster();
    int any = 0;
    for (int block = 0; block < cluster_blocks; ++block) any |= shared.broken[use][block];
    return any != 0;
}

}  // namespace limax::cuda

extern "C" __global__ void __launch_bounds__(LIMAX_THREADS, LIMAX_BLOCKS)
    limax_advance(const __grid_constant__ limax::cuda::launch_arguments launch) {
    using namespace limax;
    using namespace limax::cuda;
    extern __shared__ __align__(16) char memory[];
    block_memory& shared = *reinterpret_cast<block_memory*>(memory);
    const int thread = threadIdx.x, rank = cluster_rank();

    // ---- what this thread owns ----

    spring_set<LIMAX_CUBE_HELD> cube[cube_rounds];
#pragma unroll
    for (int k = 0; k < cube_rounds; ++k)
        cube[k].shared = shared.parameters + k * cube_in_memory * threads + thread;
    const auto rim = [&](int round) {
        const int before = cube_rounds * cube_in_memory + round * rim_springs;
        return spring_set<0>{{}, shared.parameters + before * threads + thread};
    };
    cell_place place[cell_rounds];
    // on_cube(place, parameters) or on_rim(place, parameters) for each cell of this thread
    const auto each_cell = [&](const auto& on_cube, const auto& on_rim) {
#pragma unroll
        for (int k = 0; k < cell_rounds; ++k) {
            if (place[k].at < 0) continue;
            if (k >= cube_rounds)
                on_rim(place[k], rim(k - cube_rounds));
            else if ((k + 1) * warps <= LIMAX_CUBE_SLOTS ||
                     k * warps + thread / 32 < LIMAX_CUBE_SLOTS)
                on_cube(place[k], cube[k]);
            else
                on_rim(place[k], cube[k]);
        }
    };
    const cell_entry* cells = launch.cells + rank * ((LIMAX_CUBE_SLOTS + LIMAX_RIM_SLOTS) * 32);
    const int32_t* mass_sites = launch.masses + rank * (LIMAX_MASS_SLOTS * 32);
    const float* columns =
        launch.springs + robot_of(launch) * (spring_columns * direction_count * sites);
#pragma unroll
    for (int k = 0; k < cell_rounds; ++k) {
        const int slot = k * warps + thread / 32;
        const cell_entry cell = slot < LIMAX_CUBE_SLOTS + LIMAX_RIM_SLOTS
                                    ? cells[k * threads + thread]
                                    : cell_entry{-1, 0};
        place[k] = place_of_cell(cell);
        if (cell.site < 0) continue;
        if (k >= cube_rounds)
            load_rim(rim(k - cube_rounds), columns, cell);
        else if (slot < LIMAX_CUBE_SLOTS)
            load_cube(cube[k], columns, cell);
        else
            load_rim(cube[k], columns, cell);
    }
    mass_state mass[mass_rounds];
    int mass_place[mass_rounds];
    mass_real next_velocity[mass_rounds][3];
#pragma unroll
    for (int k = 0; k < mass_rounds; ++k) {
        const int slot = k * warps + thread / 32;
        const int site = slot < LIMAX_MASS_SLOTS ? mass_sites[k * threads + thread] : -1;
        mass_place[k] = site < 0 ? -1 : place_of(site);
        if (site < 0) continue;
        load_mass(mass[k], next_velocity[k], launch.mass[robot_of(launch) * sites + site],
                  state_of(launch) + site, sites);
        shared.own.begin(mass_place[k], mass[k]);
    }
    const auto each_mass = [&](const auto& visit) {
#pragma unroll
        for (int k = 0; k < mass_rounds; ++k)
            if (mass_place[k] >= 0) visit(k);
    };
    // sums of cells that do not exist stay 0
    for (int slot = thread; slot < corners * places; slot += threads) shared.sum.store(slot, {});
    copy_record(shared.record, launch.records[robot_of(launch)], thread, threads);
    __syncthreads();

    robot_record& record = shared.record;
    if (thread == 0) shared.stop = stop_of(launch, record);
    __syncthreads();
    // nothing is left to do in this slice
    if (record.begun && shared.stop <= record.step) {
        if (rank == 0) copy_record(launch.records[robot_of(launch)], record, thread, threads);
        return;
    }
    const mass_real dt = mass_real(record.time_step);
    scene_params params(launch.params);
    follow_origin(params, launch.scene, record.origin);

    const auto finish = [&](int k, mass_real share) {
        finish_mass(mass[k], next_velocity[k], dt, share);
        publish(mass[k], mass_place[k], shared);
    };
    // All springs share the muscles' moment: the last warp, which has the fewest masses, finds it.
    const auto tell_time = [&](int64_t step) {
        if (!actuated || thread < threads - 32) return;
        const auto now = moment_at(launch, record, step);
        if (thread == threads - 1) shared.now = now;
    };

    // every block has laid out its memory before another writes there
    meet_cluster();
    // A slice ends between kick and drift, where both velocities are at hand.
    const bool begun = record.begun;
    each_mass([&](int k) {
        if (begun)
            finish(k, record.step == 0 ? mass_real(1) : mass_real(0.5));
        else
            publish(mass[k], mass_place[k], shared);
    });
    tell_time(record.step + begun);
    meet_cluster();

    // `record.step` is the step of the last event, `since_event` how long ago that was.
    int since_event = begun, until_event = begun;
    bool half_kick = false, last = false;
    while (true) {
        if (since_event == until_event) {
            const int64_t step = record.step + since_event;
            if (step % check_interval == 0 || step == record.steps) {
                int broken = 0;
                const auto coarse = mass_real(coarse_speed(launch.rest[0], record.time_step));
                each_mass([&](int k) {
                    recall(mass[k], mass_place[k], shared);
                    broken |= broken_by_mass(mass[k], launch, coarse);
                });
                bool too_long = false;
                each_cell(
                    [&](const cell_place& at, const auto& set) {
                        too_long |= cube_stretched(launch, set, [&](int c) {
                            return shared.at.load(at.at + corner_place(c));
                        });
                    },
                    [&](const cell_place& at, const auto& set) {
                        too_long |= rim_stretched(
                            launch, set, [&](int c) { return shared.at.load(rim_corner(at, c)); });
                    });
                if (too_long) broken |= limit_stretch;
                if (any_of_robot(shared, 0, broken)) {
                    const bool diverged = any_of_robot(shared, 3, broken & limits_of_divergence);
                    const bool coarse_seen = any_of_robot(shared, 4, broken & limit_coarse);
                    const bool nonfinite = any_of_robot(shared, 1, broken & limit_nonfinite);
                    const bool speed = any_of_robot(shared, 2, broken & limit_speed);
                    if (thread == 0 && coarse_seen) record.coarse = 1;
                    if (diverged) {
                        if (thread == 0) note_divergence(record, step, nonfinite, speed);
                        break;
                    }
                }
            }
            if (center_wanted(record, step)) {
                const double of_total = 1.0 / record.total_mass;
                // one axis at a time: registers are scarce here
#pragma unroll 1
                for (int axis = 0; axis < 3; ++axis) {
                    int64_t words[2] = {};
                    each_mass([&](int k) {
                        recall(mass[k], mass_place[k], shared);
                        const mass_real* x = mass[k].position;
                        add_to_center(words, double(mass[k].mass) * of_total,
                                      double(axis == 0   ? x[0]
                                             : axis == 1 ? x[1]
                                                         : x[2]));
                    });
                    for (int word = 0; word < 2; ++word)
                        add_over_warp(words[word], shared.part[sum_center + 2 * axis + word]);
                }
                add_over_blocks(shared, sum_center, 6);
                if (thread == 0)
                    shared.moved =
                        note_center(launch, record, step, shared.sum_of, shared.shift, rank == 0);
                __syncthreads();
                if (shared.moved) {
                    each_mass([&](int k) {
                        shift_mass(mass[k], shared.shift);
                        publish(mass[k], mass_place[k], shared);
                    });
                    follow_origin(params, launch.scene, record.origin);
                }
            }
            if constexpr (touchable) {
                if (step == record.next_sample[sample_contact]) {
                    int64_t touching = 0;
                    each_mass([&](int k) {
                        recall(mass[k], mass_place[k], shared);
                        touching += touches(mass[k], params);
                    });
                    add_over_warp(touching, shared.part[sum_touching]);
                    add_over_blocks(shared, sum_touching, 1);
                    if (thread == 0)
                        note_contact(launch, record, shared.sum_of[sum_touching], rank == 0);
                }
            }
            __syncthreads();
            if (thread == 0) record.step = step;
            last = step == shared.stop;
            half_kick = leapfrog && step == 0;
            since_event = 0;
            until_event = int(next_event(record, step, shared.stop) - step);
            meet_cluster();
        }

        // ---- one step: forces of springs, then everything on masses ----
        each_cell(
            [&](const cell_place& at, const auto& set) {
                cube_forces(
                    launch, set, shared.now,
                    [&](int c) { return shared.at.load(at.at + corner_place(c)); },
                    [&](int c, const force& sum) {
                        shared.sum.store(c * places + at.at + corner_place(c), sum);
                    });
            },
            [&](const cell_place& at, const auto& set) {
                rim_forces(
                    launch, set, shared.now,
                    [&](int c) { return shared.at.load(rim_corner(at, c)); },
                    [&](int c, const force& sum) {
                        if (c < 2 || at.second != 0)
                            shared.sum.store(
                                at.at + (c & 1 ? at.first_sum : 0) + (c & 2 ? at.second_sum : 0),
                                sum);
                    });
            });
        meet_cluster();
        const scripted_moment now{
            record.origin,
            double(record.step + since_event - record.settle_steps) * record.time_step};
        each_mass([&](int k) {
            recall(mass[k], mass_place[k], shared);
            begin_mass(mass[k], force_on(mass_place[k], shared), params, now,
                       half_kick ? mass_real(0.5) * dt : dt, next_velocity[k]);
            if (last)
                publish(mass[k], mass_place[k], shared);
            else
                finish(k, half_kick ? mass_real(1) : mass_real(0.5));
        });
        if (last) {
            each_mass([&](int k) {
                store_next_velocity(next_velocity[k], state_of(launch) + site_of(launch, k), sites);
            });
            if (thread == 0) {
                record.begun = 1;
                if (record.step == record.steps) record.status = robot_done;
            }
            break;
        }
        ++since_event;
        tell_time(record.step + since_event);
        meet_cluster();
    }

    // ---- back to where the next slice, or the host, finds it ----
    each_mass([&](int k) {
        recall(mass[k], mass_place[k], shared);
        store_mass(mass[k], state_of(launch) + site_of(launch, k), sites);
    });
    // no block ends while another may still reach into its memory
    meet_cluster();
    if (rank == 0) copy_record(launch.records[robot_of(launch)], record, thread, threads);
}
