// robot.h: one robot's simulation on one thread: its memory, its steps, its samples. SI units.
#pragma once

#include <chrono>
#include <memory>

#include "backend/backend.h"
#include "backend/cpu/columns.h"
#include "backend/cpu/traces.h"
#include "physics/time_step.h"

namespace limax::cpu {

using deadline = std::chrono::steady_clock::time_point;

class robot {
public:
    virtual ~robot() = default;
    // Steps until the robot has ended, `until` has passed, an interrupt came, or `most` steps (if
    // above 0) are done. True when it has ended.
    virtual bool advance(scratch& memory, deadline until, int64_t most) = 0;
    // Puts the masses elsewhere before the first step; [mass][3] in the world, either may be null.
    // One that the scene holds takes no velocity.
    virtual void place(const double* positions, const double* velocities) = 0;
    // Positions and velocities at the current time in the world, [mass][3]; either may be null.
    virtual void state(scratch& memory, double* positions, double* velocities) = 0;
    // Writes the state of a rigid block of the scene, from 0, at the current time,
    // [LIMAX_BLOCK_STATE] as in limax.h.
    virtual void block(int32_t which, double* out) const = 0;
    // Sets a state of the controller, [voxel]; returns false if the controller sets no such state.
    virtual bool set_state(int32_t state, const double* values) = 0;
    virtual const int32_t* sites() const = 0;
    virtual int64_t samples(int32_t kind) const = 0;  // taken so far
    virtual const double* trace(int32_t kind) const = 0;
};

// Prepares robot `index` of the setup and fills its outcome, which must outlive the robot.
std::unique_ptr<robot> make_robot(const simulation_setup& setup, int32_t index,
                                  const pass_table& passes, limax_outcome& outcome);

}  // namespace limax::cpu
