// encoding.cpp: drawing B and evaluating the features.
#include "genome/encoding.h"

#include "base/fields.h"
#include "base/random.h"
#include "body/grid.h"

namespace limax {

namespace {

static_assert(most_hidden_layers == LIMAX_MAX_HIDDEN);

static_assert(int32_t(network_law::fourier) == LIMAX_NETWORK_FOURIER);
static_assert(int32_t(network_law::cppn) == LIMAX_NETWORK_CPPN);
static_assert(int32_t(network_law::direct) == LIMAX_NETWORK_DIRECT);
static_assert(int32_t(network_law::none) == LIMAX_NETWORK_NONE);

constexpr int32_t cppn_inputs = 4;
constexpr int32_t most_free_genes = 1 << 24, most_control_genes = 4096;

const limax_encoding_options& checked(const limax_encoding_options& options) {
    require_range("network", options.network, LIMAX_NETWORK_FOURIER, LIMAX_NETWORK_NONE, "");
    const auto law = network_law(options.network);
    if (law == network_law::fourier) {
        require_field(genome_fields, "features", options.features);
        require_field(genome_fields, "sigma", options.sigma);
    }
    if (law == network_law::fourier || law == network_law::cppn) {
        require_range("number of hidden layers", options.hidden_count, 0, LIMAX_MAX_HIDDEN, "");
        for (int layer = 0; layer < options.hidden_count; ++layer)
            require_field(genome_fields, "hidden", options.hidden[layer],
                          format("width of hidden layer %d", layer + 1).c_str());
    }
    require_range("control_genes", options.control_genes, 0, most_control_genes, "");
    require_field(genome_fields, "control_spread", options.control_spread);
    if (law == network_law::none)
        require_range("genes", options.genes, options.control_genes > 0 ? 0 : 1, most_free_genes,
                      "");
    require_range("materials", options.materials, 2, LIMAX_MAX_MATERIALS, "");
    require_field(genome_fields, "initial_scale", options.initial_scale);
    require_range("repetition", options.repetition, 1, most_repetitions, "");
    return options;
}

// Bytes that an encoding keeps of each voxel.
double bytes_per_voxel(const limax_encoding_options& options) {
    const auto law = network_law(options.network);
    const double inputs = law == network_law::fourier ? 2.0 * options.features
                          : law == network_law::cppn  ? cppn_inputs
                                                      : 0;
    return inputs * sizeof(float);
}

lattice grid_of(const limax_encoding_options& options) {
    const bool fourier = options.network == LIMAX_NETWORK_FOURIER;
    return checked_lattice(options.lattice,
                           fourier ? format("an encoding of %d features", options.features)
                                   : std::string("an encoding"),
                           bytes_per_voxel(options));
}

network_shape shape_of(const limax_encoding_options& options, const lattice& grid) {
    network_shape shape = {};
    shape.materials = options.materials;
    shape.law = network_law(options.network);
    const int32_t outputs = options.materials + weight_kinds;
    if (shape.law == network_law::none) {
        shape.free_genes = options.genes;
        return shape;
    }
    if (shape.law == network_law::direct) {
        const int64_t genes = outputs * grid.voxels();
        if (genes > most_free_genes)
            fail(LIMAX_INVALID_ARGUMENT,
                 format("a direct genome of %lld genes: it may have at most %d; take a smaller "
                        "lattice or another network",
                        static_cast<long long>(genes), most_free_genes));
        shape.free_genes = int32_t(genes);
        shape.width[0] = outputs;
        return shape;
    }
    shape.layers = options.hidden_count + 1;
    shape.width[0] = shape.law == network_law::cppn ? cppn_inputs : 2 * options.features;
    for (int layer = 0; layer < options.hidden_count; ++layer)
        shape.width[layer + 1] = options.hidden[layer];
    shape.width[shape.layers] = outputs;
    return shape;
}

double centre(int voxel, int voxels) { return voxels > 1 ? 2.0 * voxel / (voxels - 1) - 1.0 : 0.0; }

// Calls visit(voxel, x, y, z) with the centre of each voxel.
template <class Visit>
void each_centre(const lattice& grid, const Visit& visit) {
    int64_t voxel = 0;
    for (int z = 0; z < grid.nz; ++z)
        for (int y = 0; y < grid.ny; ++y)
            for (int x = 0; x < grid.nx; ++x)
                visit(voxel++, centre(x, grid.nx), centre(y, grid.ny), centre(z, grid.nz));
}

}  // namespace

encoding::encoding(const limax_encoding_options& options)
    : options_(checked(options)), grid_(grid_of(options)), shape_(shape_of(options, grid_)) {
    if (shape_.law == network_law::fourier) draw_features();
    if (shape_.law == network_law::cppn) place_voxels();
}

void encoding::draw_features() {
    const int64_t voxels = grid_.voxels();
    const int32_t rows = options_.features;
    matrix_ = array<double>(static_cast<std::size_t>(rows) * 3);
    features_ = array<float>(2 * static_cast<std::size_t>(rows) * static_cast<std::size_t>(voxels));
    const random_key key{options_.seed, options_.repetition,
                         static_cast<uint32_t>(random_stream::encoding), 0, 0};
    for (std::size_t entry = 0; entry < matrix_.size(); ++entry)
        matrix_[entry] = options_.sigma * random_normal(key, static_cast<uint32_t>(entry));
    for (int32_t row = 0; row < rows; ++row) {
        const double* b = matrix_.data() + int64_t(row) * 3;
        float* cosines = features_.data() + row * voxels;
        float* sines = cosines + rows * voxels;
        each_centre(grid_, [&](int64_t voxel, double x, double y, double z) {
            double sine, cosine;
            sine_cosine_turns(fma(b[2], z, fma(b[1], y, b[0] * x)), sine, cosine);
            cosines[voxel] = static_cast<float>(cosine);
            sines[voxel] = static_cast<float>(sine);
        });
    }
}

void encoding::place_voxels() {
    const int64_t voxels = grid_.voxels();
    features_ = array<float>(cppn_inputs * static_cast<std::size_t>(voxels));
    each_centre(grid_, [&](int64_t voxel, double x, double y, double z) {
        const double inputs[cppn_inputs] = {x, y, z, square_root(fma(x, x, fma(y, y, z * z)))};
        for (int32_t i = 0; i < cppn_inputs; ++i)
            features_[static_cast<std::size_t>(i * voxels + voxel)] = static_cast<float>(inputs[i]);
    });
}

}  // namespace limax
