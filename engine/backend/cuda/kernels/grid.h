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

#include "backend/cuda/kernels/meetings.h"
#include "backend/cuda/kernels/solid.h"
#include "backend/cuda/kernels/tile_faces.h"
#include "backend/cuda/kernels/tiles.h"

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
    // velocities after the kick; where laws act on faces then impulses on their corners
    mass_real* const after = arguments.after + robot * (6 * sites);

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
    // Calls visit(site, index within the tile) for this thread's masses.
    const auto each_mass = [&](const auto& visit) {
        each_tile([&](int tile) { each_site(grid, tile, visit); });
    };
    const robot_meetings meeting = meetings_of(launch, grid, robot);
    // Lists the masses that may meet; at this step the lists were made.
    int64_t listed = 0;
    const auto list_meetings = [&](int64_t step) {
        const spring_real* const seen = column_of(side);
        each_mass([&](int site, int) {
            meeting.list(site, [&](int other) { return exchanged_corner(grid, seen, other); });
        });
        listed = step;
    };
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

    const auto own_solid = [&] { return solid_of(launch, robot, sites, after); };
    const bool leads = block == 0 && thread == 0;
    if constexpr (has_solid)
        if (leads)
            begin_solid(own_solid(), launch, record.begun, record.time_step,
                        record.step == 0 ? 1.0 : 0.5);

    // ---- A slice ends between kick and drift, where both velocities are at hand. ----
    const bool begun = record.begun;
    each_mass([&](int site, int) {
        mass_state m;
        mass_real next_velocity[3];
        load_mass(m, next_velocity, masses[site], state + site, sites);
        if (begun)
            finish_mass(m, next_velocity, dt, record.step == 0 ? mass_real(1) : mass_real(0.5));
        keep(m, site, 0);
    });
    if (thread == 0) shared.now = moment_at(launch, record, record.step + begun);
    meet(arrived, blocks);
    if constexpr (meets) list_meetings(record.step + begun);

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
            each_mass([&](int site, int) {
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
                    part[sum_stretch] += stretched(stiffness, c, exchanged_corner(grid, seen, far),
                                                   launch, length_class(d));
                }
            });
            if constexpr (has_solid)
                if (leads && limited) {
                    const int broken = broken_by_solid(own_solid(), launch);
                    part[sum_nonfinite] += broken & limit_nonfinite ? 1 : 0;
                    part[sum_speed] += broken & limit_speed ? 1 : 0;
                }
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
                    each_mass([&](int site, int) {
                        mass_state m;
                        recall(m, site, exchanged_corner(grid, seen, site));
                        shift_mass(m, shared.shift);
                        keep(m, site, side);
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
            if constexpr (has_solid)
                if (leads)
                    note_solid(own_solid().record, record, step, shared.shift,
                               step % check_interval == 0 && shared.moved, launch.solids.samples);
            __syncthreads();
            if (thread == 0) record.step = step;
            last = step == shared.stop;
            half_kick = leapfrog && step == 0;
            since_event = 0;
            until_event = steps_to_event(record, step, shared.stop, own_solid);
            // the next event's sums are 0 before any block adds to them
            meet(arrived, blocks);
        }

        // ---- one step ----
        const scripted_moment now = scripted_moment_at(record, record.step + since_event);
        const mass_real h = half_kick ? mass_real(0.5) * dt : dt;
        bool moved = false;
        // the solid's push on a mass
        const auto pushes_of_solid = [&] {
            if constexpr (!has_solid) {
                return [](int, const mass_state&) { return effects::vector<mass_real>{}; };
            } else {
                const robot_solid solid = own_solid();
                return [&launch, solid, seen = fetched(solid.record.seen)](int site,
                                                                           const mass_state& m) {
                    bool touched;
                    return push_of_solid(solid, launch, seen, site, m, touched);
                };
            }
        };
        // friction, and on to the next step
        const auto end_step = [&](mass_state& m, int site, mass_real next_velocity[3]) {
            slow_mass(m, params, h, next_velocity);
            if (last) {
                store_mass(m, state + site, sites);
                store_next_velocity(next_velocity, state + site, sites);
            } else {
                finish_mass(m, next_velocity, dt, half_kick ? mass_real(1) : mass_real(0.5));
                keep(m, site, 1 - side);
                if constexpr (meets) moved |= meeting.moved(site, corner_of(m));
            }
        };
        const auto push_on = pushes_of_solid();
        each_tile([&](int tile) {
            const spring_real* const seen = column_of(side);
            tile_forces(grid, launch, columns, seen, tile, shared);
            each_site(grid, tile, [&](int site, int index) {
                const int in_window =
                    (index % tile_x + 1) + window_x * ((index / tile_x % tile_y + 1) +
                                                       window_y * (index / (tile_x * tile_y) + 1));
                const corner own = shared.at.load(in_window);
                mass_state m;
                mass_real next_velocity[3];
                recall(m, site, own);
                effects::vector<mass_real> met{};
                if constexpr (meets)
                    met = force_of_meetings(meeting, launch, site, [&](int other) {
                        return exchanged_corner(grid, seen, other);
                    });
                kick_mass(m, force_on(index, shared), met, push_on(site, m), params, now, h,
                          next_velocity);
                if constexpr (has_faces || has_solid) {
                    for (int axis = 0; axis < 3; ++axis) {
                        after[axis * sites + site] = next_velocity[axis];
                        if constexpr (compensated)
                            state[(column_lost_velocity + axis) * sites + site] =
                                m.lost_velocity[axis];
                    }
                } else {
                    end_step(m, site, next_velocity);
                }
            });
            __syncthreads();
        });
        if constexpr (has_faces) {
            const tile_faces faces{
                grid,  masses,           launch.faces + robot * 3 * sites, column_of(side),
                after, after + 3 * sites};
            push_faces(
                [&](auto effect, int axis) {
                    each_mass([&](int site, int) { faces.push(effect, params, axis, site, h); });
                },
                [&](int axis) { each_mass([&](int site, int) { faces.take(axis, site); }); },
                [&] { meet(arrived, blocks); });
        }
        if constexpr (has_solid) {
            meet(arrived, blocks);
            if (block == 0 && thread < lanes)
                step_solid(own_solid(), launch, record.origin, double(h), !last, record.time_step,
                           half_kick ? 1.0 : 0.5);
            meet(arrived, blocks);
        }
        if constexpr (has_faces || has_solid)
            each_mass([&](int site, int) {
                mass_state m;
                recall(m, site, exchanged_corner(grid, column_of(side), site));
                // of what touches the solid one block wrote all
                const auto velocity = [&](int axis) {
                    const mass_real* const at = after + axis * sites + site;
                    return has_solid ? __ldcg(at) : *at;
                };
                mass_real next_velocity[3] = {velocity(0), velocity(1), velocity(2)};
                end_step(m, site, next_velocity);
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
        const auto step = static_cast<unsigned long long>(record.step + since_event);
        if constexpr (meets)
            if (moved) atomicMax(launch.meetings.moved + robot, step);
        meet(arrived, blocks);
        side = 1 - side;
        // a block ahead may already have told of a later step: then lists are made once too often
        if constexpr (meets)
            if (__ldcg(launch.meetings.moved + robot) > static_cast<unsigned long long>(listed))
                list_meetings(int64_t(step));
    }

    __syncthreads();
    if (block == 0) copy_record(launch.records[robot], record, thread, threads);
}
