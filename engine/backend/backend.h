// backend.h: what a device must do: express, breed, simulate. It decides which law meets which
// element, and holds no law.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "base/array.h"
#include "base/parallel.h"
#include "body/lattice.h"
#include "genome/network.h"
#include "limax.h"
#include "physics/scene.h"

namespace limax {

// Everything that a simulation needs, copied, so that it outlives what it was made from.
struct simulation_setup {
    limax_simulation_options options;
    limax::scene scene;
    std::vector<limax_material> materials;
    lattice grid;
    int32_t count = 0;               // robots
    array<uint8_t> voxels;           // [robot][voxel]
    array<float> weights;            // [robot][3][voxel]
    std::vector<limax_body> bodies;  // [robot]
    std::vector<uint8_t> mask;       // robots to simulate, [robot]
};

// Refuses options outside their ranges, naming the field.
void check_options(const limax_simulation_options& options, const scene& scene);

// What becomes known of robot `index` before it is prepared: skipped, invalid or running.
void start_outcome(const simulation_setup& setup, int32_t index, limax_outcome& outcome);

class simulation {
public:
    virtual ~simulation() = default;
    // Whole steps for about `seconds`, or at most `steps` of each robot when above 0.
    virtual limax_progress advance(double seconds, int64_t steps) = 0;
    virtual const limax_outcome* outcomes() const = 0;  // [robot]
    virtual void trace(int32_t robot, int32_t kind, const double** data, int64_t* samples,
                       int64_t* width) const = 0;
    virtual const int32_t* sites(
        int32_t robot) const = 0;  // [mass]; null for a robot that was not prepared
    // Before the first step, [mass][3]; either may be null.
    virtual void place(int32_t robot, const double* positions, const double* velocities) = 0;
    virtual void state(int32_t robot, double* positions, double* velocities) = 0;  // [mass][3]
    // JSON object: what its steps run on. Alive until the next call.
    virtual const char* describe() = 0;
};

class device {
public:
    virtual ~device() = default;
    virtual const char* describe() const = 0;  // JSON
    virtual const parallel_for& each() const = 0;
    virtual express_pass express() const = 0;
    virtual std::unique_ptr<simulation> simulate(simulation_setup setup) = 0;
};

// `isa` null or empty: the best passes that this processor runs. Refuses a device that is not to
// be had.
std::unique_ptr<device> make_device(const std::string& name, int threads, const char* isa);

// The stop flag behind limax_interrupt(). Setting it is safe in a signal handler.
bool interrupted();
void set_interrupted(bool stop);

}  // namespace limax
