// grid.h: the grid path: runs of robots that are too large for a block. Their masses are in tiles
// in global memory, and several blocks share a robot and wait for each other once a step. Each tile
// also computes the springs that cross into it, so that no force is exchanged; sums over a mass
// have the order of cells.h, so trajectories are those of step.h. Compiled for one scene (scene.h)
// and for one lattice or any (springs.h):
//   LIMAX_TILE_X, LIMAX_TILE_Y, LIMAX_TILE_Z  sites of a tile
//   LIMAX_THREADS, LIMAX_BLOCKS               threads of a block, blocks of a multiprocessor
//   LIMAX_SHARED_BYTES                        dynamic shared memory of a block
// SI units.
#pragma once

#include "backend/cuda/kernels/contact_pairs.h"
#include "backend/cuda/kernels/grid_faces.h"
#include "backend/cuda/kernels/grid_tiles.h"
#include "backend/cuda/kernels/loop.h"

namespace limax::cuda {

// One block's part of a robot: every `blocks`-th tile. Registers are scarce in tile_forces(): what
// it does not read is computed at each use.
struct grid_robot {
    const grid_arguments& arguments;
    const launch_arguments& launch;
    grid_memory& shared;
    const int thread, blocks, block;
    const int64_t robot;
    const site_grid grid;
    const int count;             // of sites
    const float* const columns;  // of springs
    real* const state;
    // velocities after the kick; where laws act on faces then impulses on their corners
    real* const after;
    const contact_pairs pairs;
    scene_params params;
    int event = 0;       // of this launch
    int side = 0;        // which half of the exchange is being read
    int64_t listed = 0;  // step at which contact lists were made
    bool moved = false;  // a mass has moved so far that contact lists are out of date

    __device__ grid_robot(const grid_arguments& all, grid_memory& memory)
        : arguments(all),
          launch(all.step),
          shared(memory),
          thread(threadIdx.x),
          blocks(all.blocks_of_robot),
          block(blockIdx.x % blocks),
          robot(launch.running[blockIdx.x / blocks]),
          grid(all.grid),
          count(grid.count()),
          columns(launch.springs + robot * (stored_columns * direction_count * sites())),
          state(launch.state + robot * (state_columns * sites())),
          after(all.after + robot * (6 * sites())),
          pairs(pairs_of(launch, grid, robot)),
          params(launch.params) {}

    // ---- where things are ----

    __device__ int sites() const { return site_grid::fixed ? grid.count() : count; }
    __device__ int64_t index() const { return robot; }
    __device__ bool leads() const { return block == 0 && thread == 0; }
    __device__ robot_solid solid() const { return solid_of(launch, robot, sites(), after); }
    __device__ const float* masses() const { return launch.mass + robot * sites(); }
    // One half of the exchange.
    __device__ real* half(int which) const {
        return arguments.exchange + (2 * robot + which) * (exchanged * sites());
    }
    // Waits for all threads of the robot.
    __device__ void wait() const { meet(arguments.arrived + robot, blocks); }

    template <class Visit>
    __device__ void each_tile(const Visit& visit) const {
        for (int tile = block; tile < tiles_of(grid); tile += blocks) visit(tile);
    }
    // Calls visit(site, index within the tile) for this thread's masses.
    template <class Visit>
    __device__ void each_mass(const Visit& visit) const {
        each_tile([&](int tile) { each_site(grid, tile, visit); });
    }

    // A mass as the last step left it. What springs see comes from the exchange.
    __device__ void recall(mass_state& m, int site, const corner& c) const {
        real kept[3];
        load_mass(m, kept, masses()[site], state + site, sites());
        for (int axis = 0; keeps_prediction && axis < 3; ++axis) m.predicted[axis] = kept[axis];
        take_corner(m, c);
    }
    // Stores what springs, and this mass at the next step, read of it.
    __device__ void publish(const mass_state& m, int site, int which) const {
        if (keeps_prediction) store_next_velocity(m.predicted, state + site, sites());
        exchange_corner(grid, half(which), site, corner_of(m));
    }

    // ---- the beginning of a launch ----

    // Ends the step that the last launch left between kick and drift, where both velocities are
    // stored, and publishes all masses for their springs.
    __device__ void begin_masses() {
        const robot_record& record = shared.record;
        const bool begun = record.begun;
        each_mass([&](int site, int) {
            mass_state m;
            real next_velocity[3];
            load_mass(m, next_velocity, masses()[site], state + site, sites());
            const step_times times = times_at(record, record.step);
            if (begun) finish_mass(m, next_velocity, times.dt, times.share);
            store_mass(m, state + site, sites());
            publish(m, site, 0);
        });
        wait();
        if constexpr (meets) list_contacts(record.step + begun);
        if constexpr (controlled) {
            shared.control.load(launch, record, robot, threads);
            store_drive();
        }
    }

    // ---- an event ----

    // Sums over all masses, and notes what breaks a limit. Returns false when the robot has
    // diverged.
    __device__ bool check_limits(int64_t step) {
        robot_record& record = shared.record;
        const bool limited = step % check_interval == 0 || step == record.steps;
        int64_t part[grid_sums] = {};
        add_masses(step, limited, part);
        if constexpr (has_solid)
            if (leads() && limited) {
                const int broken = broken_by_solids(solid(), launch);
                part[sum_nonfinite] += broken & limit_nonfinite ? 1 : 0;
                part[sum_speed] += broken & limit_speed ? 1 : 0;
            }
        sum_over_robot(part);
        const int64_t* const sums = shared.sum_of;
        if (thread == 0 && sums[sum_coarse] != 0) record.coarse = 1;
        if (sums[sum_nonfinite] + sums[sum_speed] + sums[sum_stretch] == 0) return true;
        if (thread == 0)
            note_divergence(record, step, sums[sum_nonfinite] != 0, sums[sum_speed] != 0);
        return false;
    }

    // Adds this thread's masses, and the springs that start at them, to its part of the sums.
    __device__ void add_masses(int64_t step, bool limited, int64_t (&part)[grid_sums]) const {
        const robot_record& record = shared.record;
        const bool contact = touchable && step == record.next_sample[sample_contact];
        const auto coarse = real(coarse_speed(launch.rest[0], record.time_step));
        const real* const seen = half(side);
        const double of_total = 1.0 / record.total_mass;
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
                const float stiffness = (columns + site)[d * sites()];
                if (!(stiffness > 0.0f)) continue;
                const direction along = direction_at(d);
                const int far = grid.at(along.x, along.y, along.z);
                part[sum_stretch] +=
                    stretched(stiffness, c, exchanged_corner(grid, seen + site, far), launch,
                              length_class(d));
            }
        });
    }

    // Adds up the parts of all threads of the robot in shared.sum_of.
    __device__ void sum_over_robot(const int64_t (&part)[grid_sums]) {
        for (int i = 0; i < grid_sums; ++i) add_over_warp(part[i], shared.part[i]);
        add_over_blocks(shared, arguments.sums + robot * (sum_sets * grid_sums),
                        arguments.arrived + robot, blocks, block == 0, event);
    }

    // Moves the origin and all masses if the centre of mass is far away.
    __device__ void take_center(int64_t step) {
        robot_record& record = shared.record;
        __syncthreads();
        if (thread == 0)
            shared.moved =
                note_center(launch, record, step, shared.sum_of, shared.shift, block == 0);
        __syncthreads();
        if (!shared.moved) return;
        each_mass([&](int site, int) {
            mass_state m;
            recall(m, site, exchanged_corner(grid, half(side), site));
            shift_mass(m, shared.shift);
            store_mass(m, state + site, sites());
            publish(m, site, side);
        });
        follow_origin(params, launch.scene, record.origin, time_of(record, step));
        wait();
    }

    __device__ void take_contact() {
        __syncthreads();
        if (thread == 0)
            note_contact(launch, shared.record, shared.sum_of[sum_touching], block == 0);
    }

    // Lets the controller act. Returns false if it gave a value that is not finite.
    __device__ bool take_tick(int64_t /*step*/) {
        robot_record& record = shared.record;
        wait();
        if constexpr (senses_body) sense_body();
        const int64_t number = record.ticks;
        const int nx = grid.x - 1, ny = grid.y - 1, voxels = nx * ny * (grid.z - 1);
        const float* const genes = shared.control.genes_of(launch, robot);
        const real* const seen = half(side);
        int64_t part[grid_sums] = {};
        for (int v = block * threads + thread; v < voxels; v += blocks * threads)
            part[sum_nonfinite] += !tick_voxel(
                launch, record, params, robot, number, grid, v % nx, v / nx % ny, v / (nx * ny),
                genes, shared.control.whole, shared.control.per_gravity,
                [&](int site, int c) {
                    return exchanged_corner(grid, seen, site + grid.corner(c));
                },
                [](int, int, real) {});
        sum_over_robot(part);
        if (shared.sum_of[sum_nonfinite] != 0) return false;
        if (thread == 0) count_tick(record);
        __syncthreads();
        store_drive();
        return true;
    }

    // Stores what the controller's last tick makes of the springs' parameters.
    __device__ void store_drive() const {
        const int64_t voxels = int64_t(grid.x - 1) * (grid.y - 1) * (grid.z - 1);
        const control_state state =
            control_state_of(launch.control.columns, launch.scene, shared.record, robot, voxels);
        float* const stored = const_cast<float*>(columns);
        each_mass([&](int site, int) {
            for (int number = 0; number < direction_count; ++number) {
                const auto [at_tick, per_step] =
                    driven_at(launch, state, grid, columns, number, site, stored_drive(state));
                float* const spring = stored + number * sites() + site;
                spring[(spring_columns - 2) * direction_count * sites()] = at_tick;
                spring[(spring_columns - 1) * direction_count * sites()] = per_step;
            }
        });
        wait();
    }

    // What the controller senses of the body as a whole.
    __device__ void sense_body() {
        const double of_total = 1.0 / shared.record.total_mass;
        for (int first = 0; first < sensors::body_sums; first += grid_sums) {
            int64_t part[grid_sums] = {};
            each_mass([&](int site, int) {
                const corner c = exchanged_corner(grid, half(side), site);
                for (int i = 0; i < grid_sums; ++i)
                    part[i] += part_of_body(first + i, c, masses()[site], grid, site, of_total);
            });
            sum_over_robot(part);
            if (thread < grid_sums) shared.control.sums[first + thread] = shared.sum_of[thread];
            __syncthreads();
        }
        const solid_record* block_of_robot = nullptr;
        if constexpr (has_solid) block_of_robot = solid().records;
        if (thread == 0)
            sense_whole(launch, shared.record, shared.control.sums, block_of_robot,
                        shared.control.whole);
        __syncthreads();
    }

    // ---- a step ----

    // Returns a function that gives the solids' push on a mass.
    __device__ auto pushes_of_solids() const {
        if constexpr (!has_solid) {
            return [](int, const mass_state&) { return effects::vector<real>{}; };
        } else {
            const robot_solid own = solid();
            return [this, own, seen = seen_solids(own.records)](int site, const mass_state& m) {
                bool touched;
                return push_of_solids(own, launch, seen, site, m, touched);
            };
        }
    }

    // Forces of springs and of masses in contact, then the kick of all masses, tile by tile.
    __device__ void kick_masses(const loop_state& now) {
        const auto moment =
            scripted_moment_at(launch, shared.record, shared.record.step + now.since_event);
        if constexpr (has_motion) move_contacts(params, launch.scene, moment.origin, moment.time);
        moved = false;
        const auto push = pushes_of_solids();
        each_tile([&](int tile) {
            const real* const seen = half(side);
            tile_forces(grid, launch, columns, seen, tile, moment_of(shared, now), shared);
            each_site(grid, tile, [&](int site, int at) {
                const int in_window =
                    (at % tile_x + 1) + window_x * ((at / tile_x % tile_y + 1) +
                                                    window_y * (at / (tile_x * tile_y) + 1));
                mass_state m;
                real next_velocity[3];
                recall(m, site, shared.at.load(in_window));
                effects::vector<real> met{};
                if constexpr (meets)
                    met = force_of_pairs(pairs, launch, site, [&](int other) {
                        return exchanged_corner(grid, seen, other);
                    });
                kick_mass(m, force_on(at, shared), met, push(site, m), params, moment,
                          shared.times.h, next_velocity);
                if constexpr (kicks_apart)
                    keep_kick(m, site, next_velocity);
                else
                    end_step(m, site, next_velocity, now);
            });
            __syncthreads();
        });
    }

    // Stores a mass's velocity after the kick.
    __device__ void keep_kick(const mass_state& m, int site, const real next_velocity[3]) const {
        for (int axis = 0; axis < 3; ++axis) {
            after[axis * sites() + site] = next_velocity[axis];
            if constexpr (compensated)
                state[(column_lost_velocity + axis) * sites() + site] = m.lost_velocity[axis];
        }
    }

    // Impulses of laws on faces.
    __device__ void push_faces(const loop_state& now) const {
        const grid_faces faces{grid,       masses(), launch.faces + robot * 3 * sites(),
                               half(side), after,    after + 3 * sites()};
        each_face_law(
            [&](auto effect, int axis) {
                each_mass(
                    [&](int site, int) { faces.push(effect, params, axis, site, shared.times.h); });
            },
            [&](int axis) { each_mass([&](int site, int) { faces.take(axis, site); }); },
            [&] { wait(); });
    }

    // The solids' own step, and what their friction does to the masses.
    __device__ void step_solids(const loop_state& now) const {
        const robot_record& record = shared.record;
        wait();
        if (block == 0 && thread < lanes)
            limax::cuda::step_solids(
                solid(), launch, record.origin, time_of(record, record.step + now.since_event),
                double(shared.times.h), !now.last(), record.time_step, double(shared.times.share));
        wait();
    }

    // Friction, then the end of the step.
    __device__ void end_masses(const loop_state& now) {
        each_mass([&](int site, int) {
            mass_state m;
            recall(m, site, exchanged_corner(grid, half(side), site));
            // one block wrote the velocities of all masses that touch solids
            const auto velocity = [&](int axis) {
                const real* const at = after + axis * sites() + site;
                return has_solid ? __ldcg(at) : *at;
            };
            real next_velocity[3] = {velocity(0), velocity(1), velocity(2)};
            end_step(m, site, next_velocity, now);
        });
    }

    __device__ void end_step(mass_state& m, int site, real next_velocity[3],
                             const loop_state& now) {
        slow_mass(m, params, shared.times.h, next_velocity);
        if (now.last()) {
            store_mass(m, state + site, sites());
            store_next_velocity(next_velocity, state + site, sites());
        } else {
            finish_mass(m, next_velocity, shared.times.dt, shared.times.share);
            store_mass(m, state + site, sites());
            publish(m, site, 1 - side);
            if constexpr (meets) moved |= pairs.moved(site, corner_of(m));
        }
    }

    // After all masses have moved.
    __device__ void begin_step(int64_t step) {
        if constexpr (meets)
            if (moved) atomicMax(launch.pairs.moved + robot, static_cast<unsigned long long>(step));
        wait();
        side = 1 - side;
        // a block ahead may have set a later step: then lists are made once too often
        if constexpr (meets)
            if (__ldcg(launch.pairs.moved + robot) > static_cast<unsigned long long>(listed))
                list_contacts(step);
    }

    __device__ void list_contacts(int64_t step) {
        const real* const seen = half(side);
        each_mass([&](int site, int) {
            pairs.list(site, [&](int other) { return exchanged_corner(grid, seen, other); });
        });
        listed = step;
    }

    // ---- the end of a launch ----

    __device__ void store_masses() const { __syncthreads(); }
    __device__ void store_kick() const { __syncthreads(); }
    __device__ void store_record() const {
        if (block == 0) copy_record(launch.records[robot], shared.record, thread, threads);
    }
};

}  // namespace limax::cuda

extern "C" __global__ void __launch_bounds__(LIMAX_THREADS, LIMAX_BLOCKS)
    limax_advance(const __grid_constant__ limax::cuda::grid_arguments arguments) {
    using namespace limax::cuda;
    extern __shared__ __align__(16) char memory[];
    grid_robot robot(arguments, *reinterpret_cast<grid_memory*>(memory));
    run_robot(robot);
}
