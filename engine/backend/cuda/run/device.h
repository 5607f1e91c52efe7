// device.h: the GPUs of this host as one device, and what every simulation on them shares.
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "backend/backend.h"
#include "backend/cuda/driver/kernel.h"
#include "backend/cuda/plan/block_plan.h"
#include "base/threads.h"

namespace limax::cuda {

struct device_encoding;  // population.h

// Everything that outlives a simulation. An encoding is uploaded once and stays as long as a
// population uses it.
class gpu_team {
public:
    explicit gpu_team(const driver& driver);

    std::vector<std::unique_ptr<gpu_place>>& places() { return places_; }
    // One thread of the host for each place.
    thread_team& threads() { return threads_; }
    block_plans& plans() { return plans_; }
    // On the first GPU, which stores the populations.
    std::shared_ptr<const device_encoding> encoding_on_gpu(
        const std::shared_ptr<const encoding>& code);
    // Seconds that one step of about so many robots on a lattice took last; 0 if none was made.
    double step_time(const lattice& grid, std::size_t robots);
    void note_step_time(const lattice& grid, std::size_t robots, double seconds);

private:
    double& last_step_time(const lattice& grid, std::size_t robots);

    std::vector<std::unique_ptr<gpu_place>> places_;
    thread_team threads_;
    block_plans plans_;
    std::mutex mutex_;
    // The encoding that an entry points to keeps its key alive.
    std::map<const encoding*, std::weak_ptr<const device_encoding>> encodings_;
    std::map<std::pair<int64_t, int>, double> step_times_;  // [sites, magnitude of the robots]
};

std::unique_ptr<simulation> make_simulation(simulation_setup setup, std::shared_ptr<gpu_team> team);

// `threads` and `isa` are those of the host's share of the work. Fails with
// LIMAX_NO_DEVICE and the reason if there is no usable GPU.
std::unique_ptr<device> make_cuda_device(int threads, const char* isa);

// The reason why there is no CUDA device; empty if there is one.
std::string why_no_cuda_device();

}  // namespace limax::cuda
