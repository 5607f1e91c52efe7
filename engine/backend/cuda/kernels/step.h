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

#include "backend/cuda/kernels/slab_faces.h"
#include "backend/cuda/kernels/slabs.h"
#include "backend/cuda/kernels/solid.h"

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

    const auto list_meetings = [&] {
        constexpr site_grid grid{lattice{}};
        const robot_meetings meeting = meetings_of(launch, grid, robot_of(launch));
        each_mass([&](int k) {
            meeting.list(site_at(mass_place[k]),
                         [&](int site) { return corner_of_robot(site, shared); });
        });
    };

    const auto own_solid = [&] {
        return solid_of(launch, robot_of(launch), sites,
                        launch.solids.after + robot_of(launch) * 3 * sites);
    };
    const bool leads = rank == 0 && thread == 0;
    if constexpr (has_solid)
        if (leads)
            begin_solid(own_solid(), launch, record.begun, record.time_step,
                        record.step == 0 ? 1.0 : 0.5);

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
    if constexpr (meets) list_meetings();

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
                if constexpr (has_solid)
                    if (leads) broken |= broken_by_solid(own_solid(), launch);
                if (any_of_robot(shared, limits_broken, broken)) {
                    const bool diverged =
                        any_of_robot(shared, divergence_found, broken & limits_of_divergence);
                    const bool coarse_seen =
                        any_of_robot(shared, coarse_found, broken & limit_coarse);
                    const bool nonfinite =
                        any_of_robot(shared, nonfinite_found, broken & limit_nonfinite);
                    const bool speed = any_of_robot(shared, speed_found, broken & limit_speed);
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
        // before any mass moves on
        effects::vector<mass_real> met[mass_rounds] = {};
        if constexpr (meets) {
            constexpr site_grid grid{lattice{}};
            const robot_meetings meeting = meetings_of(launch, grid, robot_of(launch));
            each_mass([&](int k) {
                met[k] = force_of_meetings(meeting, launch, site_at(mass_place[k]),
                                           [&](int site) { return corner_of_robot(site, shared); });
            });
        }
        meet_cluster();
        const scripted_moment now = scripted_moment_at(record, record.step + since_event);
        const mass_real h = half_kick ? mass_real(0.5) * dt : dt;
        bool moved = false;
        const auto end_step = [&](int k) {
            if (last)
                publish(mass[k], mass_place[k], shared);
            else
                finish(k, half_kick ? mass_real(1) : mass_real(0.5));
            if constexpr (meets) {
                constexpr site_grid grid{lattice{}};
                moved |= meetings_of(launch, grid, robot_of(launch))
                             .moved(site_at(mass_place[k]), corner_of(mass[k]));
            }
        };
        unsigned touching = 0;  // the solid: a bit for each of this thread's masses
        // the solid's push on mass k, of this thread
        const auto pushes_of_solid = [&] {
            if constexpr (!has_solid) {
                return [](int) { return effects::vector<mass_real>{}; };
            } else {
                const robot_solid solid = own_solid();
                return [&, solid, seen = fetched(solid.record.seen)](int k) {
                    bool touched;
                    const auto push = push_of_solid(solid, launch, seen, site_at(mass_place[k]),
                                                    mass[k], touched);
                    touching |= unsigned(touched) << k;
                    return push;
                };
            }
        };
        // The solid's own step, and what its friction does to the masses.
        const auto meet_solid = [&] {
            const robot_solid solid = own_solid();
            const auto each_touching = [&](const auto& visit) {
                each_mass([&](int k) {
                    if (touching >> k & 1u)
                        for (int axis = 0; axis < 3; ++axis)
                            visit(solid.after[axis * sites + site_at(mass_place[k])],
                                  next_velocity[k][axis]);
                });
            };
            each_touching([](mass_real& there, mass_real& own) { there = own; });
            meet_cluster();
            if (rank == 0 && thread < lanes)
                step_solid(solid, launch, record.origin, double(h), !last, record.time_step,
                           half_kick ? 1.0 : 0.5);
            meet_cluster();
            each_touching([](const mass_real& there, mass_real& own) { own = __ldcg(&there); });
        };
        if constexpr (!has_faces && !has_solid) {
            each_mass([&](int k) {
                recall(mass[k], mass_place[k], shared);
                begin_mass(mass[k], force_on(mass_place[k], shared), met[k], params, now, h,
                           next_velocity[k]);
                end_step(k);
            });
        } else {
            const auto pushed = pushes_of_solid();
            each_mass([&](int k) {
                recall(mass[k], mass_place[k], shared);
                kick_mass(mass[k], force_on(mass_place[k], shared), met[k], pushed(k), params, now,
                          h, next_velocity[k]);
                shared.own.store(mass_place[k], mass[k]);
                if constexpr (has_faces) show_velocity(next_velocity[k], mass_place[k], shared);
            });
            if constexpr (has_faces) {
                const float* const lightest = launch.faces + robot_of(launch) * 3 * sites;
                push_faces(
                    [&](auto effect, int axis) {
                        each_mass([&](int k) {
                            push_face(effect, params, lightest, axis, mass_place[k], h, shared);
                        });
                    },
                    [&](int axis) {
                        each_mass([&](int k) {
                            take_from_faces(axis, mass_place[k], mass[k].inverse_mass,
                                            next_velocity[k], shared);
                            show_velocity(next_velocity[k], mass_place[k], shared);
                        });
                    },
                    [] { meet_cluster(); });
            }
            if constexpr (has_solid) meet_solid();
            each_mass([&](int k) {
                recall(mass[k], mass_place[k], shared);
                slow_mass(mass[k], params, h, next_velocity[k]);
                end_step(k);
            });
        }
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
        if constexpr (meets) {
            if (any_of_robot(shared, mass_moved, moved)) list_meetings();
        } else {
            meet_cluster();
        }
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
