// cuda_compiler.h: the compiler for kernels, where this machine has one, and whether this build
// contains compiled kernels.
#pragma once

#include <doctest/doctest.h>

#include <string>

#include "backend/cuda/driver/compiler.h"
#include "backend/cuda/driver/kernel.h"

namespace limax::test {

// Null where there is none; reports why.
inline const cuda::compiler* found_compiler() {
    std::string why;
    const cuda::compiler* nvrtc = cuda::compiler::get(&why);
    if (!nvrtc) MESSAGE("skipped: ", why);
    return nvrtc;
}

// Whether kernels were compiled ahead of time; reports the skip where none was.
inline bool has_built_kernels() {
    const bool built = !cuda::embedded_binaries().empty();
    if (!built) MESSAGE("skipped: built without kernels; set LIMAX_CUDA_ARCHITECTURES");
    return built;
}

// Whether kernels can be loaded, either built or compiled now; reports the skip where not.
inline bool kernels_available() {
    return !cuda::embedded_binaries().empty() || found_compiler() != nullptr;
}

}  // namespace limax::test
