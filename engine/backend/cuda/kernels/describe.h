// describe.h: voxels to bodies: keeps the largest component, if asked to, empties the rest, and
// counts what is left. One block per robot. Integers only, so results do not depend on the order of
// threads.
//
// Components are sets of voxels linked to a lower one of the set (M. Jaiganesh, M. Burtscher, "A
// high-performance connected components implementation for GPUs", HPDC 2018): the lowest is the
// root.
#pragma once

#include "backend/cuda/kernels/generation.h"
#include "body/body_laws.h"

namespace limax::cuda {

struct describe_memory {
    unsigned long long largest;  // voxels of a component << 32 | ~root
    int32_t counts[most_materials];
    int32_t lowest[3], highest[3];
    int32_t masses, springs;
    uint64_t hash;
};

// While sets are joined, every read of a link is an atomic operation, as every change is.
__device__ inline int32_t link_of(int32_t* link, int32_t voxel) {
    return atomicOr(link + voxel, 0);
}

// The root of a voxel's set, for now. Links passed on the way are shortened: a link only ever gets
// lower and leads to a voxel that is, or is about to be, of the same set.
__device__ inline int32_t root_of(int32_t* link, int32_t voxel) {
    int32_t before = voxel, at = link_of(link, voxel);
    if (at == voxel) return at;
    for (int32_t next = link_of(link, at); next < at; next = link_of(link, at)) {
        atomicMin(link + before, next);
        before = at;
        at = next;
    }
    return at;
}

__device__ inline void join_sets(int32_t* link, int32_t one, int32_t other) {
    while (true) {
        one = root_of(link, one);
        other = root_of(link, other);
        if (one == other) return;
        const int32_t high = larger(one, other), low = smaller(one, other);
        const int32_t found = atomicMin(link + high, low);
        if (found == high) return;
        // another thread linked `high` first: all three are one set
        one = found;
        other = low;
    }
}

__device__ inline void begin(const describe_launch& launch, describe_memory& memory) {
    const int thread = threadIdx.x;
    if (thread < most_materials) memory.counts[thread] = 0;
    if (thread == 0) memory.masses = memory.springs = 0, memory.largest = 0;
    const int32_t size[3] = {launch.grid.nx, launch.grid.ny, launch.grid.nz};
#pragma unroll
    for (int axis = 0; axis < 3; ++axis)
        if (thread == axis) memory.lowest[axis] = size[axis], memory.highest[axis] = -1;
}

// `link` and `sizes` hold a number for each voxel. Holds barriers.
__device__ inline void keep_largest_component(const lattice& grid, uint8_t* voxels, int32_t* link,
                                              int32_t* sizes, describe_memory& memory) {
    const int32_t count = int32_t(grid.voxels()), row = grid.nx, layer = grid.nx * grid.ny;
    // for each voxel the neighbours below it, each visited with its index
    const auto each_lower = [&](int32_t voxel, const auto& visit) {
        if (voxel % row > 0 && voxels[voxel - 1] != 0) visit(voxel - 1);
        if (voxel % layer >= row && voxels[voxel - row] != 0) visit(voxel - row);
        if (voxel >= layer && voxels[voxel - layer] != 0) visit(voxel - layer);
    };
    for (int32_t voxel = threadIdx.x; voxel < count; voxel += blockDim.x) {
        int32_t start = voxel;
        if (voxels[voxel] != 0)
            each_lower(voxel, [&](int32_t lower) { start = smaller(start, lower); });
        link[voxel] = start;
        sizes[voxel] = 0;
    }
    __syncthreads();
    for (int32_t voxel = threadIdx.x; voxel < count; voxel += blockDim.x)
        if (voxels[voxel] != 0)
            each_lower(voxel, [&](int32_t lower) { join_sets(link, voxel, lower); });
    __syncthreads();
    for (int32_t voxel = threadIdx.x; voxel < count; voxel += blockDim.x)
        if (voxels[voxel] != 0) {
            const int32_t root = root_of(link, voxel);
            atomicMin(link + voxel, root);
            atomicAdd(sizes + root, 1);
        }
    __syncthreads();
    // of equally large ones the lowest root wins
    for (int32_t voxel = threadIdx.x; voxel < count; voxel += blockDim.x) {
        if (sizes[voxel] > 0)
            atomicMax(&memory.largest,
                      static_cast<unsigned long long>(sizes[voxel]) << 32 | uint32_t(~voxel));
    }
    __syncthreads();
    const int32_t kept = int32_t(~uint32_t(memory.largest));
    for (int32_t voxel = threadIdx.x; voxel < count; voxel += blockDim.x)
        if (voxels[voxel] != 0 && link[voxel] != kept) voxels[voxel] = 0;
    __syncthreads();
}

// By one whole warp.
__device__ inline uint64_t hash_of_body(const lattice& grid, const uint8_t* voxels) {
    const int64_t count = grid.voxels();
    uint64_t hash = hash_of_lattice(grid);
    for (int64_t first = 0; first < count; first += 32 * voxels_per_turn) {
        unsigned long long eight = 0;
        for (int k = 0; k < voxels_per_turn; ++k) {
            const int64_t at = first + voxels_per_turn * int(threadIdx.x) + k;
            if (at < count) eight |= static_cast<unsigned long long>(voxels[at]) << (8 * k);
        }
        const int64_t turns = smaller((count - first - 1) / voxels_per_turn + 1, int64_t(32));
        for (int turn = 0; turn < turns; ++turn)
            hash = hash_with(hash, __shfl_sync(0xffffffffu, eight, turn));
    }
    return hash;
}

// Which of the voxels around a site are there, as the bits of owners_around().
__device__ inline int voxels_around(const lattice& grid, const uint8_t* voxels, int64_t site) {
    const int x = int(site % (grid.nx + 1));
    const int64_t row = site / (grid.nx + 1);
    const int y = int(row % (grid.ny + 1)), z = int(row / (grid.ny + 1));
    int around = 0;
#pragma unroll
    for (int bit = 0; bit < 8; ++bit) {
        const int i = x - 1 + (bit & 1), j = y - 1 + (bit >> 1 & 1), k = z - 1 + (bit >> 2);
        if (i >= 0 && j >= 0 && k >= 0 && i < grid.nx && j < grid.ny && k < grid.nz &&
            voxels[grid.voxel(i, j, k)] != 0)
            around |= 1 << bit;
    }
    return around;
}

__device__ inline void count_voxels(const lattice& grid, const uint8_t* voxels,
                                    describe_memory& memory) {
    int32_t lowest[3] = {grid.nx, grid.ny, grid.nz}, highest[3] = {-1, -1, -1};
    for (int32_t voxel = threadIdx.x; voxel < grid.voxels(); voxel += blockDim.x) {
        const int material = voxels[voxel];
        atomicAdd(memory.counts + material, 1);
        if (material == 0) continue;
        const int32_t row = voxel / grid.nx;
        const int32_t at[3] = {voxel % grid.nx, row % grid.ny, row / grid.ny};
#pragma unroll
        for (int axis = 0; axis < 3; ++axis) {
            lowest[axis] = smaller(lowest[axis], at[axis]);
            highest[axis] = larger(highest[axis], at[axis]);
        }
    }
#pragma unroll
    for (int axis = 0; axis < 3; ++axis)
        if (highest[axis] >= 0) {
            atomicMin(memory.lowest + axis, lowest[axis]);
            atomicMax(memory.highest + axis, highest[axis]);
        }
}

__device__ inline void count_springs(const lattice& grid, const uint8_t* voxels,
                                     describe_memory& memory) {
    int32_t masses = 0, springs = 0;
    for (int64_t site = threadIdx.x; site < grid.sites(); site += blockDim.x) {
        const int around = voxels_around(grid, voxels, site);
        masses += around != 0;
#pragma unroll
        for (int d = 0; d < direction_count; ++d)
            springs += (around & owners_around(direction_at(d))) != 0;
    }
    if (masses > 0) atomicAdd(&memory.masses, masses);
    if (springs > 0) atomicAdd(&memory.springs, springs);
}

// This block's robots. `numbers` [2][voxel] are its own.
__device__ inline void describe_robots(const describe_launch& launch, int32_t* numbers) {
    __shared__ describe_memory memory;
    const lattice& grid = launch.grid;
    const int64_t count = grid.voxels();
    for (int64_t robot = blockIdx.x; robot < launch.count; robot += gridDim.x) {
        uint8_t* const voxels = launch.voxels + robot * count;
        begin(launch, memory);
        __syncthreads();
        if (launch.largest_part)
            keep_largest_component(grid, voxels, numbers, numbers + count, memory);
        if (threadIdx.x < 32) {
            const uint64_t hash = hash_of_body(grid, voxels);
            if (threadIdx.x == 0) memory.hash = hash;
        }
        count_voxels(grid, voxels, memory);
        count_springs(grid, voxels, memory);
        __syncthreads();
        if (threadIdx.x == 0) {
            body_record body{};
            body.voxels = int32_t(count) - memory.counts[0];
            for (int m = 0; m < most_materials; ++m) body.counts[m] = memory.counts[m];
            body.masses = memory.masses;
            body.springs = memory.springs;
            for (int axis = 0; axis < 3; ++axis)
                body.size[axis] =
                    body.voxels > 0 ? memory.highest[axis] - memory.lowest[axis] + 1 : 0;
            body.hash = memory.hash;
            launch.bodies[robot] = body;
        }
        __syncthreads();
    }
}

}  // namespace limax::cuda

extern "C" __global__ void limax_describe(
    const __grid_constant__ limax::cuda::describe_launch launch) {
    extern __shared__ __align__(16) int shared_numbers[];
    limax::cuda::describe_robots(launch, shared_numbers);
}

// The same for lattices too large for the memory of a block.
extern "C" __global__ void limax_describe_large(
    const __grid_constant__ limax::cuda::describe_launch launch) {
    limax::cuda::describe_robots(launch, launch.scratch + 2 * launch.grid.voxels() * blockIdx.x);
}
