// robots.h: the robots of one simulation that one GPU steps at a time: their memory there, and
// slices of their runs. SI units.
#pragma once

#include <vector>

#include "backend/cuda/run/device.h"
#include "physics/time_step.h"

namespace limax::cuda {

class gpu_robots {
public:
    virtual ~gpu_robots() = default;

    // Makes sure that the robots are on the GPU: at the first time makes their springs and finds
    // their time steps. Throws LIMAX_OUT_OF_MEMORY if they do not fit.
    virtual void wake() = 0;
    // Frees the GPU's memory and keeps everything that wake() needs to continue bit for bit.
    virtual void sleep() = 0;
    // Steps for about `seconds`, or `steps` of each robot when above 0.
    virtual void advance(double seconds, int64_t steps) = 0;
    // The same for others at the same time: enqueue() sends a slice of about `seconds` to the GPU
    // and returns, collect() waits for it. Nothing else is called in between.
    virtual void enqueue(double seconds) = 0;
    virtual void collect() = 0;
    // Every robot has ended.
    virtual bool finished() const = 0;

    // `robot` is an index into the setup.
    virtual int64_t samples(int32_t robot, int32_t kind) const = 0;
    virtual const double* trace(int32_t robot, int32_t kind) = 0;  // [sample][width]
    virtual const int32_t* sites(int32_t robot) = 0;               // [mass]
    virtual void place(int32_t robot, const double* positions, const double* velocities) = 0;
    virtual void state(int32_t robot, double* positions, double* velocities) = 0;
    virtual void block(int32_t robot, int32_t which, double* out) = 0;  // [LIMAX_BLOCK_STATE]
    // JSON object: the kernel that steps them, where it came from, what it takes.
    virtual std::string describe() = 0;
};

// `robots` are indices into the setup; their outcomes are written as they run. They are all on the
// GPU at once or not at all.
std::unique_ptr<gpu_robots> make_robots(const simulation_setup& setup, std::vector<int32_t> robots,
                                        std::shared_ptr<gpu_team> team, gpu_place& place,
                                        limax_outcome* outcomes);

}  // namespace limax::cuda
