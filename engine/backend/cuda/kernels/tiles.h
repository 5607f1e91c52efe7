// tiles.h: the tiles path: runs of robots that are too large for a block, each block with a tile of
// the lattice for the whole launch. A thread owns cells (cells.h), as on the block path: the state
// of their masses and the parameters of their springs are in registers and shared memory. Tiles
// exchange two things per step, as packets with the step's number (tile_memory.h): masses on the
// low sides of a tile are shown to the tiles below, whose cells on high sides read them and send
// back the sums of their forces. Every sum of a mass has the order of cells.h, whatever the tiles.
// All tiles of a robot must be on the GPU at once. Order of a step:
//   cells of round 0, which end within the tile
//   masses of other tiles arrive; the other cells; those on high sides send
//   forces of other tiles arrive; masses, first those that other tiles wait for
// Compiled for one scene without laws on faces, contacts of masses or a solid (scene.h), lattice
// (springs.h) and plan (tile_plan.h):
//   LIMAX_ROW, LIMAX_PLANE       places between neighbours along y and z in shared memory
//   LIMAX_PLACES                 places of a tile and of one layer beyond it
//   LIMAX_OWN_PLACES             those up to its last mass
//   LIMAX_TILES, LIMAX_ROUNDS    tiles of a robot, cells of a thread
//   LIMAX_RIM_SLOTS              the first threads, whose last cell is on the rim of the lattice: a
//                                square, which takes less time and memory than a cube; 0 where
//                                cells of the rim are cubes without the springs beyond
//   LIMAX_SENDERS                rounds, from the second on, whose cells may reach into other tiles
//   LIMAX_READERS                the first threads, which receive masses and have all cells that
//                                reach into other tiles
//   LIMAX_HALO, LIMAX_INBOX      most masses and forces that a thread receives
//   LIMAX_THREADS                threads of a block
//   LIMAX_SHARED_BYTES           dynamic shared memory of a block
// SI units.
#pragma once

#include "backend/cuda/kernels/loop.h"
#include "backend/cuda/kernels/tile_memory.h"

namespace limax::cuda {

static_assert(!has_faces && !meets && !has_solid);

// One thread's part of a tile: its cells and their masses.
struct tile_robot {
    const tile_arguments& arguments;
    const launch_arguments& launch;
    tile_memory& shared;
    const int thread;
    // of a mass what only its thread reads; the rest is in shared memory
    mass_state mass[rounds];
    real next_velocity[rounds][3];
    spring_parameters springs[cube_rounds][cube_classes];
    spring_parameters square_springs[rim_classes];  // of a cell on the rim
    // as in the table; below 0 without a mass
    int cell[rounds];
    unsigned masses_expected = 0, forces_expected = 0;  // bits as receive() takes them
    uint32_t number = 1;                                // of the masses that are shown
    int event = 0;                                      // of this launch
    scene_params params;

    __device__ tile_robot(const tile_arguments& all, tile_memory& memory)
        : arguments(all),
          launch(all.step),
          shared(memory),
          thread(threadIdx.x),
          params(all.step.params) {
        for (int place = thread; place < places; place += threads) shared.at.store(place, {});
        for (int i = thread; i < (corners - 1) * own_places; i += threads)
            shared.sum.store_at(i, {});
        __syncthreads();
        load_masses();
        expect_packets();
        load_springs();
    }

    // ---- where things are, computed at each use so that it occupies no register between ----

    __device__ static int tile() { return opaque(int(blockIdx.x)) % LIMAX_TILES; }
    __device__ static int robot_of_launch() { return opaque(int(blockIdx.x)) / LIMAX_TILES; }
    __device__ int64_t index() const { return launch.running[robot_of_launch()]; }
    __device__ bool leads() const { return shared.rank == 0; }
    __device__ const float* masses() const { return launch.mass + index() * sites; }
    __device__ real* state() const { return launch.state + index() * (state_columns * sites); }
    __device__ const float* columns() const {
        return launch.springs + index() * (stored_columns * direction_count * sites);
    }
    __device__ packet* masses_of_robot() const {
        return arguments.masses +
               int64_t(robot_of_launch()) * (shown_mass::packets * LIMAX_TILES * slots);
    }
    __device__ packet* forces_of_robot() const {
        return arguments.forces +
               int64_t(robot_of_launch()) * (sent_force::packets * LIMAX_TILES * sent_forces);
    }
    __device__ unsigned* arrived() const { return arguments.arrived + 3 * robot_of_launch(); }
    // This thread's number in a row of its tile's table.
    __device__ int in_row(int row) const {
        return arguments.table[(tile() * rows.count() + row) * threads + thread];
    }
    __device__ int site(int round) const { return in_row(rows.site() + round); }
    __device__ static int place_in(int cell) { return cell & 0xffff; }
    __device__ static bool flag(int cell, int bit) { return cell >> (16 + bit) & 1; }
    __device__ int place(int round) const { return place_in(opaque(cell[round])); }
    __device__ int slot(int round) const { return round * threads + thread; }
    __device__ cell_parameters parameters(int round) {
        return {springs[round], shared, slot(round), {}};
    }
    __device__ square_parameters square() {
        const int here = opaque(cell[rounds - 1]);
        const bool x = flag(here, 1) || flag(here, 8), z = flag(here, 4) || flag(here, 11);
        return {square_springs, shared.square_damping[thread], !z ? 3 : x ? 5 : 6};
    }
    // There is none.
    __device__ robot_solid solid() const { return solid_of(launch, index(), sites, nullptr); }
    __device__ void wait() const { __syncthreads(); }

    // Calls visit(round) for this thread's cells that have a mass.
    template <class Visit>
    __device__ void each_cell(const Visit& visit) {
#pragma unroll
        for (int k = 0; k < rounds; ++k)
            if (cell[k] >= 0) visit(k);
    }
    // The same, with the masses complete.
    template <class Visit>
    __device__ void each_mass(const Visit& visit) {
        each_cell([&](int k) {
            mass_state& m = mass[k];
            const auto weights = shared.weights[slot(k)];
            m.mass = weights.x;
            m.inverse_mass = weights.y;
            m.root_mass = weights.z;
            take_corner(m, shared.at.load(place(k)));
            if (!shares_velocity && !leapfrog)
                for (int axis = 0; axis < 3; ++axis) m.predicted[axis] = m.velocity[axis];
            visit(k);
        });
    }

    // ---- the beginning of a launch ----

    // Loads this thread's masses as the last launch stored them. Places without a mass stay.
    __device__ void load_masses() {
#pragma unroll
        for (int k = 0; k < rounds; ++k) {
            const int own = site(k);
            cell[k] = -1;
            mass[k] = {};
            for (real& velocity : next_velocity[k]) velocity = 0;
            if (own < 0) continue;
            load_mass(mass[k], next_velocity[k], masses()[own], state() + own, sites);
            const int here = in_row(rows.cell() + k);
            shared.at.store(place_in(here), corner_of(mass[k]));
            shared.weights[slot(k)] = {mass[k].mass, mass[k].inverse_mass, mass[k].root_mass, 0};
            if (masses()[own] != 0.0f) cell[k] = here;
        }
    }

    // Finds out which packets come. A tile receives a mass of another where it sends a force to it,
    // so that no mass is shown again before all have read it: cell and mass must both be there.
    __device__ void expect_packets() {
        constexpr site_grid grid{lattice{}};
        const float* const mass_at = masses();
        for (int i = 0; i < LIMAX_HALO; ++i) {
            const int other = in_row(rows.mass_site() + i);
            if (other < 0) continue;
            mass_state m;
            real unused[3];
            load_mass(m, unused, mass_at[other], state() + other, sites);
            shared.at.store(in_row(rows.place() + i), corner_of(m));
            bool any = false;
            for (int c = 1; c < corners; ++c)
                if (in_row(rows.ends() + i) >> c & 1)
                    any |= mass_at[other - grid.corner(c)] != 0.0f;
            if (any && mass_at[other] != 0.0f) masses_expected |= 1u << i;
        }
        for (int i = 0; i < LIMAX_INBOX; ++i) {
            const int own = in_row(rows.force_site() + i);
            if (own < 0) continue;
            const int c = in_row(rows.sum() + i) / own_places + 1;
            if (mass_at[own] != 0.0f && mass_at[own - grid.corner(c)] != 0.0f)
                forces_expected |= 1u << i;
        }
    }

    // Loads the springs' parameters; those of a controlled robot as the last tick made them.
    __device__ void load_springs() {
        constexpr site_grid grid{lattice{}};
        each_cell([&](int k) {
            const int own = site(k);
            const int axes = (own % grid.x + 1 < grid.x ? 1 : 0) |
                             (own / grid.x % grid.y + 1 < grid.y ? 2 : 0) |
                             (own / (grid.x * grid.y) + 1 < grid.z ? 4 : 0);
            if (k >= cube_rounds) {
                held_square all{};
                load_square(all, grid, columns(), own, axes, square().axes);
                square().store(all);
                return;
            }
            held_cube all{};
            load_cube(all, grid, columns(), own, axes);
            parameters(k).store(all);
        });
    }
    __device__ void drive_springs() {
        constexpr site_grid grid{lattice{}};
        const control_state now =
            control_state_of(launch.control.columns, launch.scene, shared.record, index(),
                             lattice{LIMAX_NX, LIMAX_NY, LIMAX_NZ}.voxels());
        const auto drive = [&](spring_parameters& spring, int direction, int near) {
            if (!(spring.value[0] > 0.0f)) return;
            const auto driven =
                driven_at(launch, now, grid, columns(), direction, near, stored_drive(now));
            spring.value[spring_columns - 2] = driven.at_tick;
            spring.value[spring_columns - 1] = driven.per_step;
        };
        each_cell([&](int k) {
            if (k >= cube_rounds)
                for (int i = 0; i < rim_classes; ++i)
                    drive(square_springs[i], rim_direction(square().axes, i),
                          site(k) + (rim_near(i) ? grid.corner(square().corner(1)) : 0));
            else
                each_constant<cube_springs>([&](auto i) {
                    constexpr cube_spring s = cube_spring_at(i.value);
                    constexpr parameter_place at = cube_place(i.value);
                    if constexpr (at.other < 0)
                        drive(springs[k][at.of_class], s.direction, site(k) + grid.corner(s.near));
                });
        });
    }

    // Counts the tiles of the robot that have masses, once all are there. Returns whether this is
    // one of them.
    __device__ bool join() {
        bool any = false;
        each_cell([&](int) { any = true; });
        any = __syncthreads_or(any);
        if (thread == 0 && any) shared.rank = int(atomicAdd(arrived() + 2, 1u));
        meet(arrived() + 1, LIMAX_TILES);
        if (thread == 0) shared.tiles = int(__ldcg(arrived() + 2));
        __syncthreads();
        return any;
    }

    // Ends the step that the last launch left between kick and drift, where both velocities are
    // stored, and publishes all masses.
    __device__ void begin_masses() {
        const robot_record& record = shared.record;
        if constexpr (controlled) {
            shared.control.load(launch, record, index(), threads);
            __syncthreads();
            drive_springs();
        }
        each_mass([&](int k) {
            if (record.begun)
                finish(k, times_at(record, record.step), number);
            else
                publish(k, number);
        });
        __syncthreads();
    }

    // ---- an event ----

    // Sums over all masses, and notes what breaks a limit. Returns false when the robot has
    // diverged.
    __device__ bool check_limits(int64_t step) {
        robot_record& record = shared.record;
        receive_masses();
        __syncthreads();
        const bool limited = step % check_interval == 0 || step == record.steps;
        const bool contact = touchable && step == record.next_sample[sample_contact];
        const auto coarse = real(coarse_speed(launch.rest[0], record.time_step));
        int broken = 0, touching = 0;
        each_mass([&](int k) {
            touching += contact && touches(mass[k], params);
            if (!limited) return;
            broken |= broken_by_mass(mass[k], launch, coarse);
            const auto load = [&](int c) { return shared.at.load(place(k) + corner_place(c)); };
            if (k < cube_rounds ? cube_stretched(launch, parameters(k), load)
                                : square_stretched(launch, square(),
                                                   [&](int i) { return load(square().corner(i)); }))
                broken |= limit_stretch;
        });
        const auto add = [&](int sum, int64_t value) { add_over_warp(value, shared.part[sum]); };
        add(sum_touching, touching);
        add(sum_nonfinite, broken & limit_nonfinite ? 1 : 0);
        add(sum_speed, broken & limit_speed ? 1 : 0);
        add(sum_stretch, broken & limit_stretch ? 1 : 0);
        add(sum_coarse, broken & limit_coarse ? 1 : 0);
        add_center(*this);
        add_over_robot();
        const int64_t* const sums = shared.sum_of;
        if (thread == 0 && sums[sum_coarse] != 0) record.coarse = 1;
        if (sums[sum_nonfinite] + sums[sum_speed] + sums[sum_stretch] == 0) return true;
        if (thread == 0)
            note_divergence(record, step, sums[sum_nonfinite] != 0, sums[sum_speed] != 0);
        return false;
    }
    __device__ void add_over_robot() {
        add_over_blocks(shared, arguments.sums + robot_of_launch() * (sum_sets * grid_sums),
                        arrived(), shared.tiles, leads(), event);
    }

    // Moves the origin and all masses if the centre of mass is far away.
    __device__ void take_center(int64_t step) {
        robot_record& record = shared.record;
        __syncthreads();
        if (thread == 0)
            shared.moved = note_center(launch, record, step, shared.sum_of, shared.shift, leads());
        __syncthreads();
        if (!shared.moved) return;
        ++number;
        each_mass([&](int k) {
            shift_mass(mass[k], shared.shift);
            publish(k, number);
        });
        follow_origin(params, launch.scene, record.origin, time_of(record, step));
    }

    __device__ void take_contact() {
        __syncthreads();
        if (thread == 0) note_contact(launch, shared.record, shared.sum_of[sum_touching], leads());
    }

    // Lets the controller act. Returns false if it gave a value that is not finite.
    __device__ bool take_tick(int64_t /*step*/) {
        constexpr site_grid grid{lattice{}};
        robot_record& record = shared.record;
        receive_masses();
        __syncthreads();
        if constexpr (senses_body) sense_body();
        const int64_t tick = record.ticks;
        bool finite = true;
#pragma unroll 1
        for (int k = 0; k < rounds; ++k) {
            const int own = site(k), at = place_in(in_row(rows.cell() + k));
            const int x = own % grid.x, y = own / grid.x % grid.y, z = own / (grid.x * grid.y);
            if (own < 0 || x == LIMAX_NX || y == LIMAX_NY || z == LIMAX_NZ) continue;
            finite &= tick_voxel(
                launch, record, params, index(), tick, grid, x, y, z,
                shared.control.genes_of(launch, index()), shared.control.whole,
                shared.control.per_gravity,
                [&](int, int c) { return shared.at.load(at + corner_place(c)); },
                [](int, int, real) {});
        }
        add_over_warp(!finite, shared.part[sum_nonfinite]);
        add_over_robot();
        if (shared.sum_of[sum_nonfinite] != 0) return false;
        if (thread == 0) count_tick(record);
        __syncthreads();
        drive_springs();
        return true;
    }

    // What the controller senses of the body as a whole.
    __device__ void sense_body() {
        constexpr site_grid grid{lattice{}};
        const double of_total = 1.0 / shared.record.total_mass;
#pragma unroll 1
        for (int first = 0; first < sensors::body_sums; first += grid_sums) {
            const int count = smaller(int(grid_sums), sensors::body_sums - first);
#pragma unroll 1
            for (int i = 0; i < count; ++i) {
                int64_t part = 0;
                each_cell([&](int k) {
                    const int own = site(k);
                    part += part_of_body(first + i, shared.at.load(place(k)), masses()[own], grid,
                                         own, of_total);
                });
                add_over_warp(part, shared.part[i]);
            }
            add_over_robot();
            if (thread < count) shared.control.sums[first + thread] = shared.sum_of[thread];
            __syncthreads();
        }
        if (thread == 0)
            sense_whole(launch, shared.record, shared.control.sums, nullptr, shared.control.whole);
        __syncthreads();
    }

    // ---- a step ----

    __device__ void receive_masses() {
        receive<shown_mass, LIMAX_HALO>(
            masses_of_robot(), masses_expected, number,
            [&](int i) {
                return cell_entry{in_row(rows.mass() + i), in_row(rows.place() + i)};
            },
            [&](int to, const shown_mass& m) { shared.at.store(to, corner_of(m)); });
    }
    __device__ void receive_forces() {
        receive<sent_force, LIMAX_INBOX>(
            forces_of_robot(), forces_expected, number,
            [&](int i) {
                return cell_entry{in_row(rows.force() + i), in_row(rows.sum() + i)};
            },
            [&](int to, const sent_force& f) {
                shared.sum.store_at(to, {f.value[0], f.value[1], f.value[2]});
            });
    }

    // Forces of the springs of a cell: that on its own mass is returned.
    __device__ force sum_springs(int k, const effects::actuation::moment<real>& now) {
        const bool sends = k > 0 && k <= LIMAX_SENDERS;
        const int own_cell = opaque(cell[k]), at = place_in(own_cell);
        packet* const to =
            sends ? forces_of_robot() + (tile() * sent_forces + 7 * threads * (k - 1) + thread)
                  : nullptr;
        force own{};
        const auto load = [&](int c) { return shared.at.load(at + corner_place(c)); };
        const auto store = [&](int i, int c, const force& sum) {
            if (i == 0) {
                own = sum;
                return;
            }
            if (flag(own_cell, c)) shared.sum.store(c, at + corner_place(c), sum);
            if (sends && flag(own_cell, 7 + c))
                sent_force{{sum.x, sum.y, sum.z}}.send_to(to + (c - 1) * threads, number);
        };
        if (k < cube_rounds) {
            cube_forces<false>(launch, parameters(k), now, load,
                               [&](int c, const force& sum) { store(c, c, sum); });
        } else {
            const square_parameters set = square();
            square_forces(
                launch, set, now, [&](int i) { return load(set.corner(i)); },
                [&](int i, const force& sum) { store(i, set.corner(i), sum); });
        }
        return own;
    }
    // Forces of springs, then everything that acts on masses, up to the end of the step.
    __device__ void kick_masses(const loop_state& now) {
        const auto muscles = moment_of(shared, now);
        force own[rounds] = {};
        each_cell([&](int k) {
            if (k == 0) own[k] = sum_springs(k, muscles);
        });
        // the cells of other threads need none of these masses: they go on meanwhile
        if (LIMAX_READERS > 0 && thread < LIMAX_READERS) {
            receive_masses();
            wait_for_readers();
        }
        each_cell([&](int k) {
            if (k > 0) own[k] = sum_springs(k, muscles);
        });
        receive_forces();
        __syncthreads();
        const auto moment =
            scripted_moment_at(launch, shared.record, shared.record.step + now.since_event);
        if constexpr (has_motion) move_contacts(params, launch.scene, moment.origin, moment.time);
        each_mass([&](int k) {
            begin_mass(mass[k], force_on(own[k], place(k), shared.sum), {}, params, moment,
                       shared.times.h, next_velocity[k]);
            finish(k, shared.times, number + 1);
        });
    }
    __device__ void finish(int k, const step_times& times, uint32_t of) {
        finish_mass(mass[k], next_velocity[k], times.dt, times.share);
        publish(k, of);
    }
    // Shows a mass to the springs of this tile, and to those of others that wait for this number.
    __device__ void publish(int k, uint32_t of) {
        const corner c = limax::cuda::corner_of(mass[k]);
        const int own_cell = opaque(cell[k]);
        shared.at.store(place_in(own_cell), c);
        if (flag(own_cell, 0)) shown(c).send_to(masses_of_robot() + (tile() * slots + slot(k)), of);
    }

    // After all masses have moved.
    __device__ void begin_step(int64_t /*step*/) {
        __syncthreads();
        ++number;
    }

    // ---- the end of a launch ----

    // Stores what the next launch, or the host, reads: all of a mass before the last kick, or where
    // the robot diverged, and the velocity after that kick.
    __device__ void store_masses() {
        each_mass([&](int k) { store_mass(mass[k], state() + site(k), sites); });
    }
    __device__ void store_kick() {
        each_cell([&](int k) { limax::cuda::store_kick(mass[k], state() + site(k), sites); });
    }
    __device__ void store_record() {
        __syncthreads();
        if (leads()) copy_record(launch.records[index()], shared.record, thread, threads);
    }
};

}  // namespace limax::cuda

extern "C" __global__ void __launch_bounds__(LIMAX_THREADS, 1)
    limax_advance(const __grid_constant__ limax::cuda::tile_arguments arguments) {
    using namespace limax::cuda;
    extern __shared__ __align__(16) char memory[];
    tile_robot robot(arguments, *reinterpret_cast<tile_memory*>(memory));
    if (robot.join()) run_robot(robot);
}
