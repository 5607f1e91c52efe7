// driver.h: what a test can set in the fake driver and read from it.
#pragma once

#include <cstddef>

namespace limax::test {

// The answers of the fake driver, and what callers hold.
struct fake_driver {
    int version = 13000;
    int gpus = 1;
    int capability = 90;
    int capability_of_last = 0;    // where the last GPU differs from the others; else 0
    std::size_t memory = 1000000;  // bytes of its GPU
    int shared_memory_of_block = 232448;
    int allocations_left = -1;  // of a GPU's memory, until allocation fails; below 0: unlimited
    // The next call of the function of this (plain) name answers `result`; null for none.
    const char* failing = nullptr;
    int result = 0;
    // Takes the place of the kernel "limax_prepare"; null for none.
    void (*prepare)(const void* argument, unsigned blocks) = nullptr;
    // PTX and binaries that begin with these bytes do not load; null for none.
    const char* refused_image = nullptr;

    // ---- seen ----
    int contexts = 0, streams = 0, events = 0, modules = 0, host_blocks = 0;  // not released
    int calls_without_context = 0;
    std::size_t held = 0;  // bytes of its GPU
    int launches = 0;
    unsigned blocks = 0;  // of the last launch
};

}  // namespace limax::test
