// cluster.h: the blocks of a cluster, which read and write each other's shared memory (compute
// capability 9.0 and newer). With a cluster of one block no instruction is left. Includes
// portable.h only.
//   LIMAX_CLUSTER  blocks
#pragma once

#include "base/portable.h"

namespace limax::cuda {

inline constexpr int cluster_blocks = LIMAX_CLUSTER;

// Which block of its cluster this is.
__device__ inline int cluster_rank() {
    if constexpr (cluster_blocks == 1) return 0;
    unsigned rank;
    asm("mov.u32 %0, %%cluster_ctarank;" : "=r"(rank));
    return int(rank);
}

// A barrier of all threads of all blocks; what they wrote before is visible after it.
__device__ inline void meet_cluster() {
    if constexpr (cluster_blocks == 1) {
        __syncthreads();
    } else {
        asm volatile("barrier.cluster.arrive.release.aligned;" ::: "memory");
        asm volatile("barrier.cluster.wait.acquire.aligned;" ::: "memory");
    }
}

// The same object in the shared memory of block `rank`.
template <class T>
__device__ inline T& in_block(T& object, int rank) {
    if constexpr (cluster_blocks == 1) return object;
    uint64_t address;
    asm("mapa.u64 %0, %1, %2;" : "=l"(address) : "l"(&object), "r"(rank));
    return *reinterpret_cast<T*>(address);
}

}  // namespace limax::cuda
