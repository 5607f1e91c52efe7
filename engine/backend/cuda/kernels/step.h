// step.h: the block path: runs of robots that fit the shared memory of a block. One block per
// robot, the loop over steps (loop.h) inside. A thread owns cells (cells.h): their springs, with
// their parameters in registers, and the masses at their lowest corners, whose state never leaves
// registers. What neighbours read is in shared memory: positions, velocities, and the sums of
// forces. Compiled for one scene (scene.h), lattice (springs.h) and plan of the block
// (block_plan.h):
//   LIMAX_ROW, LIMAX_PLANE             places between neighbours along y and z in shared memory
//   LIMAX_PLACES                       all places of a block
//   LIMAX_CUBE_SLOTS, LIMAX_RIM_SLOTS  slots of cells
//   LIMAX_MIXED                        1 where squares of all orientations share slots, else 0
//   LIMAX_THREADS, LIMAX_BLOCKS        threads of a block, blocks of a multiprocessor
//   LIMAX_SHARED_BYTES                 dynamic shared memory of a block
// SI units.
#pragma once

#include "backend/cuda/kernels/block_cells.h"
#include "backend/cuda/kernels/block_faces.h"
#include "backend/cuda/kernels/loop.h"

namespace limax::cuda {

// ---- the controller: not inlined, so that its registers are those that the springs' parameters
// have between events ----

// Fetches what the last tick made of all voxels of the robot.
__device__ inline void fetch_drive(const launch_arguments& launch, block_memory& shared) {
    constexpr lattice body{LIMAX_NX, LIMAX_NY, LIMAX_NZ};
    constexpr site_grid grid{lattice{}};
    const stored_drive stored(control_state_of(launch.control.columns, launch.scene, shared.record,
                                               robot_of(launch), body.voxels()));
    for (int i = opaque(threadIdx.x); i < sites_before + sites; i += threads) {
        const int site = i - sites_before;
        const int x = site % grid.x, y = site / grid.x % grid.y, z = site / (grid.x * grid.y);
        const bool inside = site >= 0 && x < body.nx && y < body.ny && z < body.nz;
        for (int half = 0; half < 2; ++half)
            shared.drive[half][i] = inside ? stored(int(body.voxel(x, y, z)), half) : real(0);
    }
    __syncthreads();
}

// What the controller senses of the body as a whole.
__device__ inline void sense_body(const launch_arguments& launch, block_memory& shared) {
    constexpr site_grid grid{lattice{}};
    constexpr int at_once = 6;
    const robot_record& record = shared.record;
    const double of_total = 1.0 / record.total_mass;
    const float* const mass = launch.mass + robot_of(launch) * sites;
#pragma unroll 1
    for (int first = 0; first < sensors::body_sums; first += at_once) {
        const int count = smaller(at_once, sensors::body_sums - first);
#pragma unroll 1
        for (int i = 0; i < count; ++i) {
            int64_t part = 0;
            for (int site = opaque(threadIdx.x); site < sites; site += threads)
                part += part_of_body(first + i, shared.at.load(place_of(site)), mass[site], grid,
                                     site, of_total);
            add_over_warp(part, shared.part[sum_center + i]);
        }
        add_over_block(shared, sum_center, count);
        if (threadIdx.x == 0)
            for (int i = 0; i < count; ++i)
                shared.control.sums[first + i] = shared.sum_of[sum_center + i];
        __syncthreads();
    }
    const solid_record* block = nullptr;
    if constexpr (has_solid)
        block = solid_of(launch, robot_of(launch), sites,
                         launch.solids.after + robot_of(launch) * 3 * sites)
                    .records;
    if (threadIdx.x == 0)
        sense_whole(launch, record, shared.control.sums, block, shared.control.whole);
    __syncthreads();
}

// A tick of the controller. Returns false if it gave a value that is not finite.
__device__ __noinline__ bool tick_block(const launch_arguments& launch, block_memory& shared) {
    constexpr site_grid grid{lattice{}};
    robot_record& record = shared.record;
    scene_params params(launch.params);
    follow_origin(params, launch.scene, record.origin, time_of(record, record.next_tick));
    if constexpr (senses_body) sense_body(launch, shared);
    const int64_t number = record.ticks;
    const float* const genes = shared.control.genes_of(launch, robot_of(launch));
    bool finite = true;
    for (int v = opaque(threadIdx.x); v < LIMAX_NX * LIMAX_NY * LIMAX_NZ; v += threads)
        finite &= tick_voxel(
            launch, record, params, robot_of(launch), number, grid, v % LIMAX_NX,
            v / LIMAX_NX % LIMAX_NY, v / (LIMAX_NX * LIMAX_NY), genes, shared.control.whole,
            shared.control.per_gravity,
            [&](int site, int c) { return shared.at.load(place_of(site) + corner_place(c)); },
            [&](int site, int half, real drive) {
                shared.drive[half][sites_before + site] = drive;
            });
    if (any_of_robot(!finite)) return false;
    if (threadIdx.x == 0) count_tick(record);
    __syncthreads();
    return true;
}

// One thread's part of a robot: its cells and their masses.
struct block_robot {
    const launch_arguments& launch;
    block_memory& shared;
    const int thread;
    thread_cells cells;
    mass_state mass[cell_rounds];  // massless in a lane without a cell
    real next_velocity[cell_rounds][3];
    scene_params params;
    bool moved = false;  // a mass has moved so far that contact lists are out of date
    // bits of rounds: in which this thread has a cell, and whose mass touches a solid
    unsigned present = 0, touching = 0;

    __device__ block_robot(const launch_arguments& arguments, block_memory& memory)
        : launch(arguments), shared(memory), thread(threadIdx.x), params(arguments.params) {
        // also the places that no mass has
        for (int place = thread; place < places; place += threads) {
            shared.at.store(place, {});
            for (int c = 1; c < corners; ++c) shared.sum.store(c, place, {});
        }
        cells.load(launch, shared);
        load_masses();
    }

    // ---- where things are ----

    __device__ int64_t index() const { return robot_of(launch); }
    __device__ bool leads() const { return thread == 0; }
    __device__ robot_solid solid() const {
        return solid_of(launch, robot_of(launch), sites,
                        launch.solids.after + robot_of(launch) * 3 * sites);
    }
    __device__ contact_pairs contacts() const {
        constexpr site_grid grid{lattice{}};
        return pairs_of(launch, grid, robot_of(launch));
    }
    // Waits for all threads of the robot.
    __device__ void wait() const { __syncthreads(); }

    // Calls visit(round) for this thread's masses. A lane without a cell has one of 0 kg at an
    // unused place.
    template <class Visit>
    __device__ void each_mass(const Visit& visit) {
#pragma unroll
        for (int k = 0; k < cell_rounds; ++k)
            if (cells.has_slot(k)) {
                if (k >= cube_rounds) shared.weights[k - cube_rounds].load(mass[k]);
                visit(k);
            }
    }
    // Calls visit(round, site) for those that have a site.
    template <class Visit>
    __device__ void each_site(const Visit& visit) {
        each_mass([&](int k) {
            if (present >> k & 1u) visit(k, site_at(cells.place[k]));
        });
    }

    // ---- the beginning of a launch ----

    // Loads this thread's masses as the last launch stored them.
    __device__ void load_masses() {
#pragma unroll
        for (int k = 0; k < cell_rounds; ++k) {
            const int site = cells.entry(launch, k).site;
            mass[k] = {};
            for (real& velocity : next_velocity[k]) velocity = 0;
            if (site >= 0) {
                present |= 1u << k;
                load_mass(mass[k], next_velocity[k], launch.mass[robot_of(launch) * sites + site],
                          state_of(launch) + site, sites);
            }
            if (k >= cube_rounds) shared.weights[k - cube_rounds].store(mass[k]);
        }
    }

    // Ends the step that the last launch left between kick and drift, where both velocities are
    // stored, and publishes all masses for their springs.
    __device__ void begin_masses() {
        __syncthreads();
        const robot_record& record = shared.record;
        if constexpr (controlled) {
            shared.control.load(launch, record, robot_of(launch), threads);
            fetch_drive(launch, shared);
            load_springs();
        }
        const bool begun = record.begun;
        each_mass([&](int k) {
            if (begun)
                finish(k, times_at(record, record.step));
            else
                publish(mass[k], cells.place[k], shared);
        });
        __syncthreads();
        if constexpr (meets) list_contacts();
    }

    // ---- an event ----

    // Notes what breaks a limit. Returns false when the robot has diverged.
    __device__ bool check_limits(int64_t step) {
        robot_record& record = shared.record;
        if (step % check_interval != 0 && step != record.steps) return true;
        const int broken = broken_limits();
        if (!any_of_robot(broken)) return true;
        const bool diverged = any_of_robot(broken & limits_of_divergence);
        const bool coarse_seen = any_of_robot(broken & limit_coarse);
        const bool nonfinite = any_of_robot(broken & limit_nonfinite);
        const bool speed = any_of_robot(broken & limit_speed);
        if (thread == 0 && coarse_seen) record.coarse = 1;
        if (diverged && thread == 0) note_divergence(record, step, nonfinite, speed);
        return !diverged;
    }

    // The limits that this thread's masses and springs break.
    __device__ int broken_limits() {
        int broken = 0;
        const auto coarse = real(coarse_speed(launch.rest[0], shared.record.time_step));
        each_mass([&](int k) { broken |= broken_by_mass(mass[k], launch, coarse); });
        if (cells.stretched(launch, shared)) broken |= limit_stretch;
        if constexpr (has_solid)
            if (leads()) broken |= broken_by_solids(solid(), launch);
        return broken;
    }

    // Finds the centre of mass, and moves the origin and all masses if it is far away.
    __device__ void take_center(int64_t step) {
        robot_record& record = shared.record;
        add_center(*this);
        add_over_block(shared, sum_center, 6);
        if (thread == 0)
            shared.moved = note_center(launch, record, step, shared.sum_of, shared.shift, true);
        __syncthreads();
        if (!shared.moved) return;
        each_mass([&](int k) {
            shift_mass(mass[k], shared.shift);
            publish(mass[k], cells.place[k], shared);
        });
        follow_origin(params, launch.scene, record.origin, time_of(record, step));
    }

    // Counts the masses that touch a contact.
    __device__ void take_contact() {
        int64_t touching_masses = 0;
        each_mass([&](int k) { touching_masses += touches(mass[k], params); });
        add_over_warp(touching_masses, shared.part[sum_touching]);
        add_over_block(shared, sum_touching, 1);
        if (thread == 0) note_contact(launch, shared.record, shared.sum_of[sum_touching], true);
    }

    // Lets the controller act. Returns false if it gave a value that is not finite.
    __device__ bool take_tick(int64_t /*step*/) {
        wait();
        // The masses are in memory meanwhile, by a copy that no compiler sees through: it would
        // keep other values there, and read them again in every step.
        mass_state kept[cell_rounds];
        for (int k = 0; k < cell_rounds; ++k) kept[k] = mass[k];
        asm volatile("" ::"l"(kept) : "memory");
        const bool finite = tick_block(launch, shared);
        load_springs();
        asm volatile("" ::"l"(kept) : "memory");
        for (int k = 0; k < cell_rounds; ++k) mass[k] = kept[k];
        return finite;
    }
    // Loads the springs' parameters as the last tick made them.
    __device__ void load_springs() {
        cells.load(launch, shared);
        cells.drive(launch, shared);
    }

    // ---- a step ----

    // Returns a function that gives the solids' push on mass k of this thread.
    __device__ auto pushes_of_solids() {
        if constexpr (!has_solid) {
            return [](int) { return effects::vector<real>{}; };
        } else {
            const robot_solid own = solid();
            return [this, own, seen = seen_solids(own.records)](int k) {
                bool touched;
                const auto push =
                    push_of_solids(own, launch, seen, site_at(cells.place[k]), mass[k], touched);
                touching |= unsigned(touched) << k;
                return push;
            };
        }
    }

    // Forces of springs and of masses in contact, then the kick of all masses.
    __device__ void kick_masses(const loop_state& now) {
        const auto muscles = moment_of(shared, now);
        force own[cell_rounds] = {};
        each_mass([&](int k) {
            own[k] = cells.sum_springs(launch, shared, k, corner_of(mass[k]), muscles);
        });
        // before any mass moves
        effects::vector<real> met[cell_rounds] = {};
        if constexpr (meets) {
            const contact_pairs pairs = contacts();
            each_site([&](int k, int site) {
                met[k] = force_of_pairs(pairs, launch, site,
                                        [&](int other) { return shared.at.load(place_of(other)); });
            });
        }
        __syncthreads();
        const auto moment =
            scripted_moment_at(launch, shared.record, shared.record.step + now.since_event);
        if constexpr (has_motion) move_contacts(params, launch.scene, moment.origin, moment.time);
        moved = false;
        touching = 0;
        if constexpr (!kicks_apart) {
            each_mass([&](int k) {
                begin_mass(mass[k], force_on(own[k], cells.place[k], shared.sum), met[k], params,
                           moment, shared.times.h, next_velocity[k]);
                end_step(k);
            });
        } else {
            const auto push = pushes_of_solids();
            each_mass([&](int k) {
                kick_mass(mass[k], force_on(own[k], cells.place[k], shared.sum), met[k], push(k),
                          params, moment, shared.times.h, next_velocity[k]);
                if constexpr (has_faces) show_velocity(next_velocity[k], cells.place[k], shared);
            });
        }
    }

    // Impulses of laws on faces.
    __device__ void push_faces(const loop_state& now) {
        const float* const lightest = launch.faces + robot_of(launch) * 3 * sites;
        each_face_law(
            [&](auto effect, int axis) {
                each_site([&](int k, int /*site*/) {
                    push_face(effect, params, lightest, axis, cells.place[k], shared.times.h,
                              shared);
                });
            },
            [&](int axis) {
                each_site([&](int k, int /*site*/) {
                    take_from_faces(axis, cells.place[k], mass[k].inverse_mass, next_velocity[k],
                                    shared);
                    show_velocity(next_velocity[k], cells.place[k], shared);
                });
            },
            [] { __syncthreads(); });
    }

    // The solids' own step, and what their friction does to the masses.
    __device__ void step_solids(const loop_state& now) {
        const robot_record& record = shared.record;
        const robot_solid own = solid();
        const auto each_touching = [&](const auto& visit) {
            each_site([&](int k, int site) {
                if (touching >> k & 1u)
                    for (int axis = 0; axis < 3; ++axis)
                        visit(own.after[axis * sites + site], next_velocity[k][axis]);
            });
        };
        each_touching([](real& there, real& here) { there = here; });
        __syncthreads();
        if (thread < lanes)
            limax::cuda::step_solids(
                own, launch, record.origin, time_of(record, record.step + now.since_event),
                double(shared.times.h), !now.last(), record.time_step, double(shared.times.share));
        __syncthreads();
        each_touching([](const real& there, real& here) { here = __ldcg(&there); });
    }

    // Friction, then the end of the step.
    __device__ void end_masses(const loop_state& now) {
        each_mass([&](int k) {
            slow_mass(mass[k], params, shared.times.h, next_velocity[k]);
            end_step(k);
        });
    }

    __device__ void end_step(int k) {
        finish(k, shared.times);
        if constexpr (meets)
            if (present >> k & 1u)
                moved |= contacts().moved(site_at(cells.place[k]), corner_of(mass[k]));
    }
    __device__ void finish(int k, const step_times& times) {
        finish_mass(mass[k], next_velocity[k], times.dt, times.share);
        publish(mass[k], cells.place[k], shared);
    }

    // After all masses have moved.
    __device__ void begin_step(int64_t /*step*/) {
        if constexpr (meets) {
            if (any_of_robot(moved)) list_contacts();
        } else {
            __syncthreads();
        }
    }

    __device__ void list_contacts() {
        const contact_pairs pairs = contacts();
        each_site([&](int /*k*/, int site) {
            pairs.list(site, [&](int other) { return shared.at.load(place_of(other)); });
        });
    }

    // ---- the end of a launch ----

    // Stores what the next launch, or the host, reads: all of a mass before the last kick, or where
    // the robot diverged, and the velocity after that kick.
    __device__ void store_masses() {
        each_mass([&](int k) {
            const int site = cells.entry(launch, k).site;
            if (site >= 0) store_mass(mass[k], state_of(launch) + site, sites);
        });
        __syncthreads();
    }
    __device__ void store_kick() {
        each_mass([&](int k) {
            const int site = cells.entry(launch, k).site;
            if (site >= 0) limax::cuda::store_kick(mass[k], state_of(launch) + site, sites);
        });
        __syncthreads();
    }
    __device__ void store_record() {
        copy_record(launch.records[robot_of(launch)], shared.record, thread, threads);
    }
};

}  // namespace limax::cuda

extern "C" __global__ void __launch_bounds__(LIMAX_THREADS, LIMAX_BLOCKS)
    limax_advance(const __grid_constant__ limax::cuda::launch_arguments launch) {
    using namespace limax::cuda;
    extern __shared__ __align__(16) char memory[];
    block_robot robot(launch, *reinterpret_cast<block_memory*>(memory));
    run_robot(robot);
}
