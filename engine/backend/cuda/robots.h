// robots.h: the robots of one simulation that one GPU steps: their memory there, and slices of
// their runs. SI units.
#pragma once

#include <vector>

#include "backend/cuda/device.h"
#include "physics/time_step.h"

namespace limax::cuda {

class gpu_robots {
public:
    virtual ~gpu_robots() = default;

    // Builds bodies, finds time steps, and puts everything on the GPU; once, at the first need.
    virtual void prepare() = 0;
    // Steps for about `seconds`, or `steps` of each robot when above 0.
    virtual void advance(double seconds, int64_t steps) = 0;
    // The same for others at the same time: enqueue() sends a slice of about `seconds` to the GPU
    // and returns, collect() waits for it. Each enqueue() is followed by one collect().
    virtual void enqueue(double seconds) = 0;
    virtual void collect() = 0;
    // Every robot has ended.
    virtual bool finished() const = 0;

    // `robot` is an index into the setup; its GPU must have been prepared.
    virtual int64_t samples(int32_t robot, int32_t kind) const = 0;
    virtual const double* trace(int32_t robot, int32_t kind) = 0;  // [sample][width]
    virtual const int32_t* sites(int32_t robot) = 0;               // [mass]
    virtual void place(int32_t robot, const double* positions, const double* velocities) = 0;
    virtual void state(int32_t robot, double* positions, double* velocities) = 0;
    // JSON object: the kernel that steps them, where it came from, what it takes.
    virtual std::string describe() = 0;
};

// `robots` are indices into the setup; their outcomes are written as they run.
std::unique_ptr<gpu_robots> make_robots(const simulation_setup& setup, std::vector<int32_t> robots,
                                        std::shared_ptr<gpu_team> team, gpu_place& place,
                                        limax_outcome* outcomes);

}  // namespace limax::cuda
