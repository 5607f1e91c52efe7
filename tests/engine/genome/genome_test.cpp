// genome_test.cpp: the positional encoding, and the network's reading of a genome on every
// instruction set.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <sstream>
#include <string>
#include <vector>

#include "base/array.h"
#include "base/random.h"
#include "failure.h"
#include "genome/encoding.h"
#include "genome/network.h"
#include "robots.h"

namespace {

using limax::encoding;
using limax::network_shape;
using limax::test::defaults;

std::vector<float> random_genome(const network_shape& shape, uint64_t seed, double scale) {
    std::vector<float> genome(static_cast<std::size_t>(shape.genes()));
    const limax::random_key key{seed, 1, 6, 0, 0};
    for (uint32_t gene = 0; gene < genome.size(); ++gene)
        genome[gene] = static_cast<float>(scale * limax::random_normal(key, gene));
    return genome;
}

struct expressed {
    std::vector<uint8_t> voxels;
    std::vector<float> weights;
};

expressed express(limax::express_pass pass, const encoding& code,
                  const std::vector<float>& genome) {
    const auto count = static_cast<std::size_t>(code.grid().voxels());
    // previous contents must not matter
    expressed out{std::vector<uint8_t>(count, 99), std::vector<float>(3 * count, 99)};
    limax::array<float> scratch(static_cast<std::size_t>(limax::express_scratch(code.shape())));
    std::fill(scratch.begin(), scratch.end(), std::nanf(""));
    pass(code.shape(), code.features(), genome.data(), scratch.data(), out.voxels.data(),
         out.weights.data(), static_cast<int32_t>(count));
    return out;
}

// The network read gene by gene, one voxel after the other, with activations of type R. The
// genome's layout is written out here a second time: weights [unit][input], then biases, layer by
// layer.
template <class R, class Hidden>
std::vector<R> outputs_of(const encoding& code, const std::vector<float>& genome, int64_t voxel,
                          const Hidden& hidden) {
    const network_shape& shape = code.shape();
    std::vector<R> values;
    values.reserve(static_cast<std::size_t>(shape.width[0]));
    const bool direct = shape.law == limax::network_law::direct;
    for (int32_t i = 0; i < shape.width[0]; ++i)
        values.push_back(
            (direct ? genome.data() : code.features())[i * code.grid().voxels() + voxel]);
    if (direct) return values;
    std::size_t gene = 0;
    for (int32_t layer = 0; layer < shape.layers; ++layer) {
        const auto inputs = static_cast<std::size_t>(shape.width[layer]);
        const auto units = static_cast<std::size_t>(shape.width[layer + 1]);
        std::vector<R> next;
        for (std::size_t unit = 0; unit < units; ++unit) {
            R sum = genome[gene + units * inputs + unit];
            for (std::size_t i = 0; i < inputs; ++i)
                sum = std::fma(R(genome[gene + unit * inputs + i]), values[i], sum);
            next.push_back(layer + 1 < shape.layers ? hidden(int32_t(unit), sum) : sum);
        }
        gene += (inputs + 1) * units;
        values = next;
    }
    CHECK(gene == genome.size());
    return values;
}

}  // namespace

TEST_CASE("B is normal with deviation sigma, and each of its rows depends only on the seed") {
    limax_encoding_options options = defaults();
    options.features = 1024;
    options.sigma = 3;
    const encoding code(options);
    double mean = 0, square = 0;
    for (int i = 0; i < 3072; ++i) {
        mean += code.matrix()[i] / 3072;
        square += code.matrix()[i] * code.matrix()[i] / 3072;
    }
    CHECK(std::fabs(mean) < 5 * 3 / std::sqrt(3072.0));
    CHECK(std::fabs(square - 9) < 5 * 9 * std::sqrt(2.0 / 3072));
    options.features = 4;
    options.lattice[0] = 2;
    options.hidden_count = 0;
    const encoding fewer(options);
    CHECK(std::equal(fewer.matrix(), fewer.matrix() + 12, code.matrix()));
    options.seed = 2;
    CHECK(encoding(options).matrix()[0] != code.matrix()[0]);
}

TEST_CASE("features are cosine and sine of 2 pi B v at the voxel centres, x fastest") {
    limax_encoding_options options = defaults();
    options.lattice[0] = 4;
    options.lattice[1] = 3;
    options.lattice[2] = 1;  // its only centre is 0
    options.sigma = 2.5;
    const encoding code(options);
    const double xs[4] = {-1, -1.0 / 3, 1.0 / 3, 1}, ys[3] = {-1, 0, 1};
    for (int row = 0; row < 8; ++row)
        for (int y = 0; y < 3; ++y)
            for (int x = 0; x < 4; ++x) {
                const double* b = code.matrix() + 3 * row;
                const double angle = 6.283185307179586477 * (b[0] * xs[x] + b[1] * ys[y]);
                const int voxel = x + 4 * y;
                // rounding to float, and a little for the angle
                CHECK(std::fabs(code.features()[row * 12 + voxel] - std::cos(angle)) < 0x1p-24);
                CHECK(std::fabs(code.features()[(8 + row) * 12 + voxel] - std::sin(angle)) <
                      0x1p-24);
            }
}

TEST_CASE("a CPPN reads the place of a voxel and its distance from the centre") {
    limax_encoding_options options = defaults();
    options.network = LIMAX_NETWORK_CPPN;
    options.lattice[0] = 3;
    options.lattice[1] = 1;
    options.lattice[2] = 5;
    const encoding code(options);
    const int voxel = 2 + 3 * 3;
    const float expected[4] = {1, 0, 0.5f, float(std::sqrt(1.25))};
    for (int i = 0; i < 4; ++i) CHECK(code.features()[i * 15 + voxel] == expected[i]);
}

TEST_CASE("options out of range are named with their range") {
    const auto refused = [](const auto& change, limax_status status = LIMAX_INVALID_ARGUMENT) {
        limax_encoding_options options = defaults();
        change(options);
        return limax::test::failure(status, [&] { encoding code(options); });
    };
    CHECK(refused([](auto& o) { o.features = 0; }) ==
          "features is 0; it must be 1 to 1024 rows of B");
    CHECK(refused([](auto& o) { o.sigma = std::nan(""); }).find("sigma is nan") == 0);
    CHECK(refused([](auto& o) { o.network = 4; }) == "network is 4; it must be 0 to 3");
    CHECK(refused([](auto& o) { o.network = LIMAX_NETWORK_NONE; }) ==
          "genes is 0; it must be 1 to 16777216");
    const auto huge = [](auto& o) { std::fill_n(o.lattice, 3, 100000); };
    CHECK(refused(huge, LIMAX_OUT_OF_MEMORY)
              .find("an encoding of 8 features on a lattice of 100000x100000x100000") == 0);
    CHECK(refused([](auto& o) {
              o.network = LIMAX_NETWORK_DIRECT;
              o.lattice[0] = o.lattice[1] = 1000;
          }).find("a direct genome of 24000000 genes: it may have at most 16777216") == 0);
}

TEST_CASE("every instruction set gives the bits of expressing one voxel after the other") {
    struct variant {
        int lattice[3], features, hidden_count, hidden[3], materials;
        int network = LIMAX_NETWORK_FOURIER;
    };
    const variant variants[] = {
        {{5, 5, 5}, 16, 2, {32, 32}, 5},   // the defaults: one tile, not full
        {{8, 4, 4}, 16, 2, {32, 32}, 5},   // exactly one tile
        {{7, 9, 6}, 5, 3, {3, 17, 1}, 2},  // three tiles, widths of no particular kind
        {{1, 1, 1}, 1, 0, {}, 16},
        {{130, 1, 1}, 3, 1, {6}, 7},
        {{5, 5, 5}, 0, 2, {32, 32}, 5, LIMAX_NETWORK_CPPN},
        {{7, 9, 6}, 0, 3, {3, 17, 1}, 2, LIMAX_NETWORK_CPPN},
        {{4, 1, 1}, 0, 0, {}, 5, LIMAX_NETWORK_CPPN},
        {{7, 9, 6}, 0, 0, {}, 5, LIMAX_NETWORK_DIRECT}};
    for (const variant& v : variants) {
        limax_encoding_options options = defaults();
        std::copy(v.lattice, v.lattice + 3, options.lattice);
        std::copy(v.hidden, v.hidden + 3, options.hidden);
        options.features = v.features;
        options.network = v.network;
        options.hidden_count = v.hidden_count;
        options.materials = v.materials;
        const encoding code(options);
        const auto voxels = code.grid().voxels();
        const auto genome = random_genome(code.shape(), 7, 0.5);

        expressed expected{std::vector<uint8_t>(std::size_t(voxels)),
                           std::vector<float>(3 * std::size_t(voxels))};
        double worst = 0;
        for (int64_t voxel = 0; voxel < voxels; ++voxel) {
            const bool cppn = v.network == LIMAX_NETWORK_CPPN;
            const auto outputs =
                outputs_of<float>(code, genome, voxel, [cppn](int32_t unit, float sum) {
                    return cppn ? limax::cppn_unit(unit, sum) : limax::hidden_unit(sum);
                });
            const auto logits = outputs.begin() + v.materials;
            expected.voxels[std::size_t(voxel)] =
                uint8_t(std::max_element(outputs.begin(), logits) - outputs.begin());
            for (int kind = 0; kind < 3; ++kind)
                expected.weights[std::size_t(kind * voxels + voxel)] =
                    limax::logistic(logits[kind]);
            // and the arithmetic is that of a network in double
            const auto exact =
                outputs_of<double>(code, genome, voxel, [cppn](int32_t unit, double sum) {
                    return cppn && unit % 4 == 0   ? std::sin(3.14159265358979324 * sum)
                           : cppn && unit % 4 == 1 ? std::exp(-sum * sum)
                           : cppn && unit % 4 == 3 ? std::fabs(sum)
                                                   : std::tanh(sum);
                });
            for (std::size_t k = 0; k < outputs.size(); ++k)
                worst = std::max(worst, std::fabs(outputs[k] - exact[k]));
        }
        CHECK(worst < 1e-5);
        std::istringstream isas(limax::cpu::available_isas());
        for (std::string isa; std::getline(isas, isa, ',');) {
            CAPTURE(isa);
            const expressed got =
                express(limax::cpu::choose_passes(isa.c_str()).express, code, genome);
            CHECK(got.voxels == expected.voxels);
            CHECK(std::memcmp(got.weights.data(), expected.weights.data(),
                              got.weights.size() * sizeof(float)) == 0);
        }
    }
}

TEST_CASE("equal logits choose the lower index; a NaN genome gives empty voxels with weights 0") {
    limax_encoding_options options = defaults();
    options.hidden_count = 0;
    const encoding code(options);
    const auto pass = limax::cpu::choose_passes(nullptr).express;
    std::vector<float> genome(static_cast<std::size_t>(code.genes()), 0.0f);
    const auto all = [&](uint8_t material, float weight) {
        const expressed got = express(pass, code, genome);
        const auto is = [](auto value) { return [value](auto other) { return other == value; }; };
        return std::all_of(got.voxels.begin(), got.voxels.end(), is(material)) &&
               std::all_of(got.weights.begin(), got.weights.end(), is(weight));
    };
    float* const biases = genome.data() + 16 * 8;
    CHECK(all(0, 0.5f));
    biases[2] = biases[3] = biases[4] = 1;
    CHECK(all(2, 0.5f));
    biases[4] = 2;
    CHECK(all(4, 0.5f));
    biases[4] = std::nanf("");  // never wins
    CHECK(all(2, 0.5f));
    biases[0] = std::nanf("");  // and is never beaten: the empty material stays
    CHECK(all(0, 0.5f));

    std::fill(genome.begin(), genome.end(), std::nanf(""));
    CHECK(all(0, 0.0f));
    std::fill(genome.begin(), genome.end(), 3e38f);  // sums that overflow, infinities of both signs
    const expressed got = express(pass, code, genome);
    for (const float weight : got.weights) CHECK((weight >= 0 && weight <= 1));
}
