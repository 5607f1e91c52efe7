// device.h: the GPUs of this host as one device, and what every simulation on them shares.
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "backend/backend.h"
#include "backend/cpu/threads.h"
#include "backend/cuda/plan/block_plan.h"
#include "backend/cuda/driver/kernel.h"

namespace limax::cuda {

// One GPU with the kernels that were loaded on it.
struct gpu_place {
    explicit gpu_place(const driver& driver, int ordinal)
        : gpu(driver, ordinal), kernels(gpu, origins_of_environment()) {}

    context gpu;
    kernel_library kernels;
};

struct resident_encoding;  // residence.h

// Everything that outlives a simulation. Plans are made once per lattice, encodings sent once for
// as long as a population uses them.
class gpu_team {
public:
    explicit gpu_team(const driver& driver);

    std::vector<std::unique_ptr<gpu_place>>& places() { return places_; }
    // One thread of the host for each place.
    cpu::thread_team& threads() { return threads_; }
    std::shared_ptr<const block_plan> plan_of(const lattice& grid, int cluster);
    // On the first GPU, where populations live.
    std::shared_ptr<const resident_encoding> encoding_on_gpu(
        const std::shared_ptr<const encoding>& code);

private:
    std::vector<std::unique_ptr<gpu_place>> places_;
    cpu::thread_team threads_;
    std::mutex mutex_;
    std::map<std::array<int, 4>, std::shared_ptr<const block_plan>> plans_;
    // What they point to keeps the key alive.
    std::map<const encoding*, std::weak_ptr<const resident_encoding>> encodings_;
};

std::unique_ptr<simulation> make_simulation(simulation_setup setup, std::shared_ptr<gpu_team> team);

// `threads` and `isa` are those of the host's share of the work. Refuses (LIMAX_NO_DEVICE) where
// there is no GPU that could be used, and says why.
std::unique_ptr<device> make_cuda_device(int threads, const char* isa);

// Why there is no CUDA device here; empty where there is one.
std::string why_no_cuda_device();

}  // namespace limax::cuda
