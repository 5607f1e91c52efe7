// device.h: the CPU as a device.
#pragma once

#include "backend/backend.h"
#include "backend/cpu/passes.h"
#include "base/threads.h"

namespace limax::cpu {

std::unique_ptr<simulation> make_simulation(simulation_setup setup, const pass_table& passes,
                                            std::shared_ptr<thread_team> team);

// `threads` 0: one per core that this process may use. `why_not_cuda` is the reason in its
// description for not using CUDA.
std::unique_ptr<device> make_cpu_device(int threads, const char* isa,
                                        const std::string& why_not_cuda = "");

}  // namespace limax::cpu
