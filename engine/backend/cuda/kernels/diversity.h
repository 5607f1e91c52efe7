// diversity.h: how much the members of a set differ: exact sums over them, as on the host.
#pragma once

#include "backend/cuda/kernels/generation.h"

// One thread per gene.
extern "C" __global__ void __launch_bounds__(limax::cuda::genotype_threads)
    limax_genotype(const __grid_constant__ limax::cuda::diversity_launch launch) {
    using namespace limax;
    const int64_t gene = int64_t(blockIdx.x) * cuda::genotype_threads + threadIdx.x;
    if (gene >= launch.genes) return;
    const float* const column = launch.genomes + gene;
    const auto gene_of = [&](int32_t k) {
        return column[int64_t(launch.robots[k]) * launch.genes];
    };
    if (launch.scale == 0.0) {
        uint32_t largest = 0;
#pragma unroll 16
        for (int32_t k = 0; k < launch.members; ++k)
            largest = max(largest, magnitude_bits(gene_of(k)));
        launch.of_genes[gene] = largest;
        return;
    }
    gene_sums sums;
#pragma unroll 16
    for (int32_t k = 0; k < launch.members; ++k) sums.add(gene_of(k), launch.scale);
    launch.of_genes[gene] = sums.steps;
    launch.of_genes[launch.genes + gene] = sums.low;
    launch.of_genes[2 * int64_t(launch.genes) + gene] = sums.high;
}

// A block takes 32 voxels, each warp of it a share of the members.
extern "C" __global__ void __launch_bounds__(32 * limax::cuda::set_warps)
    limax_hamming(const __grid_constant__ limax::cuda::diversity_launch launch) {
    using namespace limax;
    __shared__ int32_t counts[cuda::most_materials][cuda::set_voxels];
    const int lane = int(threadIdx.x) % cuda::set_voxels;
    const int warp = int(threadIdx.x) / cuda::set_voxels;
    const int64_t voxel = int64_t(blockIdx.x) * cuda::set_voxels + lane;
    for (int m = warp; m < cuda::most_materials; m += cuda::set_warps) counts[m][lane] = 0;
    __syncthreads();
    if (voxel < launch.voxel_count) {
#pragma unroll 8
        for (int32_t k = warp; k < launch.members; k += cuda::set_warps) {
            const uint8_t material =
                launch.voxels[int64_t(launch.robots[k]) * launch.voxel_count + voxel];
            atomicAdd(&counts[material % cuda::most_materials][lane], 1);
        }
    }
    __syncthreads();
    if (warp > 0 || voxel >= launch.voxel_count) return;
    for (int m = 0; m < cuda::most_materials; ++m)
        launch.counts[voxel * cuda::most_materials + m] = counts[m][lane];
}
