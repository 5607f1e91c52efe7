// network.h: the shape of the network whose weights a genome holds, and the layout of the genes.
// Laws; includes only base/.
//
// Layers of weights from the encoding's features to materials + 3 outputs. The genome holds, layer
// by layer, the weights [unit][input] and then the biases [unit]. Hidden units pass through tanh.
// Of the last layer's units the first `materials` are the logits of the softmax, the other three
// pass through the logistic function: stiffness, amplitude, phase.
#pragma once

#include "base/math.h"
#include "base/portable.h"

namespace limax {

inline constexpr int32_t most_hidden_layers = 8;
inline constexpr int32_t weight_kinds = 3;  // stiffness, amplitude, phase

struct network_shape {
    int32_t layers;                         // of weights: hidden layers + 1
    int32_t width[most_hidden_layers + 2];  // features, hidden widths, materials + 3
    int32_t materials;

    LIMAX_LAW constexpr int32_t genes_of_layer(int32_t layer) const {
        return (width[layer] + 1) * width[layer + 1];
    }
    LIMAX_LAW constexpr int32_t genes() const {
        int32_t sum = 0;
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

// One robot: features [feature][voxel], genome [gene], voxels [voxel], weights [3][voxel].
// `scratch` is aligned to 64 bytes and holds express_scratch(shape) floats.
using express_pass = void (*)(const network_shape& shape, const float* features,
                              const float* genome, float* scratch, uint8_t* voxels, float* weights,
                              int32_t voxel_count);

}  // namespace limax
