// loop.h: the run of one robot: the loop over its steps, shared by the block path (step.h) and the
// grid path (grid.h). A path is a struct with one function for each phase below. SI units.
#pragma once

#include "backend/cuda/kernels/run.h"
#include "backend/cuda/kernels/solid.h"

namespace limax::cuda {

// Laws on faces or a solid need the velocities of all masses after the kick.
inline constexpr bool kicks_apart = has_faces || has_solid;

// Where a run is. An event is a step at which more is due than the step. Steps since the last
// event, at record.step, and up to the next: 0 where the launch ends after the kick.
struct loop_state {
    int since_event, until_event;

    __device__ bool last() const { return until_event == 0; }
};
// The muscles' moment of a step.
template <class Memory>
__device__ inline effects::actuation::moment<real> moment_of(const Memory& shared,
                                                             const loop_state& now) {
    if constexpr (controlled)
        return {shared.control.since_tick + real(now.since_event), real(0)};
    else
        return shared.moments[now.since_event];
}
// Copies the robot's record to shared memory. Returns whether this launch has anything to do.
template <class Robot>
__device__ inline bool begin_launch(Robot& robot) {
    auto& shared = robot.shared;
    copy_record(shared.record, robot.launch.records[robot.index()], threadIdx.x, LIMAX_THREADS);
    __syncthreads();
    if (threadIdx.x == 0) shared.stop = stop_of(robot.launch, shared.record);
    __syncthreads();
    return !shared.record.begun || shared.stop > shared.record.step;
}

// The muscles' moments of the steps up to the next event.
template <class Robot>
__device__ inline void prepare_steps(Robot& robot, int64_t step, int steps) {
    auto& shared = robot.shared;
    if constexpr (controlled) {
        if (threadIdx.x == 0)
            shared.control.since_tick = real(steps_since_tick(shared.record, step));
    } else if constexpr (actuated)
        for (int i = threadIdx.x; i < steps; i += LIMAX_THREADS)
            shared.moments[i] = moment_at(robot.launch, shared.record, step + i);
}

// Adds the masses of a thread to the parts of the centre of mass. One axis at a time: registers
// are scarce here.
template <class Robot>
__device__ inline void add_center(Robot& robot) {
    const double of_total = 1.0 / robot.shared.record.total_mass;
#pragma unroll 1
    for (int axis = 0; axis < 3; ++axis) {
        int64_t words[2] = {};
        robot.each_mass([&](int k) {
            const real* x = robot.mass[k].position;
            add_to_center(words, double(robot.mass[k].mass) * of_total,
                          double(axis == 0   ? x[0]
                                 : axis == 1 ? x[1]
                                             : x[2]));
        });
        for (int word = 0; word < 2; ++word)
            add_over_warp(words[word], robot.shared.part[sum_center + 2 * axis + word]);
    }
}

// Everything that is due at `step` beside the step. Returns false when the robot has diverged.
template <class Robot>
__device__ inline bool take_event(Robot& robot, int64_t step, loop_state& now) {
    auto& shared = robot.shared;
    robot_record& record = shared.record;
    if constexpr (has_motion)
        move_contacts(robot.params, robot.launch.scene, record.origin, time_of(record, step));
    if (!robot.check_limits(step)) return false;
    if (center_wanted(record, step)) robot.take_center(step);
    if constexpr (touchable)
        if (step == record.next_sample[sample_contact]) robot.take_contact();
    if constexpr (has_solid)
        if (robot.leads())
            for (int b = 0; b < solids; ++b)
                note_solid(robot.solid().records[b], b, record, step, shared.shift,
                           step % check_interval == 0 && shared.moved, robot.launch.solids.samples);
    if constexpr (controlled)
        if (tick_due(record, step) && !robot.take_tick(step)) {
            if (threadIdx.x == 0) note_wild_control(record, step);
            return false;
        }
    __syncthreads();
    if (threadIdx.x == 0) record.step = step;
    if (threadIdx.x == 0) shared.times = times_at(record, step);
    now.since_event = 0;
    now.until_event = steps_to_event(record, step, shared.stop, [&] { return robot.solid(); });
    prepare_steps(robot, step, now.last() ? 1 : now.until_event);
    if (now.last()) robot.store_masses();
    robot.wait();
    return true;
}

// Forces, and everything that acts on masses, up to the positions of the next step.
template <class Robot>
__device__ inline void take_step(Robot& robot, const loop_state& now) {
    robot.kick_masses(now);
    if constexpr (has_faces) robot.push_faces(now);
    if constexpr (has_solid) robot.step_solids(now);
    if constexpr (kicks_apart) robot.end_masses(now);
}

// Runs one robot up to the end of the launch.
template <class Robot>
__device__ inline void run_robot(Robot& robot) {
    robot_record& record = robot.shared.record;
    if (!begin_launch(robot)) {
        robot.store_record();
        return;
    }
    follow_origin(robot.params, robot.launch.scene, record.origin, time_of(record, record.step));
    if constexpr (has_solid)
        if (robot.leads())
            begin_solids(robot.solid(), record.begun, record.time_step,
                         record.step == 0 ? 1.0 : 0.5);
    loop_state now{record.begun, record.begun};
    robot.begin_masses();
    while (true) {
        if (controlled || now.since_event == now.until_event)
            if (!take_event(robot, record.step + now.since_event, now)) {
                robot.store_masses();
                break;
            }
        // With a controller the steps up to the next event are a loop of their own: what a tick
        // needs registers for is spilled outside of it.
        do {
            take_step(robot, now);
            if (now.last()) break;
            ++now.since_event;
            robot.begin_step(record.step + now.since_event);
        } while (controlled && now.since_event < now.until_event);
        if (now.last()) {
            if (threadIdx.x == 0) {
                record.begun = 1;
                if (record.step == record.steps) record.status = robot_done;
            }
            robot.store_kick();
            break;
        }
    }
    robot.store_record();
}

}  // namespace limax::cuda
