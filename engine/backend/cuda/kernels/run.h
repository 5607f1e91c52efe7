// run.h: what happens between the steps of a run: limits, the origin that follows the centre of
// mass, marks, samples, the next event. SI units.
#pragma once

#include "backend/cuda/kernels/scene.h"

namespace limax::cuda {

// The last is not a divergence.
enum limit : int { limit_nonfinite = 1, limit_speed = 2, limit_stretch = 4, limit_coarse = 8 };
inline constexpr int limits_of_divergence = limit_nonfinite | limit_speed | limit_stretch;

// `coarse` is the robot's coarse_speed().
__device__ inline int broken_by_mass(const mass_state& m, const launch_arguments& launch,
                                     real coarse) {
    const real infinite = real(bits_as<double>(uint64_t(0x7ff) << 52));
    const real reach = absolute(m.position[0]) + absolute(m.position[1]) + absolute(m.position[2]);
    const real speed =
        square_root(fma(m.velocity[0], m.velocity[0],
                        fma(m.velocity[1], m.velocity[1], m.velocity[2] * m.velocity[2])));
    return (!(reach < infinite) || !(speed < infinite) ? limit_nonfinite : 0) |
           (!(speed <= real(launch.max_speed)) ? limit_speed : 0) |
           (speed > coarse ? limit_coarse : 0);
}

__device__ inline void note_divergence(robot_record& record, int64_t step, bool nonfinite,
                                       bool speed) {
    record.status = robot_diverged;
    record.reason = nonfinite ? divergence_nonfinite
                    : speed   ? divergence_speed
                              : divergence_stretch;
    record.begun = 0;
    record.step = step;
}

// The controller gave a value that is not finite.
__device__ inline void note_wild_control(robot_record& record, int64_t step) {
    note_divergence(record, step, false, false);
    record.reason = divergence_control;
}

__device__ inline int64_t middle_step(const robot_record& record) {
    return record.settle_steps + (record.steps - record.settle_steps) / 2;
}

// Where a launch stops: at the end of the slice, of the run, or where the measure kernel has to
// take a sample.
__device__ inline int64_t stop_of(const launch_arguments& launch, robot_record& record) {
    if (launch.most > 0)
        record.goal = record.step + smaller(launch.most, record.steps - record.step);
    int64_t stop = record.goal;
    for (int kind = 0; kind < taken_kinds; ++kind)
        if (!taken_by_step(kind)) stop = smaller(record.next_sample[kind], stop);
    return stop;
}

// Whether the centre of mass is needed at this step.
__device__ inline bool center_wanted(const robot_record& record, int64_t step) {
    return step % check_interval == 0 || step == record.settle_steps ||
           step == middle_step(record) || step == record.steps ||
           step == record.next_sample[sample_center];
}

// A mass's part of the centre of mass along an axis, `share` of the robot's mass times its place,
// as two words: 2^-32 m, and the rest in 2^-64 m.
__device__ inline void add_to_center(int64_t words[2], double share, double place) {
    const double scaled = share * place * 0x1p32;
    const int64_t whole = static_cast<int64_t>(scaled);
    words[0] += whole;
    words[1] += static_cast<int64_t>((scaled - static_cast<double>(whole)) * 0x1p32);
}
__device__ inline double center_of(const int64_t words[2]) {
    return (static_cast<double>(words[0]) + static_cast<double>(words[1]) * 0x1p-32) * 0x1p-32;
}

// Moves the origin, and notes what else depends on the centre of mass: marks and samples. `sums`
// are those of sum_over_masses. Returns whether the origin moved, by `shift`. Of several blocks
// that keep the same record one `writes` the samples.
__device__ inline bool note_center(const launch_arguments& launch, robot_record& record,
                                   int64_t step, const int64_t sums[block_sums], double shift[3],
                                   bool writes) {
    const bool sampled = step == record.next_sample[sample_center];
    double* const sample = launch.samples[sample_center] + record.offset[sample_center] +
                           3 * record.taken[sample_center];
    bool moved = false;
#pragma unroll 1
    for (int axis = 0; axis < 3; ++axis) {
        const double away = center_of(sums + sum_center + 2 * axis);
        const double center = record.origin[axis] + away;
        shift[axis] = step % check_interval == 0 ? origin_shift(away) : 0.0;
        moved |= shift[axis] != 0.0;
        record.origin[axis] += shift[axis];
        if (step == record.settle_steps) record.center[0][axis] = center;
        if (step == middle_step(record)) record.center[1][axis] = center;
        if (step == record.steps) record.center[2][axis] = center;
        if (sampled && writes) sample[axis] = center;
    }
    if (sampled) {
        ++record.taken[sample_center];
        record.next_sample[sample_center] += record.every[sample_center];
    }
    return moved;
}

__device__ inline void note_contact(const launch_arguments& launch, robot_record& record,
                                    int64_t touching, bool writes) {
    double* const sample = launch.samples[sample_contact] + record.offset[sample_contact] +
                           record.taken[sample_contact];
    if (writes) *sample = double(touching) / record.masses;
    ++record.taken[sample_contact];
    record.next_sample[sample_contact] += record.every[sample_contact];
}

__device__ inline void shift_mass(mass_state& m, const double shift[3]) {
    if (!(m.mass > real(0))) return;
#pragma unroll
    for (int axis = 0; axis < 3; ++axis)
        if (shift[axis] != 0.0)
            m.position[axis] = accumulate<compensated>(m.position[axis], real(-1),
                                                       real(shift[axis]), m.lost_position[axis]);
}

// Steps since the controller's last tick; 0 while the body settles.
__device__ inline int64_t steps_since_tick(const robot_record& record, int64_t step) {
    return record.ticks > 0 ? step - (record.next_tick - record.tick) : 0;
}
__device__ inline void count_tick(robot_record& record) {
    ++record.ticks;
    record.next_tick += record.tick;
}
// There is no tick at the end.
__device__ inline bool tick_due(const robot_record& record, int64_t step) {
    return step == record.next_tick && step < record.steps;
}

// The next event after `step`, `stop` at the latest.
__device__ inline int64_t next_event(const robot_record& record, int64_t step, int64_t stop) {
    // the half kick of n = 0 lasts one step
    int64_t next = step == 0 ? 1 : (step / check_interval + 1) * check_interval;
    next = smaller(next, stop);
    const int64_t awaited[4] = {record.settle_steps, middle_step(record),
                                record.next_sample[sample_center],
                                record.next_sample[sample_contact]};
    for (const int64_t at : awaited)
        if (at > step) next = smaller(next, at);
    if constexpr (controlled)
        if (record.next_tick > step) next = smaller(next, record.next_tick);
    return next;
}

// Times that stay the same between events, in shared memory: registers are scarce.
struct alignas(16) step_times {
    real dt;     // s
    real h;      // of a kick, s: half of dt at n = 0
    real share;  // of predict()
};

__device__ inline step_times times_at(const robot_record& record, int64_t step) {
    const auto dt = real(record.time_step);
    const bool half_kick = leapfrog && step == 0;
    return {dt, half_kick ? real(0.5) * dt : dt, real(half_kick ? 1 : 0.5)};
}

// The muscles' moment at a step, at rest while the body settles.
__device__ inline effects::actuation::moment<real> moment_at(const launch_arguments& launch,
                                                             const robot_record& record,
                                                             int64_t step) {
    using effects::actuation;
    if (!actuated || step < record.settle_steps) return {real(0), real(0)};
    const double* values = launch.scene.of(effects::index_of<actuation>);
    return actuation::at<real>(actuation::clock{values[0], record.ramp, record.phase_per_step},
                               step - record.settle_steps, record.time_step);
}

// The time of a step since the muscles began, s.
__device__ inline double time_of(const robot_record& record, int64_t step) {
    return double(step - record.settle_steps) * record.time_step;
}
// The inputs of scripted effects at a step.
__device__ inline scripted_moment<real> scripted_moment_at(const launch_arguments& launch,
                                                           const robot_record& record,
                                                           int64_t step) {
    return {record.origin, launch.parameters, time_of(record, step)};
}

__device__ inline int64_t sum_over_warp(int64_t value) {
    for (int distance = 16; distance > 0; distance /= 2)
        value += __shfl_xor_sync(0xffffffffu, value, distance);
    return value;
}
// Puts a thread's part of a sum into `part`, [warp].
__device__ inline void add_over_warp(int64_t value, int64_t* part) {
    value = sum_over_warp(value);
    if (threadIdx.x % 32 == 0) part[threadIdx.x / 32] = value;
}

}  // namespace limax::cuda
