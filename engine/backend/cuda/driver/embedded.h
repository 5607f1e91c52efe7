// embedded.h: what CMake embeds in limax: the source texts of the kernels, and the kernels compiled
// ahead of time. The definitions are generated (kernels.cmake).
#pragma once

#include <string_view>
#include <vector>

#include "backend/cuda/driver/compiler.h"

namespace limax::cuda {

// One set for one architecture.
struct embedded_binary {
    const char* set;           // "step LIMAX_EFFECTS=63 LIMAX_NX=5 ...": entry, then defines
    const char* architecture;  // "sm_90" for a binary, "compute_90" for PTX
    std::string_view bytes;
};

const std::vector<header>& embedded_headers();
// The sets of ahead_of_time.txt, whether this build compiled them for a GPU or not.
const std::vector<const char*>& embedded_sets();
const std::vector<embedded_binary>& embedded_binaries();

}  // namespace limax::cuda
