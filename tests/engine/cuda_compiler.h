// cuda_compiler.h: the compiler for kernels, where this machine has one.
#pragma once

#include <doctest/doctest.h>

#include <string>

#include "backend/cuda/driver/compiler.h"

namespace limax::test {

// Null where there is none, and then says why.
inline const cuda::compiler* found_compiler() {
    std::string why;
    const cuda::compiler* nvrtc = cuda::compiler::get(&why);
    if (!nvrtc) MESSAGE("skipped: ", why);
    return nvrtc;
}

}  // namespace limax::test
