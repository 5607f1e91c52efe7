// stepper.h: what a robot asks of its integrator: the order of a step, cut in two where samples are
// taken. SI units.
#pragma once

#include <cstdint>

namespace limax::cpu {

template <class S>
class stepper {
public:
    virtual ~stepper() = default;
    // What comes of step n before masses move. Afterwards all that is known about t_n is at hand,
    // and the thread's scratch is free. Steps count from the start of settling.
    virtual void begin(int64_t step) = 0;
    // The rest: the state is that of n + 1.
    virtual void finish(int64_t step) = 0;
    // Velocities at t_n, [3][site] where there is a mass; as good as they are known where step n
    // has not `begun`.
    virtual void velocity_now(int64_t step, bool begun, S* const out[3]) const = 0;
    // There is no next step: frees what only steps need.
    virtual void release() {}
};

}  // namespace limax::cpu
