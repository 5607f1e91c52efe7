// robot_sums.h: the barrier of the blocks that share a robot, and their sums over its masses. The
// blocks must all be on the GPU at once. SI units.
#pragma once

#include "backend/cuda/kernels/run.h"

namespace limax::cuda {

// A number that another block writes after everything that it wrote before.
__device__ inline unsigned load_acquire(const unsigned* at) {
    unsigned value;
#if defined(__CUDA_ARCH__)
    asm volatile("ld.acquire.gpu.u32 %0, [%1];" : "=r"(value) : "l"(at) : "memory");
#else
    pause_thread();
    value = *at;
#endif
    return value;
}

// A barrier of all blocks of the robot; what they wrote before is visible after it.
__device__ inline void meet(unsigned* arrived, int blocks) {
    __syncthreads();
    if (blocks == 1) return;
    if (threadIdx.x == 0) {
        __threadfence();
        const unsigned before = atomicAdd(arrived, 1u);
        const unsigned goal = (before / blocks + 1) * blocks;
        while (load_acquire(arrived) < goal) {
        }
    }
    __syncthreads();
}

// Adds up shared.part of all blocks of a robot in shared.sum_of. `sets` are sum_sets sets of sums
// that start at 0; `event` counts the calls of a launch.
template <class Memory>
__device__ inline void add_over_blocks(Memory& shared, unsigned long long* sets, unsigned* arrived,
                                       int blocks, bool leads, int& event) {
    const int thread = threadIdx.x;
    __syncthreads();
    unsigned long long* const sums = sets + event % sum_sets * grid_sums;
    // the last one, which all blocks have read when they arrive, starts again at 0; the next is in
    // use as soon as they left
    unsigned long long* const last = sets + (event + sum_sets - 1) % sum_sets * grid_sums;
    ++event;
    if (thread < grid_sums) {
        int64_t sum = 0;
        for (const int64_t part : shared.part[thread]) sum += part;
        atomicAdd(sums + thread, static_cast<unsigned long long>(sum));
    }
    meet(arrived, blocks);
    if (thread < grid_sums) {
        shared.sum_of[thread] = static_cast<int64_t>(__ldcg(sums + thread));
        if (leads) last[thread] = 0;
    }
    __syncthreads();
}

}  // namespace limax::cuda
