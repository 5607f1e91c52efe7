// measure.h: samples that the step kernel does not take: positions, velocities, energies, strains
// of robots that paused for them. One block per robot; sums in an order that depends on the lattice
// only. Compiled for one scene (scene.h). SI units.
#pragma once

#include "backend/cuda/kernels/control.h"
#include "backend/cuda/kernels/surface.h"
#include "body/lattice.h"

namespace limax::cuda {

// Sum, or largest, over the block; every thread gets it. Holds barriers.
__device__ inline double over_block(double value, bool largest, double part[measure_threads]) {
    __syncthreads();
    part[threadIdx.x] = value;
    for (int half = measure_threads / 2; half > 0; half /= 2) {
        __syncthreads();
        if (threadIdx.x < half) {
            const double other = part[threadIdx.x + half];
            part[threadIdx.x] =
                largest ? larger(part[threadIdx.x], other) : part[threadIdx.x] + other;
        }
    }
    __syncthreads();
    return part[0];
}

// One robot's columns at the step where it paused.
struct measured_robot {
    const measure_launch<real>& launch;
    const robot_record& record;
    int64_t index, sites;

    __device__ float mass(int64_t site) const {
        const float m = launch.mass[index * sites + site];
        return holding ? absolute(m) : m;
    }
    __device__ double state(int column, int64_t site) const {
        return double(launch.state[(index * state_columns + column) * sites + site]);
    }
    // between the velocities on both sides of t_n; at n = 0, and at every step of symplectic Euler,
    // the one before is the one at t_n
    __device__ double velocity(int axis, int64_t site) const {
        const real* u =
            launch.state + (index * state_columns + column_velocity + axis) * sites + site;
        if (!leapfrog || record.step == 0) return double(*u);
        const real after = u[(column_next_velocity - column_velocity) * sites];
        return double(real(0.5) * (*u + after));
    }
    __device__ separation<double> between(int64_t near, int64_t far) const {
        const auto along = [&](int axis) {
            return state(column_position + axis, far) - state(column_position + axis, near);
        };
        return {along(0), along(1), along(2)};
    }
    // Of a controlled robot: its drive, and steps since the last tick.
    __device__ control_state driven() const {
        return control_state_of(launch.control, launch.scene, record, index, launch.grid.voxels());
    }
    __device__ double since_tick() const { return double(steps_since_tick(record, record.step)); }
    __device__ double time() const { return time_of(record, record.step); }
    __device__ float parameter(int column, int64_t slot) const {
        return launch.springs[(index * stored_columns + column) * direction_count * sites + slot];
    }
};

// Calls visit(slot, length, rest length) for this thread's springs.
template <class Visit>
__device__ inline void each_spring(const measured_robot& robot, const Visit& visit) {
    for (int64_t slot = threadIdx.x; slot < direction_count * robot.sites;
         slot += measure_threads) {
        if (!(robot.parameter(0, slot) > 0.0f)) continue;
        const int d = int(slot / robot.sites);
        const int64_t near = slot % robot.sites;
        const int64_t far = near + robot.launch.grid.step(direction_at(d));
        const separation<double> e = robot.between(near, far);
        visit(slot, square_root(dot(e, e)), robot.launch.rest[direction_at(d).squared() - 1]);
    }
}

// This thread's part of what is stored between masses that meet, J.
__device__ inline double energy_of_pairs(const measured_robot& robot) {
    using namespace effects;
    const site_grid grid(robot.launch.grid);
    const body_surface body{
        grid, robot.launch.springs + robot.index * stored_columns * direction_count * robot.sites,
        robot.launch.surface + robot.index * robot.sites};
    double sum = 0;
    for_each([&]<class E>(E) {
        if constexpr (has<E> && bool(E::hooks & hook_meet)) {
            const double reach = reach_of<E>(robot.launch.scene, robot.launch.rest[0]);
            for (int64_t i = threadIdx.x; i < robot.sites; i += measure_threads) {
                const int near = body.surface[i];
                if (near < 0) break;
                body.each_of_surface([&](int far) {
                    if (far <= near) return true;
                    const separation<double> e = robot.between(near, far);
                    if (dot(e, e) < reach * reach && !body.joined(near, far)) {
                        pair_state<double> found{};
                        found.depth = reach - square_root(dot(e, e));
                        sum += E::stored(pair_params<double, E>(robot.launch.scene), found);
                    }
                    return true;
                });
            }
        }
    });
    return sum;
}

__device__ inline void measure_energy(const measured_robot& robot, double* out,
                                      double part[measure_threads]) {
    using namespace effects;
    double kinetic = 0, elastic = 0, gravitational = 0, power = 0;
    actuation::moment<double> now{0, 0}, rate{0, 0};
    control_state driven{};
    if constexpr (controlled) {
        driven = robot.driven();
        now = {1, robot.since_tick()};
        rate = {0, robot.record.step < robot.record.settle_steps ? 0 : 1 / robot.record.time_step};
    }
    if (!controlled && actuated && robot.record.step >= robot.record.settle_steps) {
        const double* values = robot.launch.scene.of(index_of<actuation>);
        const actuation::clock clock{values[0], robot.record.ramp, robot.record.phase_per_step};
        const int64_t since = robot.record.step - robot.record.settle_steps;
        now = actuation::at<double>(clock, since, robot.record.time_step);
        rate = actuation::rate_at(clock, since, robot.record.time_step);
    }
    each_spring(robot, [&](int64_t slot, double length, double rest) {
        spring_state<double> spring{};
        spring.length = length;
        spring.stiffness = robot.parameter(0, slot);
        spring.rest = rest;
        if constexpr (actuated) {
            if constexpr (controlled) {
                const auto change = change_at(
                    driven, site_grid(robot.launch.grid),
                    robot.launch.springs +
                        robot.index * (stored_columns * direction_count * robot.sites),
                    int(slot / robot.sites), int(slot % robot.sites), stored_drive(driven));
                spring.sine = double(float(change.at_tick));
                spring.cosine = double(float(change.per_step));
            } else {
                spring.sine = robot.parameter(spring_columns - 2, slot);
                spring.cosine = robot.parameter(spring_columns - 1, slot);
            }
            // dE/dt at fixed length: the tension times the rest length's speed, against it
            spring_state<double> still = spring;
            still.rest = 0;
            spring.rest = actuation::rest(now, spring);
            power -=
                tension(springs::pair(spring, {}), spring.length) * actuation::rest(rate, still);
        }
        elastic += springs::energy(spring);
    });
    const double world[3] = {0, 0, 0};
    for (int64_t site = threadIdx.x; site < robot.sites; site += measure_threads) {
        const double mass = robot.mass(site);
        if (!(mass > 0)) continue;
        const double u = robot.velocity(0, site), v = robot.velocity(1, site),
                     w = robot.velocity(2, site);
        kinetic += 0.5 * mass * fma(u, u, fma(v, v, w * w));
        const node_state<double> node{
            {robot.record.origin[0] + robot.state(column_position, site),
             robot.record.origin[1] + robot.state(column_position + 1, site),
             robot.record.origin[2] + robot.state(column_position + 2, site)},
            {u, v, w},
            mass,
            1.0 / mass};
        for_each([&]<class E>(E) {
            if constexpr (has<E> && stores_energy_on_masses<E>) {
                const scene_values& scene = robot.launch.scene;
                // an effect that the scene lacks stays, with values that store none
                const int count = repeatable<E> ? scene.count[index_of<E>] : 1;
                for (int i = 0; i < count; ++i)
                    (same_type<E, gravity> ? gravitational : elastic) +=
                        energy_of_mass<E>(make_params<E, double>(scene.of(index_of<E>, i), world,
                                                                 scene.heights, robot.time()),
                                          node);
            }
        });
    }
    if constexpr (meets) elastic += energy_of_pairs(robot);
    double* const value[4] = {&kinetic, &elastic, &gravitational, &power};
    for (int i = 0; i < 4; ++i) {
        const double sum = over_block(*value[i], false, part);
        if (threadIdx.x == 0) out[i] = sum;
    }
}

__device__ inline void measure_strain(const measured_robot& robot, double* out,
                                      double part[measure_threads]) {
    double sum = 0, most = 0, springs = 0;
    each_spring(robot, [&](int64_t, double length, double rest) {
        const double strain = absolute(length - rest) / rest;
        sum += strain;
        most = larger(most, strain);
        ++springs;
    });
    sum = over_block(sum, false, part);
    most = over_block(most, true, part);
    springs = over_block(springs, false, part);
    if (threadIdx.x != 0) return;
    out[0] = springs > 0 ? sum / springs : 0;
    out[1] = most;
}

// Activations between two ticks, or what the controller read at the last one.
__device__ inline void copy_control(const measured_robot& robot, int kind, double* out) {
    const control_state driven = robot.driven();
    const int64_t voxels = driven.voxels;
    if (kind == sample_sensor) {
        const real* const seen = driven.columns + layout.last_seen() * voxels;
        for (int64_t i = threadIdx.x; i < layout.seen * voxels; i += measure_threads)
            out[i] = double(seen[i]);
        return;
    }
    const double share =
        driven.share > real(0) ? robot.since_tick() / double(robot.record.tick) : 1.0;
    for (int64_t v = threadIdx.x; v < voxels; v += measure_threads) {
        const double from = driven.columns[(layout.activation() + driven.now) * voxels + v];
        const double to = driven.columns[(layout.activation() + 1 - driven.now) * voxels + v];
        out[v] = fma(share, to - from, from);
    }
}

}  // namespace limax::cuda

extern "C" __global__ void __launch_bounds__(limax::cuda::measure_threads)
    limax_measure(const __grid_constant__ limax::cuda::measure_launch<limax::cuda::real> launch) {
    using namespace limax;
    using namespace limax::cuda;
    __shared__ double part[measure_threads];
    __shared__ robot_record record;
    const int64_t index = launch.running[blockIdx.x];
    copy_record(record, launch.records[index], threadIdx.x, measure_threads);
    __syncthreads();
    if (!record.begun) return;
    const measured_robot robot{launch, record, index, launch.grid.sites()};
    const int64_t width[sample_kinds] = {
        3, 3 * int64_t(record.masses), 3 * int64_t(record.masses),        1, 4,
        2, launch.grid.voxels(),       layout.seen * launch.grid.voxels()};
    for (int kind = 0; kind < taken_kinds; ++kind) {
        if (taken_by_step(kind) || record.step != record.next_sample[kind]) continue;
        double* out = launch.samples[kind] + record.offset[kind] + width[kind] * record.taken[kind];
        if (kind == sample_energy) measure_energy(robot, out, part);
        if (kind == sample_strain) measure_strain(robot, out, part);
        if constexpr (controlled)
            if (kind == sample_activation || kind == sample_sensor) copy_control(robot, kind, out);
        if (kind == sample_position || kind == sample_velocity)
            for (int64_t site = threadIdx.x; site < robot.sites; site += measure_threads) {
                const int64_t rank = launch.ranks[index * robot.sites + site];
                for (int axis = 0; rank >= 0 && axis < 3; ++axis)
                    out[3 * rank + axis] =
                        kind == sample_velocity
                            ? robot.velocity(axis, site)
                            : record.origin[axis] + robot.state(column_position + axis, site);
            }
        __syncthreads();
        if (threadIdx.x == 0) {
            robot_record& kept = launch.records[index];
            kept.taken[kind] = record.taken[kind] + 1;
            kept.next_sample[kind] = record.next_sample[kind] + record.every[kind];
        }
    }
}
