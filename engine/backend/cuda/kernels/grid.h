// grid.h: whole runs of robots that no block could hold: their masses lie in tiles in global
// memory, several blocks share a robot and meet once a step. Each tile also computes the springs
// that cross into it, so that no force is exchanged; sums over a mass have the order of cells.h, so
// trajectories are those of step.h. Compiled for one scene (scene.h) and for one lattice or any
// (springs.h):
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
constexpr int tile_x = LIMAX_TILE_X, tile_y = LIMAX_TILE_Y, tile_z = LIMAX_TILE_Z;
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
    int64_t part[grid_sums][warps];
    int64_t sum_of[grid_sums];
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
    __device__ bool inside(const site_grid& grid) const {
        return x >= 0 && y >= 0 && z >= 0 && x < grid.x && y < grid.y && z < grid.z;
    }
    __device__ int site(const site_grid& grid) const { return grid.at(x, y, z); }
};

// Tiles of the lattice along an axis.
__device__ constexpr int tiles_along(int sites, int of_tile) {
    return (sites + of_tile - 1) / of_tile;
}
__device__ constexpr int tiles_of(const site_grid& grid) {
    return tiles_along(grid.x, tile_x) * tiles_along(grid.y, tile_y) * tiles_along(grid.z, tile_z);
}
__device__ inline place tile_base(const site_grid& grid, int tile) {
    const int tiles_x = tiles_along(grid.x, tile_x), tiles_y = tiles_along(grid.y, tile_y);
    return {tile % tiles_x * tile_x, tile / tiles_x % tiles_y * tile_y,
            tile / (tiles_x * tiles_y) * tile_z};
}

using grid_arguments = grid_launch<mass_real, spring_real>;

// Calls visit(site, index within the tile, its x, y, z there) for this thread's masses of a tile.
template <class Visit>
__device__ inline void each_site(const site_grid& grid, int tile, const Visit& visit) {
    const place base = tile_base(grid, tile);
    for (int index = threadIdx.x; index < tile_masses; index += threads) {
        const place at{base.x + index % tile_x, base.y + index / tile_x % tile_y,
                       base.z + index / (tile_x * tile_y)};
        if (at.inside(grid)) visit(at.site(grid), index);
    }
}

// Other blocks write what is read here: the reads go to the memory that all share.
__device__ inline corner exchanged_corner(const site_grid& grid, const spring_real* column,
                                          int site) {
    const int sites = grid.count();
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
__device__ inline void exchange_corner(const site_grid& grid, spring_real* column, int site,
                                       const corner& c) {
    const int sites = grid.count();
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
// and early; registers do not suffice for all, and for fewer where they also hold the lattice.
struct fetched_springs {
    static constexpr int early = site_grid::known ? 10 : 6;
    spring_parameters held[early];
    const site_grid& grid;
    const float* columns;
    int site;

    __device__ fetched_springs(const site_grid& sites, const float* of_robot)
        : grid(sites), columns(of_robot) {}

    __device__ spring_parameters load(int i) const {
        const cube_spring s = cube_spring_at(i);
        spring_parameters out;
        out.load(grid, columns, s.direction * grid.count() + site + grid.corner(s.near));
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

    __device__ tile_cell(const site_grid& grid, int tile, int index)
        : within{index % cells_x - 1, index / cells_x % cells_y - 1,
                 index / (cells_x * cells_y) - 1} {
        const place base = tile_base(grid, tile);
        at = {base.x + within.x, base.y + within.y, base.z + within.z};
        in_window = (within.x + 1) + window_x * ((within.y + 1) + window_y * (within.z + 1));
        in_tile = within.x + tile_x * (within.y + tile_y * within.z);
    }
    __device__ bool reaches(const site_grid& grid, int c) const {
        return at.x + (c & 1) < grid.x && at.y + (c >> 1 & 1) < grid.y && at.z + (c >> 2) < grid.z;
    }
    __device__ bool ends_in_tile(int c) const {
        const int x = within.x + (c & 1), y = within.y + (c >> 1 & 1), z = within.z + (c >> 2);
        return x >= 0 && y >= 0 && z >= 0 && x < tile_x && y < tile_y && z < tile_z;
    }
};

// Forces on the masses of a tile, of all springs that end in it. Asks for the first parameters,
// then for the masses around, then waits for both.
__device__ inline void tile_forces(const site_grid& grid, const launch_arguments& launch,
                                   const float* columns, const spring_real* seen, int tile,
                                   tile_memory& shared) {
    fetched_springs springs(grid, columns);
    const auto fetch = [&](int index) {
        if (index >= tile_cells) return;
        const tile_cell cell(grid, tile, index);
        if (cell.at.inside(grid)) springs.fetch(cell.at.site(grid));
    };
    fetch(threadIdx.x);
    const place base = tile_base(grid, tile);
    for (int index = threadIdx.x; index < window; index += threads) {
        const place at{base.x + index % window_x - 1, base.y + index / window_x % window_y - 1,
                       base.z + index / (window_x * window_y) - 1};
        if (at.inside(grid)) shared.at.store(index, exchanged_corner(grid, seen, at.site(grid)));
    }
    __syncthreads();
    for (int index = threadIdx.x; index < tile_cells; index += threads) {
        const tile_cell cell(grid, tile, index);
        const auto store = [&](int c, const force& sum) {
            if (cell.ends_in_tile(c) && cell.reaches(grid, c))
                shared.sum.store(c * tile_masses + cell.in_tile + tile_corner(c), sum);
        };
        if (cell.at.inside(grid)) {
            // A spring to a corner that does not exist has no stiffness, and is given no length.
            cube_forces(
                launch, springs, shared.now,
                [&](int c) {
                    return shared.at.load(cell.in_window +
                                          (cell.reaches(grid, c) ? window_corner(c) : 0));
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
    const site_grid grid(arguments.grid);
    const int sites = grid.count(), tiles = tiles_of(grid);
    int event = 0;  // of this launch

    const float* columns = launch.springs + robot * (spring_columns * direction_count * sites);
    const float* masses = launch.mass + robot * sites;
    mass_real* const state = launch.state + robot * (state_columns * sites);
    spring_real* const exchange = arguments.exchange + robot * (2 * exchanged * sites);
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
    scene_params params(launch.params);
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
        exchange_corner(grid, column_of(which), site, corner_of(m));
    };

    // ---- A slice ends between kick and drift, where both velocities are at hand. ----
    const bool begun = record.begun;
    each_tile([&](int tile) {
        each_site(grid, tile, [&](int site, int) {
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
            const bool contact = touchable && step == record.next_sample[sample_contact];
            const auto coarse = mass_real(coarse_speed(launch.rest[0], record.time_step));
            const spring_real* const seen = column_of(side);
            const double of_total = 1.0 / record.total_mass;
            int64_t part[grid_sums] = {};
            each_tile([&](int tile) {
                each_site(grid, tile, [&](int site, int) {
                    const corner c = exchanged_corner(grid, seen, site);
                    mass_state m;
                    recall(m, site, c);
                    for (int axis = 0; axis < 3; ++axis)
                        add_to_center(part + sum_center + 2 * axis, double(m.mass) * of_total,
                                      double(m.position[axis]));
                    part[sum_touching] += contact && touches(m, params);
                    if (!limited) return;
                    const int broken = broken_by_mass(m, launch, coarse);
                    part[sum_nonfinite] += broken & limit_nonfinite ? 1 : 0;
                    part[sum_speed] += broken & limit_speed ? 1 : 0;
                    part[sum_coarse] += broken & limit_coarse ? 1 : 0;
                    for (int d = 0; d < direction_count; ++d) {
                        const float stiffness = columns[d * sites + site];
                        if (!(stiffness > 0.0f)) continue;
                        const direction along = direction_at(d);
                        const int far = site + grid.at(along.x, along.y, along.z);
                        part[sum_stretch] +=
                            stretched(stiffness, c, exchanged_corner(grid, seen, far), launch,
                                      length_class(d));
                    }
                });
            });
            for (int i = 0; i < grid_sums; ++i) {
                const int64_t sum = sum_over_warp(part[i]);
                if (thread % 32 == 0) shared.part[i][thread / 32] = sum;
            }
            __syncthreads();
            // one of two sets of sums; the other, which all blocks have read, starts again at 0
            unsigned long long* const sums = arguments.sums + (2 * robot + event % 2) * grid_sums;
            unsigned long long* const next =
                arguments.sums + (2 * robot + (event + 1) % 2) * grid_sums;
            ++event;
            if (thread < grid_sums) {
                int64_t sum = 0;
                for (int warp = 0; warp < warps; ++warp) sum += shared.part[thread][warp];
                atomicAdd(sums + thread, static_cast<unsigned long long>(sum));
            }
            meet(arrived, blocks);
            if (thread < grid_sums) {
                shared.sum_of[thread] = static_cast<int64_t>(__ldcg(sums + thread));
                if (block == 0) next[thread] = 0;
            }
            __syncthreads();
            if (thread == 0 && shared.sum_of[sum_coarse] != 0) record.coarse = 1;
            if (shared.sum_of[sum_nonfinite] + shared.sum_of[sum_speed] +
                    shared.sum_of[sum_stretch] !=
                0) {
                if (thread == 0)
                    note_divergence(record, step, shared.sum_of[sum_nonfinite] != 0,
                                    shared.sum_of[sum_speed] != 0);
                break;
            }
            if (center_wanted(record, step)) {
                __syncthreads();
                if (thread == 0) {
                    shared.moved =
                        note_center(launch, record, step, shared.sum_of, shared.shift, block == 0);
                }
                __syncthreads();
                if (shared.moved) {
                    each_tile([&](int tile) {
                        each_site(grid, tile, [&](int site, int) {
                            mass_state m;
                            recall(m, site, exchanged_corner(grid, seen, site));
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
                    note_contact(launch, record, shared.sum_of[sum_touching], block == 0);
            }
            __syncthreads();
            if (thread == 0) record.step = step;
            last = step == shared.stop;
            half_kick = leapfrog && step == 0;
            since_event = 0;
            until_event = int(next_event(record, step, shared.stop) - step);
            // the next event's sums are 0 before any block adds to them
            meet(arrived, blocks);
        }

        // ---- one step ----
        const scripted_moment now{
            record.origin,
            double(record.step + since_event - record.settle_steps) * record.time_step};
        each_tile([&](int tile) {
            tile_forces(grid, launch, columns, column_of(side), tile, shared);
            each_site(grid, tile, [&](int site, int index) {
                const int in_window =
                    (index % tile_x + 1) + window_x * ((index / tile_x % tile_y + 1) +
                                                       window_y * (index / (tile_x * tile_y) + 1));
                mass_state m;
                mass_real next_velocity[3];
                recall(m, site, shared.at.load(in_window));
                begin_mass(m, force_on(index, shared), params, now,
                           half_kick ? mass_real(0.5) * dt : dt, next_velocity);
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
