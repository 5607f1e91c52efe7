// encoding.cpp: drawing B and evaluating the features.
#include "genome/encoding.h"

#include "base/fields.h"
#include "base/random.h"
#include "body/grid.h"

namespace limax {

namespace {

static_assert(most_hidden_layers == LIMAX_MAX_HIDDEN);

const limax_encoding_options& checked(const limax_encoding_options& options) {
    require_field(genome_fields, "features", options.features);
    require_field(genome_fields, "sigma", options.sigma);
    require_range("number of hidden layers", options.hidden_count, 0, LIMAX_MAX_HIDDEN, "");
    for (int layer = 0; layer < options.hidden_count; ++layer)
        require_field(genome_fields, "hidden", options.hidden[layer],
                      format("width of hidden layer %d", layer + 1).c_str());
    require_range("materials", options.materials, 2, LIMAX_MAX_MATERIALS, "");
    require_field(genome_fields, "initial_scale", options.initial_scale);
    require_range("repetition", options.repetition, 1, most_repetitions, "");
    return options;
}

network_shape shape_of(const limax_encoding_options& options) {
    network_shape shape = {};
    shape.layers = options.hidden_count + 1;
    shape.width[0] = 2 * options.features;
    for (int layer = 0; layer < options.hidden_count; ++layer)
        shape.width[layer + 1] = options.hidden[layer];
    shape.width[shape.layers] = options.materials + weight_kinds;
    shape.materials = options.materials;
    return shape;
}

double centre(int voxel, int voxels) { return voxels > 1 ? 2.0 * voxel / (voxels - 1) - 1.0 : 0.0; }

}  // namespace

encoding::encoding(const limax_encoding_options& options)
    : options_(checked(options)),
      grid_(checked_lattice(options.lattice, format("an encoding of %d features", options.features),
                            2.0 * options.features * sizeof(float))),
      shape_(shape_of(options)),
      matrix_(static_cast<std::size_t>(options.features) * 3),
      features_(static_cast<std::size_t>(2 * options.features) *
                static_cast<std::size_t>(grid_.voxels())) {
    const random_key key{options.seed, options.repetition,
                         static_cast<uint32_t>(random_stream::encoding), 0, 0};
    for (std::size_t entry = 0; entry < matrix_.size(); ++entry)
        matrix_[entry] = options.sigma * random_normal(key, static_cast<uint32_t>(entry));

    const int64_t voxels = grid_.voxels();
    for (int32_t row = 0; row < options.features; ++row) {
        const double* b = matrix_.data() + int64_t(row) * 3;
        float* cosines = features_.data() + row * voxels;
        float* sines = cosines + options.features * voxels;
        for (int z = 0; z < grid_.nz; ++z)
            for (int y = 0; y < grid_.ny; ++y)
                for (int x = 0; x < grid_.nx; ++x) {
                    const double turns =
                        fma(b[2], centre(z, grid_.nz),
                            fma(b[1], centre(y, grid_.ny), b[0] * centre(x, grid_.nx)));
                    double sine, cosine;
                    sine_cosine_turns(turns, sine, cosine);
                    *cosines++ = static_cast<float>(cosine);
                    *sines++ = static_cast<float>(sine);
                }
    }
}

}  // namespace limax
