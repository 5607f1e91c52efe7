// grid.h: whole runs of robots that no block could hold: their masses lie in tiles in global
// memory, several blocks share a robot and meet once a step. Each tile also computes the springs
// that cross into it, so that no force is exchanged; sums over a mass have the order of cells.h, so
// trajectories are those of step.h. Compiled for one scene (scene.h) and lattice (springs.h):
//   LIMAX_TILE_X, LIMAX_TILE_Y, LIMAX_TILE_Z  sites of a tile
//   LIMAX_THREADS, LIMAX_BLOCKS               threads of a block, blocks of a multiprocessor
//   LIMAX_SHARED_BYTES                        dynamic shared memory of a block
// SI units.
#pragma once

#include "backend/cuda/kernels/block_memory.h"
#include "backend/cuda/kernels/run.h"
#include "backend/cuda/kernels/springs.h"

namespace limax::cuda {

constexpr int threads = LIMAX_THREADS, warps = threads / 32;
constexpr int along_x = LIMAX_NX + 1, along_y = LIMAX_NY + 1, along_z = LIMAX_NZ + 1;
constexpr int tile_x = LIMAX_TILE_X, tile_y = LIMAX_TILE_Y, tile_z = LIMAX_TILE_Z;
constexpr int tiles_x = (along_x + tile_x - 1) / tile_x, tiles_y = (along_y + tile_y - 1) / tile_y,
              tiles_z = (along_z + tile_z - 1) / tile_z, tiles = tiles_x * tiles_y * tiles_z;
constexpr int tile_masses = tile_x * tile_y * tile_z;
// The window of a tile reaches one site beyond it on every side.
constexpr int window_x = tile_x + 2, window_y = tile_y + 2, window_z = tile_z + 2;
constexpr int window = window_x * window_y * window_z;
// Its cells begin one site before it.
constexpr int cells_x = tile_x + 1, cells_y = tile_y + 1, cells_z = tile_z + 1;
constexpr int tile_cells = cells_x * cells_y * cells_z;
// Values of a mass that its springs see.
constexpr int exchanged = shares_velocity ? 6 : 3;
// Whether what forces read of a velocity must be kept besides: then the columns of the next
// velocity, which only the end of a slice needs, hold it.
constexpr bool keeps_prediction = leapfrog && !(shares_state && shares_velocity);

struct tile_memory {
    corner_columns<window> at;
    sum_columns<tile_masses> sum;
    effects::actuation::moment<spring_real> now;  // of the muscles
    double part[tile_parts][warps];
    double shift[3];  // of the origin, m
    int moved, broken;
    double touching;
    robot_record record;  // every block keeps its own, and they agree
    int64_t stop;
};
static_assert(sizeof(tile_memory) <= LIMAX_SHARED_BYTES);

// A place in the lattice.
struct place {
    int x, y, z;
    __device__ bool inside() const {
        return x >= 0 && y >= 0 && z >= 0 && x < along_x && y < along_y && z < along_z;
    }
    __device__ int site() const { return x + along_x * (y + along_y * z); }
};

__device__ inline place tile_base(int tile) {
    return {tile % tiles_x * tile_x, tile / tiles_x % tiles_y * tile_y,
            tile / (tiles_x * tiles_y) * tile_z};
}

using grid_arguments = grid_launch<mass_real, spring_real>;

// Calls visit(site, index within the tile, its x, y, z there) for this thread's masses of a tile.
template <class Visit>
__device__ inline void each_site(int tile, const Visit& visit) {
    const place base = tile_base(tile);
    for (int index = threadIdx.x; index < tile_masses; index += threads) {
        const place at{base.x + index % tile_x, base.y + index / tile_x % tile_y,
                       base.z + index / (tile_x * tile_y)};
        if (at.inside()) visit(at.site(), index);
    }
}

// Other blocks write what is read here: the reads go to the memory that all share.
__device__ inline corner exchanged_corner(const spring_real* column, int site) {
    corner c{};
    c.x = __ldcg(column + site);
    c.y = __ldcg(column + sites + site);
    c.z = __ldcg(column + 2 * sites + site);
    if constexpr (shares_velocity) {
        c.vx = __ldcg(column + 3 * sites + site);
        c.vy = __ldcg(column + 4 * sites + site);
        c.vz = __ldcg(column + 5 * sites + site);
    }
    return c;
}
__device__ inline void exchange_corner(spring_real* column, int site, const corner& c) {
    column[site] = c.x;
    column[sites + site] = c.y;
    column[2 * sites + site] = c.z;
    if constexpr (shares_velocity) {
        column[3 * sites + site] = c.vx;
        column[4 * sites + site] = c.vy;
        column[5 * sites + site] = c.vz;
    }
}

// Waits until all blocks of the robot have come here; what they wrote before is then visible.
__device__ inline void meet(unsigned* arrived, int blocks) {
    __syncthreads();
    if (blocks == 1) return;
    if (threadIdx.x == 0) {
        __threadfence();
        const unsigned before = atomicAdd(arrived, 1u);
        const unsigned goal = (before / blocks + 1) * blocks;
        unsigned now;
        do {
            asm volatile("ld.acquire.gpu.u32 %0, [%1];" : "=r"(now) : "l"(arrived) : "memory");
        } while (now < goal);
    }
    __syncthreads();
}

// Parameters of a cube's springs. They never change and lie far away, so most are asked for at once
// and early; registers do not suffice for all.
struct fetched_springs {
    static constexpr int early = 10;
    spring_parameters held[early];
    const float* columns;
    int site;

    __device__ spring_parameters load(int i) const {
        const cube_spring s = cube_spring_at(i);
        spring_parameters out;
        out.load(columns, s.direction * sites + site + corner_site(s.near));
        return out;
    }
    __device__ void fetch(int cell) {
        site = cell;
#pragma unroll
        for (int i = 0; i < early; ++i) held[i] = load(i);
    }
    __device__ spring_parameters operator[](int i) const { return i < early ? held[i] : load(i); }
};

__device__ constexpr int window_corner(int number) {
    return (number & 1) + (number >> 1 & 1) * window_x + (number >> 2) * (window_x * window_y);
}
__device__ constexpr int tile_corner(int number) {
    return (number & 1) + (number >> 1 & 1) * tile_x + (number >> 2) * (tile_x * tile_y);
}

// A cell of a tile: in the lattice, within the tile (-1 before it), and its places in memory.
struct tile_cell {
    place at, within;
    int in_window, in_tile;

    __device__ tile_cell(int tile, int index)
        : within{index % cells_x - 1, index / cells_x % cells_y - 1,
                 index / (cells_x * cells_y) - 1} {
        const place base = tile_base(tile);
        at = {base.x + within.x, base.y + within.y, base.z + within.z};
        in_window = (within.x + 1) + window_x * ((within.y + 1) + window_y * (within.z + 1));
        in_tile = within.x + tile_x * (within.y + tile_y * within.z);
    }
    __device__ bool reaches(int c) const {
        return at.x + (c & 1) < along_x && at.y + (c >> 1 & 1) < along_y &&
               at.z + (c >> 2) < along_z;
    }
    __device__ bool ends_in_tile(int c) const {
        const int x = within.x + (c & 1), y = within.y + (c >> 1 & 1), z = within.z + (c >> 2);
        return x >= 0 && y >= 0 && z >= 0 && x < tile_x && y < tile_y && z < tile_z;
    }
};

// Forces on the masses of a tile, of all springs that end in it. Asks for the first parameters,
// then for the masses around, then waits for both.
__device__ inline void tile_forces(const launch_arguments& launch, const float* columns,
                                   const spring_real* seen, int tile, tile_memory& shared) {
    fetched_springs springs;
    springs.columns = columns;
    const auto fetch = [&](int index) {
        if (index >= tile_cells) return;
        const tile_cell cell(tile, index);
        if (cell.at.inside()) springs.fetch(cell.at.site());
    };
    fetch(threadIdx.x);
    const place base = tile_base(tile);
    for (int index = threadIdx.x; index < window; index += threads) {
        const place at{base.x + index % window_x - 1, base.y + index / window_x % window_y - 1,
                       base.z + index / (window_x * window_y) - 1};
        if (at.inside()) shared.at.store(index, exchanged_corner(seen, at.site()));
    }
    __syncthreads();
    for (int index = threadIdx.x; index < tile_cells; index += threads) {
        const tile_cell cell(tile, index);
        const auto store = [&](int c, const force& sum) {
            if (cell.ends_in_tile(c) && cell.reaches(c))
                shared.sum.store(c * tile_masses + cell.in_tile + tile_corner(c), sum);
        };
        if (cell.at.inside()) {
            // A spring to a corner that does not exist has no stiffness, and is given no length.
            cube_forces(
                launch, springs, shared.now,
                [&](int c) {
                    return shared.at.load(cell.in_window +
                                          (cell.reaches(c) ? window_corner(c) : 0));
                },
                store);
        } else {
            // a mass on the lattice's low side is no corner of such a cell
#pragma unroll
            for (int c = 0; c < corners; ++c) store(c, {});
        }
        fetch(index + threads);
    }
    __syncthreads();
}

__device__ inline force force_on(int index, const tile_memory& shared) {
    force total = shared.sum.load(index);
#pragma unroll
    for (int c = 1; c < corners; ++c) {
        const force part = shared.sum.load(c * tile_masses + index);
        total.x += part.x;
        total.y += part.y;
        total.z += part.z;
    }
    return total;
}

}  // namespace limax::cuda

extern "C" __global__ void __launch_bounds__(LIMAX_THREADS, LIMAX_BLOCKS)
    limax_advance(const __grid_constant__ limax::cuda::grid_arguments arguments) {
    using namespace limax;
    using namespace limax::cuda;
    extern __shared__ __align__(16) char memory[];
    tile_memory& shared = *reinterpret_cast<tile_memory*>(memory);
    const launch_arguments& launch = arguments.step;
    const int thread = threadIdx.x;
    const int blocks = arguments.blocks_of_robot, block = blockIdx.x % blocks;
    const int64_t robot = launch.running[blockIdx.x / blocks];

    const float* columns = launch.springs + robot * (spring_columns * direction_count * sites);
    const float* masses = launch.mass + robot * sites;
    mass_real* const state = launch.state + robot * (state_columns * sites);
    spring_real* const exchange = arguments.exchange + robot * (2 * exchanged * sites);
    double* const parts = arguments.parts + robot * (tiles * tile_parts);
    unsigned* const arrived = arguments.arrived + robot;

    copy_record(shared.record, launch.records[robot], thread, threads);
    __syncthreads();
    robot_record& record = shared.record;
    if (thread == 0) shared.stop = stop_of(launch, record);
    __syncthreads();
    if (record.begun && shared.stop <= record.step) {
        if (block == 0) copy_record(launch.records[robot], record, thread, threads);
        return;
    }
    const mass_real dt = mass_real(record.time_step);
    scene_params params = launch.params;
    follow_origin(params, launch.scene, record.origin);

    // which half of the exchange is being read
    int side = 0;
    const auto each_tile = [&](const auto& visit) {
        for (int tile = block; tile < tiles; tile += blocks) visit(tile);
    };
    const auto column_of = [&](int which) { return exchange + which * (exchanged * sites); };
    // A mass as the last step left it. What springs see comes from the exchange.
    const auto recall = [&](mass_state& m, int site, const corner& c) {
        mass_real kept[3];
        load_mass(m, kept, masses[site], state + site, sites);
        for (int axis = 0; keeps_prediction && axis < 3; ++axis) m.predicted[axis] = kept[axis];
        if constexpr (shares_state) take_corner(m, c);
    };
    const auto keep = [&](const mass_state& m, int site, int which) {
        store_mass(m, state + site, sites);
        if (keeps_prediction) store_next_velocity(m.predicted, state + site, sites);
        exchange_corner(column_of(which), site, corner_of(m));
    };

    // ---- A slice ends between kick and drift, where both velocities are at hand. ----
    const bool begun = record.begun;
    each_tile([&](int tile) {
        each_site(tile, [&](int site, int) {
            mass_state m;
            mass_real next_velocity[3];
            load_mass(m, next_velocity, masses[site], state + site, sites);
            if (begun)
                finish_mass(m, next_velocity, dt, record.step == 0 ? mass_real(1) : mass_real(0.5));
            keep(m, site, 0);
        });
    });
    if (thread == 0) shared.now = moment_at(launch, record, record.step + begun);
    meet(arrived, blocks);

    // `record.step` is the step of the last event, `since_event` how long ago that was.
    int since_event = begun, until_event = begun;
    bool half_kick = false, last = false;
    while (true) {
        if (since_event == until_event) {
            const int64_t step = record.step + since_event;
            const bool limited = step % check_interval == 0 || step == record.steps;
            const bool contact = grounded && step == record.next_sample[sample_contact];
            const double height = contact ? ground_height(launch, record) : 0.0;
            const auto coarse = mass_real(coarse_speed(launch.rest[0], record.time_step));
            const spring_real* const seen = column_of(side);
            each_tile([&](int tile) {
                double part[tile_parts] = {};
                int broken = 0;
                each_site(tile, [&](int site, int) {
                    const corner c = exchanged_corner(seen, site);
                    mass_state m;
                    recall(m, site, c);
                    for (int axis = 0; axis < 3; ++axis)
                        part[part_moment + axis] += double(m.mass) * double(m.position[axis]);
                    part[part_touching] +=
                        contact && m.mass > mass_real(0) && double(m.position[2]) < height;
                    if (!limited) return;
                    broken |= broken_by_mass(m, launch, coarse);
                    for (int d = 0; d < direction_count; ++d) {
                        const float stiffness = columns[d * sites + site];
                        if (!(stiffness > 0.0f)) continue;
                        const direction along = direction_at(d);
                        const int far = site + along.x + along_x * (along.y + along_y * along.z);
                        if (stretched(stiffness, c, exchanged_corner(seen, far), launch,
                                      length_class(d)))
                            broken |= limit_stretch;
                    }
                });
                for (int i = 0; i < part_broken; ++i) {
                    const double sum = sum_over_warp(part[i]);
                    if (thread % 32 == 0) shared.part[i][thread / 32] = sum;
                }
                int together = broken;
                for (int distance = 16; distance > 0; distance /= 2)
                    together |= __shfl_xor_sync(0xffffffffu, together, distance);
                if (thread % 32 == 0) shared.part[part_broken][thread / 32] = together;
                __syncthreads();
                if (thread < tile_parts) {
                    double sum = 0;
                    int flags = 0;
                    for (int warp = 0; warp < warps; ++warp) {
                        sum += shared.part[thread][warp];
                        flags |= int(shared.part[thread][warp]);
                    }
                    parts[tile * tile_parts + thread] = thread == part_broken ? flags : sum;
                }
                __syncthreads();
            });
            meet(arrived, blocks);
            // every block adds up all tiles in the same order
            if (thread < tile_parts) {
                double sum = 0;
                int flags = 0;
                for (int tile = 0; tile < tiles; ++tile) {
                    const double part = __ldcg(parts + tile * tile_parts + thread);
                    sum += part;
                    flags |= int(part);
                }
                shared.part[thread][0] = thread == part_broken ? flags : sum;
            }
            __syncthreads();
            const int broken = int(shared.part[part_broken][0]);
            if (thread == 0 && (broken & limit_coarse)) record.coarse = 1;
            if (broken & limits_of_divergence) {
                if (thread == 0)
                    note_divergence(record, step, broken & limit_nonfinite, broken & limit_speed);
                break;
            }
            if (center_wanted(record, step)) {
                __syncthreads();
                if (thread == 0) {
                    const double moment[3] = {shared.part[0][0], shared.part[1][0],
                                              shared.part[2][0]};
                    shared.moved =
                        note_center(launch, record, step, moment, shared.shift, block == 0);
                }
                __syncthreads();
                if (shared.moved) {
                    each_tile([&](int tile) {
                        each_site(tile, [&](int site, int) {
                            mass_state m;
                            recall(m, site, exchanged_corner(seen, site));
                            shift_mass(m, shared.shift);
                            keep(m, site, side);
                        });
                    });
                    follow_origin(params, launch.scene, record.origin);
                    meet(arrived, blocks);
                }
            }
            if (contact) {
                __syncthreads();
                if (thread == 0)
                    note_contact(launch, record, shared.part[part_touching][0], block == 0);
            }
            __syncthreads();
            if (thread == 0) record.step = step;
            last = step == shared.stop;
            half_kick = leapfrog && step == 0;
            since_event = 0;
            until_event = int(next_event(record, step, shared.stop) - step);
            // what the parts held is not overwritten before every block has read it
            meet(arrived, blocks);
        }

        // ---- one step ----
        each_tile([&](int tile) {
            tile_forces(launch, columns, column_of(side), tile, shared);
            each_site(tile, [&](int site, int index) {
                const int in_window =
                    (index % tile_x + 1) + window_x * ((index / tile_x % tile_y + 1) +
                                                       window_y * (index / (tile_x * tile_y) + 1));
                mass_state m;
                mass_real next_velocity[3];
                recall(m, site, shared.at.load(in_window));
                begin_mass(m, force_on(index, shared), params, half_kick ? mass_real(0.5) * dt : dt,
                           next_velocity);
                if (last) {
                    store_mass(m, state + site, sites);
                    store_next_velocity(next_velocity, state + site, sites);
                } else {
                    finish_mass(m, next_velocity, dt, half_kick ? mass_real(1) : mass_real(0.5));
                    keep(m, site, 1 - side);
                }
            });
            __syncthreads();
        });
        if (last) {
            if (thread == 0) {
                record.begun = 1;
                if (record.step == record.steps) record.status = robot_done;
            }
            break;
        }
        ++since_event;
        if (thread == 0) shared.now = moment_at(launch, record, record.step + since_event);
        meet(arrived, blocks);
        side = 1 - side;
    }

    __syncthreads();
    if (block == 0) copy_record(launch.records[robot], record, thread, threads);
}
