// network.h: the shape of the network whose weights a genome holds, and the layout of the genes.
// Laws; includes only base/.
//
// Layers of weights from the encoding's features to materials + 3 outputs. The genome holds, layer
// by layer, the weights [unit][input] and then the biases [unit]. Hidden units pass through tanh,
// or in a CPPN through one of four functions. Of the outputs the first `materials` are the logits
// of the softmax, the other three pass through the logistic function: stiffness, amplitude, phase.
// Without layers a direct genome is the outputs of every voxel, [output][voxel].
#pragma once

#include "base/math.h"
#include "base/portable.h"

namespace limax {

inline constexpr int32_t most_hidden_layers = 8;
inline constexpr int32_t weight_kinds = 3;  // stiffness, amplitude, phase

// The meaning of the genes, in the order of limax_network.
enum class network_law : int32_t { fourier, cppn, direct, none };

struct network_shape {
    int32_t layers;                         // of weights: hidden layers + 1; 0 for direct and none
    int32_t width[most_hidden_layers + 2];  // features, hidden widths, materials + 3
    int32_t materials;
    network_law law;
    int32_t free_genes;  // that belong to no layer

    LIMAX_LAW constexpr int32_t genes_of_layer(int32_t layer) const {
        return (width[layer] + 1) * width[layer + 1];
    }
    LIMAX_LAW constexpr int32_t genes() const {
        int32_t sum = free_genes;
        for (int32_t layer = 0; layer < layers; ++layer) sum += genes_of_layer(layer);
        return sum;
    }
    LIMAX_LAW constexpr int32_t widest() const {
        int32_t most = 0;
        for (int32_t layer = 0; layer <= layers; ++layer)
            most = width[layer] > most ? width[layer] : most;
        return most;
    }
};

// Every sum of a unit starts at its bias and takes its inputs in ascending order, one rounding
// each.
LIMAX_LAW float add_input(float sum, float weight, float input) { return fma(weight, input, sum); }

LIMAX_LAW float hidden_unit(float sum) { return hyperbolic_tangent(sum); }

// Hidden unit k of a layer of a CPPN (compositional pattern producing network; K. Stanley, Genetic
// Programming and Evolvable Machines 8, 2007) is, by k mod 4, a sine of half a period for a sum of
// 1, a Gaussian, tanh or the absolute value.
LIMAX_LAW float cppn_unit(int32_t unit, float sum) {
    const int32_t kind = unit & 3;
    return kind == 0   ? sine_turns(0.5f * sum)
           : kind == 1 ? exponential(-(sum * sum))
           : kind == 2 ? hyperbolic_tangent(sum)
                       : absolute(sum);
}

// A weight in [0, 1], also where the sum is not a number: then 0.
LIMAX_LAW float weight_unit(float sum) { return larger(logistic(sum), 0.0f); }

// The softmax is monotonic, so its largest class is that of the largest logit and no exponential is
// needed. A later material wins only if its logit is larger: ties go to the lower index, and a
// logit that is not a number never wins.
LIMAX_LAW bool wins(float logit, float best) { return logit > best; }

// Voxels that go through the network together: a multiple of every vector width, small enough for a
// core's first cache.
inline constexpr int32_t voxel_tile = 128;

// Floats of scratch that expressing one robot needs: the inputs and the outputs of a layer for one
// tile.
LIMAX_LAW constexpr int64_t express_scratch(const network_shape& shape) {
    return int64_t(2) * shape.widest() * voxel_tile;
}

// The inputs of the first layer, [input][voxel].
LIMAX_LAW const float* network_inputs(const network_shape& shape, const float* features,
                                      const float* genome) {
    return shape.law == network_law::direct ? genome : features;
}

// One robot: features [feature][voxel], genome [gene], voxels [voxel], weights [3][voxel].
// `scratch` is aligned to 64 bytes and holds express_scratch(shape) floats.
using express_pass = void (*)(const network_shape& shape, const float* features,
                              const float* genome, float* scratch, uint8_t* voxels, float* weights,
                              int32_t voxel_count);

}  // namespace limax
