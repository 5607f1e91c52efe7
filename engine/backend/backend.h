// backend.h: the interface of a device: express, breed, simulate. A device applies laws to
// elements; the laws themselves are in genome/ and physics/.
#pragma once

#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "base/array.h"
#include "base/parallel.h"
#include "body/lattice.h"
#include "genome/device_population.h"
#include "genome/encoding.h"
#include "genome/network.h"
#include "limax.h"
#include "physics/scene.h"
#include "physics/summary.h"

namespace limax {

// Everything that a simulation needs, copied, so that it outlives what it was made from.
struct simulation_setup {
    limax_simulation_options options;
    limax::scene scene;
    std::vector<limax_material> materials;
    lattice grid;
    int32_t count = 0;  // robots
    // Bodies on the device that simulates them; null where only the host has them.
    std::shared_ptr<const device_bodies> bodies_on_device;
    mutable array<uint8_t> voxels;   // [robot][voxel]; these two are empty until fetch_bodies()
    mutable array<float> weights;    // [robot][3][voxel]      where bodies are on a device
    std::vector<limax_body> bodies;  // [robot]
    std::vector<float> control;      // genes of control, [robot][control_genes]
    int32_t control_genes = 0;
    std::vector<uint8_t> mask;  // robots to simulate, [robot]

    // Largest relative change of rest length of a muscle.
    double amplitude() const {
        double most = 0;
        for (const limax_material& each : materials)
            if (each.kind >= LIMAX_EXPANDING && each.amplitude > most) most = each.amplitude;
        return most;
    }

    // What the noise of a robot's sensors begins with: of its body, its genes and the scene's seed.
    uint64_t noise_seed(int32_t robot) const;

    // Makes sure that the host has voxels and weights. From any thread.
    void fetch_bodies() const {
        static std::mutex mutex;
        const std::lock_guard lock(mutex);
        if (!bodies_on_device || voxels.size() > 0) return;
        const auto size = std::size_t(grid.voxels()) * std::size_t(count);
        array<uint8_t> materials_of(size);
        weights = array<float>(weight_kinds * size);
        bodies_on_device->fetch(materials_of.data(), weights.data());
        voxels = std::move(materials_of);
    }
};

// Refuses options outside their ranges, naming the field, and what the scene does not allow.
void check_options(const limax_simulation_options& options, const scene& scene);
// Refuses what only the CPU supports.
void check_beyond_cpu(const limax_simulation_options& options);

// Fills the outcome of robot `index` before it is prepared: skipped, invalid or running.
void start_outcome(const simulation_setup& setup, int32_t index, limax_outcome& outcome);

// Refuses the number of a block, from 0, that the scene does not have.
void require_block(const scene& scene, int32_t which);

void keep_summary(const trace_summary& summary, limax_outcome& outcome);

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
    // Writes the state of a rigid block of a robot, from 0, [LIMAX_BLOCK_STATE]; refuses one that
    // the scene does not have.
    virtual void block(int32_t robot, int32_t which, double* out) = 0;
    // Sets a state of a robot's controller, [voxel]; refuses a device that cannot, and a controller
    // that sets no such state.
    virtual void set_state(int32_t robot, int32_t state, const double* values);
    // The same for several simulations at once: enqueue() may send about `seconds` of work to a
    // device and return at once, unless it did so before; collect() waits for it and returns the
    // progress. Every other function waits too. Here all is done in collect().
    virtual void enqueue(double seconds) { enqueued_seconds_ = seconds; }
    virtual limax_progress collect() { return advance(enqueued_seconds_, 0); }
    // JSON object: what its steps run on. Alive until the next call.
    virtual const char* describe() = 0;

private:
    double enqueued_seconds_ = 0;
};

class device {
public:
    virtual ~device() = default;
    virtual const char* describe() const = 0;  // JSON
    virtual const parallel_for& each() const = 0;
    virtual express_pass express() const = 0;
    virtual std::unique_ptr<simulation> simulate(simulation_setup setup) = 0;

    // Device memory for a population of `count` robots; null where populations stay on the host:
    // always on the CPU, and on a GPU without enough free memory.
    virtual std::shared_ptr<device_population> make_population(
        const std::shared_ptr<const encoding>& /*code*/, int32_t /*count*/) {
        return nullptr;
    }
    // Whether this device holds it.
    virtual bool stores(const device_population& /*stored*/) const { return false; }
};

// `isa` null or empty: the best passes that this processor runs. Raises LIMAX_NO_DEVICE where the
// device is unavailable.
std::unique_ptr<device> make_device(const std::string& name, int threads, const char* isa);

// Memory that arrays hold on this machine and on its GPUs, bytes.
uint64_t all_bytes_held();

// The stop flag behind limax_interrupt(). Setting it is safe in a signal handler.
bool interrupted();
void set_interrupted(bool stop);

}  // namespace limax
