// express.h: genomes to materials and weights: one thread per voxel, sums in the order of
// express_pass.h, activations in columns of which each thread has its own, so that no thread waits
// for another.
#pragma once

#include "backend/cuda/kernels/generation.h"

namespace limax::cuda {

// The function that a layer applies to the sums of its units.
enum class activation { none, hidden, cppn };

// Sums of `at_once` units for one voxel, kept in registers; input i is input[i * stride]. `unit` is
// the first of them, a multiple of `at_once`.
template <int at_once>
__device__ inline void sum_units(const float* weights, const float* biases, int32_t inputs,
                                 const float* input, int64_t stride, activation activate,
                                 int32_t unit, float* output) {
    float sum[at_once];
#pragma unroll
    for (int u = 0; u < at_once; ++u) sum[u] = biases[u];
#pragma unroll 4
    for (int32_t i = 0; i < inputs; ++i) {
        const float x = input[i * stride];
#pragma unroll
        for (int u = 0; u < at_once; ++u) sum[u] = add_input(sum[u], weights[u * inputs + i], x);
    }
#pragma unroll
    for (int u = 0; u < at_once; ++u)
        output[u * blockDim.x] = activate == activation::hidden ? hidden_unit(sum[u])
                                 : activate == activation::cppn
                                     ? cppn_unit(at_once == 1 ? unit : u, sum[u])
                                     : sum[u];
}

__device__ inline void pass_layer(const float* genes, int32_t inputs, int32_t units,
                                  const float* input, int64_t stride, activation activate,
                                  float* output) {
    constexpr int at_once = 8;
    const float* const biases = genes + int64_t(inputs) * units;
    int32_t unit = 0;
    for (; unit + at_once <= units; unit += at_once)
        sum_units<at_once>(genes + int64_t(unit) * inputs, biases + unit, inputs, input, stride,
                           activate, unit, output + unit * blockDim.x);
    for (; unit < units; ++unit)
        sum_units<1>(genes + int64_t(unit) * inputs, biases + unit, inputs, input, stride, activate,
                     unit, output + unit * blockDim.x);
}

// One voxel of one robot. `columns` is this thread's of [2][units][thread].
__device__ inline void express_voxel(const express_launch& launch, int64_t robot, int32_t voxel,
                                     float* columns) {
    const network_shape& shape = launch.shape;
    const float* genes = launch.genomes + robot * launch.genes;
    const float* input = network_inputs(shape, launch.features, genes) + voxel;
    int64_t stride = launch.voxel_count;
    float* output = columns;
    float* other = columns + int64_t(launch.units) * blockDim.x;
    const activation hidden =
        shape.law == network_law::cppn ? activation::cppn : activation::hidden;
    for (int32_t layer = 0; layer < shape.layers; ++layer) {
        pass_layer(genes, shape.width[layer], shape.width[layer + 1], input, stride,
                   layer + 1 < shape.layers ? hidden : activation::none, output);
        genes += shape.genes_of_layer(layer);
        input = output;
        stride = blockDim.x;
        output = other;
        other = const_cast<float*>(input);
    }

    int32_t chosen = 0;
    float best = input[0];
    for (int32_t material = 1; material < shape.materials; ++material) {
        const float logit = input[material * stride];
        const bool better = wins(logit, best);
        chosen = better ? material : chosen;
        best = better ? logit : best;
    }
    launch.voxels[robot * launch.voxel_count + voxel] = uint8_t(chosen);
    for (int32_t kind = 0; kind < weight_kinds; ++kind)
        launch.weights[(robot * weight_kinds + kind) * launch.voxel_count + voxel] =
            weight_unit(input[(shape.materials + kind) * stride]);
}

// This block's tiles. `columns` are its own.
__device__ inline void express_tiles(const express_launch& launch, float* columns) {
    for (int64_t tile = blockIdx.x; tile < launch.tiles; tile += gridDim.x) {
        const int32_t voxel =
            int32_t(tile % launch.tiles_of_robot) * int32_t(blockDim.x) + int32_t(threadIdx.x);
        if (voxel < launch.voxel_count)
            express_voxel(launch, tile / launch.tiles_of_robot, voxel, columns + threadIdx.x);
    }
}

}  // namespace limax::cuda

extern "C" __global__ void limax_express(
    const __grid_constant__ limax::cuda::express_launch launch) {
    extern __shared__ __align__(16) float shared_columns[];
    limax::cuda::express_tiles(launch, shared_columns);
}

// The same for networks too wide for the memory of a block.
extern "C" __global__ void limax_express_wide(
    const __grid_constant__ limax::cuda::express_launch launch) {
    limax::cuda::express_tiles(launch,
                               launch.scratch + 2ll * launch.units * blockDim.x * blockIdx.x);
}
