// embedded.h: what CMake puts into limax: the texts that kernels are compiled from, and the kernels
// that it compiled. Its source is generated (kernels.cmake).
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
const std::vector<embedded_binary>& embedded_binaries();

}  // namespace limax::cuda
