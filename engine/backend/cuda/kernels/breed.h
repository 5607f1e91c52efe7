// breed.h: initial genomes and children of two parents: one thread per gene, by the laws of
// breeding.h, which draw each gene with a counter of its own.
#pragma once

#include "backend/cuda/kernels/generation.h"

namespace limax::cuda {

// Calls visit(robot of the launch, gene) for this thread's genes: a block takes one robot's at a
// time.
template <class Visit>
__device__ inline void each_gene(int32_t count, int32_t genes, const Visit& visit) {
    const int32_t pieces = (genes - 1) / gene_threads + 1;  // of a genome
    for (int64_t at = blockIdx.x; at < int64_t(count) * pieces; at += gridDim.x) {
        const int32_t gene = int32_t(at % pieces) * gene_threads + int32_t(threadIdx.x);
        if (gene < genes) visit(int32_t(at / pieces), gene);
    }
}

}  // namespace limax::cuda

extern "C" __global__ void __launch_bounds__(limax::cuda::gene_threads)
    limax_initialize(const __grid_constant__ limax::cuda::initialize_launch launch) {
    using namespace limax;
    cuda::each_gene(launch.count, launch.genes, [&](int32_t robot, int32_t gene) {
        random_key key = launch.key;
        key.individual = uint32_t(launch.first + robot);
        launch.genomes[int64_t(robot) * launch.genes + gene] =
            initial_gene(launch.shape, launch.deviation, key, gene);
    });
}

extern "C" __global__ void __launch_bounds__(limax::cuda::gene_threads)
    limax_breed(const __grid_constant__ limax::cuda::breed_launch launch) {
    using namespace limax;
    cuda::each_gene(launch.count, launch.genes, [&](int32_t child, int32_t gene) {
        const int64_t genes = launch.genes;
        const float of_first = launch.parents[launch.pairs[2 * int64_t(child)] * genes + gene];
        float* const out = launch.genomes + child * genes + gene;
        if (launch.first + child < launch.elites) {
            *out = of_first;
            return;
        }
        random_key key = launch.key;
        key.individual = uint32_t(launch.first + child);
        const float of_second = launch.parents[launch.pairs[2 * int64_t(child) + 1] * genes + gene];
        const bool of_control = gene >= launch.genes - launch.control_genes;
        *out = child_gene(of_control ? launch.control_rates : launch.rates, key, uint32_t(gene),
                          of_first, of_second);
    });
}
