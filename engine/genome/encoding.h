// encoding.h: what a genome's network reads of every voxel centre v, and the network's shape.
// Fourier: the Gaussian positional encoding gamma(v) = [cos 2 pi B v, sin 2 pi B v], B drawn once
// per seed and repetition. CPPN: x, y, z and the distance from the middle. Dimensionless.
#pragma once

#include "base/array.h"
#include "body/lattice.h"
#include "genome/network.h"
#include "limax.h"

namespace limax {

// Computed once, in double, on the host; the features are rounded once to float. Immutable.
//
// Centres are scaled to [-1, 1] along each axis: the first at -1, the last at 1, and a single one
// at 0.
class encoding {
public:
    // Throws LIMAX_INVALID_ARGUMENT, naming the option and its range, or LIMAX_OUT_OF_MEMORY.
    explicit encoding(const limax_encoding_options& options);

    const limax_encoding_options& options() const { return options_; }
    const lattice& grid() const { return grid_; }
    const network_shape& shape() const { return shape_; }
    // Of a genome: those of the network, then those of control.
    int32_t genes() const { return shape_.genes() + options_.control_genes; }
    int32_t control_genes() const { return options_.control_genes; }
    const double* matrix() const { return matrix_.data(); }  // B, [feature][3]; fourier only
    // Fourier: cos rows, then sin rows, [2 m][voxel]; cppn: x, y, z, r, [4][voxel]; else none.
    const float* features() const { return features_.data(); }
    std::size_t features_size() const { return features_.size(); }

private:
    void draw_features();
    void place_voxels();

    limax_encoding_options options_;
    lattice grid_;
    network_shape shape_;
    array<double> matrix_;
    array<float> features_;
};

}  // namespace limax
