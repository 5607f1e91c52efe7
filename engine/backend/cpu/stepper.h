// stepper.h: the interface between a robot and its integrator: a step in two halves, between which
// samples are taken. SI units.
#pragma once

#include <cstdint>

namespace limax::cpu {

template <class S>
class stepper {
public:
    virtual ~stepper() = default;
    // The part of step n before masses move. Afterwards all quantities at t_n are available, and
    // the thread's scratch is free. Steps count from the start of settling.
    virtual void begin(int64_t step) = 0;
    // The rest: the state is that of n + 1.
    virtual void finish(int64_t step) = 0;
    // All of `count` steps from n on, faster; returns false where it cannot, having done nothing.
    virtual bool whole(int64_t /*step*/, int64_t /*count*/) { return false; }
    // Velocities at t_n, [3][site] where there is a mass; approximate if step n has not
    // `begun`.
    virtual void velocity_now(int64_t step, bool begun, S* const out[3]) const = 0;
    // After the last step: frees what only steps need.
    virtual void release() {}
};

}  // namespace limax::cpu
