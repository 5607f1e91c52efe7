// express_pass.h: the loop that turns one robot's genome into materials and weights, vectorised
// over voxels. Compiled once per instruction set: the including file defines LIMAX_ISA, the
// namespace of all symbols here. All give the same bits.
#pragma once

#ifndef LIMAX_ISA
#error "define LIMAX_ISA, the namespace of these passes, before including express_pass.h"
#endif

#include "genome/network.h"

namespace limax::LIMAX_ISA {

// inputs [input][voxel_tile] to sums [unit][voxel_tile]. Four inputs at a time, to keep the running
// sums in registers.
static void sum_layer(int32_t inputs, int32_t units, const float* __restrict weights,
                      const float* __restrict biases, const float* __restrict input,
                      float* __restrict sums) {
    for (int32_t unit = 0; unit < units; ++unit) {
        const float* __restrict weight = weights + int64_t(unit) * inputs;
        float* __restrict sum = sums + int64_t(unit) * voxel_tile;
        for (int32_t v = 0; v < voxel_tile; ++v) sum[v] = biases[unit];
        int32_t i = 0;
        for (; i + 4 <= inputs; i += 4) {
            const float* __restrict x = input + int64_t(i) * voxel_tile;
            const float w0 = weight[i], w1 = weight[i + 1], w2 = weight[i + 2], w3 = weight[i + 3];
            for (int32_t v = 0; v < voxel_tile; ++v) {
                float s = add_input(sum[v], w0, x[v]);
                s = add_input(s, w1, x[v + voxel_tile]);
                s = add_input(s, w2, x[v + 2 * voxel_tile]);
                sum[v] = add_input(s, w3, x[v + 3 * voxel_tile]);
            }
        }
        for (; i < inputs; ++i) {
            const float* __restrict x = input + int64_t(i) * voxel_tile;
            for (int32_t v = 0; v < voxel_tile; ++v) sum[v] = add_input(sum[v], weight[i], x[v]);
        }
    }
}

static void activate_hidden(int32_t units, float* __restrict sums) {
    for (int64_t k = 0; k < int64_t(units) * voxel_tile; ++k) sums[k] = hidden_unit(sums[k]);
}

static void activate_cppn(int32_t units, float* __restrict sums) {
    for (int32_t unit = 0; unit < units; ++unit, sums += voxel_tile) {
        // a loop for each function, so that each vectorises
        const auto activate = [&](int32_t kind) __attribute__((always_inline)) {
            for (int32_t v = 0; v < voxel_tile; ++v) sums[v] = cppn_unit(kind, sums[v]);
        };
        switch (unit & 3) {
            case 0: activate(0); break;
            case 1: activate(1); break;
            case 2: activate(2); break;
            default: activate(3);
        }
    }
}

// outputs [materials + 3][voxel_tile]: the material of each voxel and, in place, its weights.
static void choose(int32_t materials, float* __restrict outputs, uint8_t* __restrict chosen) {
    float best[voxel_tile];
    int32_t index[voxel_tile];
    for (int32_t v = 0; v < voxel_tile; ++v) {
        best[v] = outputs[v];
        index[v] = 0;
    }
    for (int32_t material = 1; material < materials; ++material) {
        const float* __restrict logit = outputs + int64_t(material) * voxel_tile;
        for (int32_t v = 0; v < voxel_tile; ++v) {
            const bool better = wins(logit[v], best[v]);
            index[v] = better ? material : index[v];
            best[v] = better ? logit[v] : best[v];
        }
    }
    for (int32_t v = 0; v < voxel_tile; ++v) chosen[v] = uint8_t(index[v]);
    float* __restrict weight = outputs + int64_t(materials) * voxel_tile;
    for (int32_t k = 0; k < weight_kinds * voxel_tile; ++k) weight[k] = weight_unit(weight[k]);
}

// An express_pass (network.h). Tile by tile; the last one is padded with zeros, so that every loop
// above has a fixed length.
static void express_robot(const network_shape& shape, const float* features, const float* genome,
                          float* scratch, uint8_t* voxels, float* weights, int32_t voxel_count) {
    const float* inputs = network_inputs(shape, features, genome);
    float* input = scratch;
    float* output = scratch + int64_t(shape.widest()) * voxel_tile;
    for (int32_t first = 0; first < voxel_count; first += voxel_tile) {
        const int32_t left = voxel_count - first;
        const int32_t filled = left < voxel_tile ? left : voxel_tile;
        for (int32_t i = 0; i < shape.width[0]; ++i) {
            const float* feature = inputs + int64_t(i) * voxel_count + first;
            float* row = input + int64_t(i) * voxel_tile;
            for (int32_t v = 0; v < filled; ++v) row[v] = feature[v];
            for (int32_t v = filled; v < voxel_tile; ++v) row[v] = 0.0f;
        }

        const float* gene = genome;
        for (int32_t layer = 0; layer < shape.layers; ++layer) {
            const int32_t width = shape.width[layer], units = shape.width[layer + 1];
            sum_layer(width, units, gene, gene + int64_t(width) * units, input, output);
            gene += shape.genes_of_layer(layer);
            if (layer + 1 < shape.layers && shape.law == network_law::cppn)
                activate_cppn(units, output);
            else if (layer + 1 < shape.layers)
                activate_hidden(units, output);
            float* const spent = input;
            input = output;
            output = spent;
        }

        uint8_t chosen[voxel_tile];
        choose(shape.materials, input, chosen);
        for (int32_t v = 0; v < filled; ++v) voxels[first + v] = chosen[v];
        for (int32_t kind = 0; kind < weight_kinds; ++kind) {
            const float* row = input + int64_t(shape.materials + kind) * voxel_tile;
            float* weight = weights + int64_t(kind) * voxel_count + first;
            for (int32_t v = 0; v < filled; ++v) weight[v] = row[v];
        }
    }
}

}  // namespace limax::LIMAX_ISA
