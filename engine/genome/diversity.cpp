// diversity.cpp: how much the robots of a set differ in bodies and in genes. All of it follows from
// sums of integers, which have the same bits in any order: a set may be summed in parts.
#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>
#include <vector>

#include "base/error.h"
#include "genome/gene_sums.h"
#include "genome/population.h"

namespace limax {

namespace {

__extension__ using wide = __int128;

// Steps per unit; `largest` is finite.
double gene_scale(float largest) {
    int exponent = 0;
    std::frexp(largest, &exponent);
    return std::ldexp(1.0, 30 - exponent);
}

}  // namespace

// How many of these hashes differ, by a table with open addressing: they are random already.
int32_t distinct(const uint64_t* hashes, int32_t count) {
    if (count < 0) fail(LIMAX_INVALID_ARGUMENT, format("%d hashes: expected at least 0", count));
    std::vector<uint64_t> table(std::bit_ceil(2 * std::size_t(count)));
    bool has_zero = false;  // an empty place
    int32_t found = 0;
    for (int32_t k = 0; k < count; ++k) {
        has_zero = has_zero || hashes[k] == 0;
        std::size_t at = hashes[k] % table.size();
        while (table[at] != 0 && table[at] != hashes[k]) at = (at + 1) % table.size();
        if (table[at] != hashes[k]) ++found;
        table[at] = hashes[k];
    }
    return found + (has_zero ? 1 : 0);
}

void population::require_set(const int32_t* robots, int32_t count) const {
    for (int32_t k = 0; k < count; ++k) {
        require_robots(robots[k], 1);
        if (bodies_[std::size_t(robots[k])].status == LIMAX_BODY_UNKNOWN)
            fail(LIMAX_INVALID_ARGUMENT,
                 format("robot %d has no known body: it must be expressed or checked first",
                        robots[k] + 1));
    }
}

int64_t population::sums_size() const {
    return grid_.voxels() * LIMAX_MAX_MATERIALS + kinds_of_gene_sums * int64_t(genes());
}

float population::largest_gene(const int32_t* robots, int32_t count) const {
    require_set(robots, count);
    uint32_t bits = 0;
    if (code_ && genomes_at_.device && !genomes_at_.lent) {
        bits = on_device_->largest_gene(robots, count);
    } else if (code_) {
        const float* const all = genomes();
        const int32_t genes = code_->genes();
        int32_t most = 0;  // signed, for vectors
        for (int32_t k = 0; k < count; ++k) {
            const float* const of_robot = all + int64_t(robots[k]) * genes;
            for (int32_t gene = 0; gene < genes; ++gene)
                most = std::max(most, int32_t(magnitude_bits(of_robot[gene])));
        }
        bits = uint32_t(most);
    }
    return magnitude_of(bits);
}

void population::sums(const int32_t* robots, int32_t count, float largest, int64_t* out) const {
    require_set(robots, count);
    std::fill_n(out, sums_size(), 0);
    if (count == 0) return;
    count_materials(robots, count, out);
    if (code_ && std::isfinite(largest))
        sum_genes(robots, count, gene_scale(largest), out + grid_.voxels() * LIMAX_MAX_MATERIALS);
}

// Tile by tile, so that the counts stay in a cache.
void population::count_materials(const int32_t* robots, int32_t count, int64_t* counts) const {
    static_assert((LIMAX_MAX_MATERIALS & (LIMAX_MAX_MATERIALS - 1)) == 0);
    constexpr int64_t tile = 1024, materials = LIMAX_MAX_MATERIALS;
    const int64_t voxels = grid_.voxels();
    if (bodies_on_device()) {
        on_device_->count_materials(robots, count, counts);
        return;
    }
    const uint8_t* const all = this->voxels();
    for (int64_t first = 0; first < voxels; first += tile) {
        const int64_t filled = std::min(tile, voxels - first);
        for (int32_t k = 0; k < count; ++k) {
            const uint8_t* voxel = all + robots[k] * voxels + first;
            // A caller may have written other voxels since the check: the mask keeps the index
            // within `counts`.
            for (int64_t v = 0; v < filled; ++v)
                ++counts[(first + v) * materials + (voxel[v] & (materials - 1))];
        }
    }
}

void population::sum_genes(const int32_t* robots, int32_t count, double scale, int64_t* out) const {
    if (genomes_at_.device && !genomes_at_.lent) {
        on_device_->sum_genes(robots, count, scale, out);
        return;
    }
    // tile by tile, so that the sums stay in a cache, and as columns, for vectors
    constexpr int64_t tile = 256;
    const float* const all = genomes();
    const int64_t genes = code_->genes();
    for (int64_t first = 0; first < genes; first += tile) {
        const int64_t filled = std::min(tile, genes - first);
        int64_t steps[tile] = {}, low[tile] = {}, high[tile] = {};
        for (int32_t k = 0; k < count; ++k) {
            const float* const gene = all + robots[k] * genes + first;
            for (int64_t g = 0; g < filled; ++g) {
                gene_sums of{steps[g], low[g], high[g]};
                of.add(gene[g], scale);
                steps[g] = of.steps, low[g] = of.low, high[g] = of.high;
            }
        }
        std::copy_n(steps, filled, out + first);
        std::copy_n(low, filled, out + genes + first);
        std::copy_n(high, filled, out + 2 * genes + first);
    }
}

limax_diversity population::diversity_of(const int64_t* sums, float largest, int32_t different,
                                         int32_t count) const {
    if (count < 1)
        fail(LIMAX_INVALID_ARGUMENT, format("diversity of %d robots: it needs at least 1", count));
    limax_diversity out = {};
    out.robots = count;
    // N robots make N^2 ordered pairs. In a voxel that n_m robots fill with material m,
    // N^2 - sum over m of n_m^2 pairs differ; N (N - 1) pairs are of distinct robots.
    const int64_t voxels = grid_.voxels(), pairs = int64_t(count) * count;
    double differing = 0;
    for (int64_t voxel = 0; voxel < voxels; ++voxel) {
        int64_t same = 0;
        for (int m = 0; m < LIMAX_MAX_MATERIALS; ++m) {
            const int64_t n = sums[voxel * LIMAX_MAX_MATERIALS + m];
            same += n * n;
            out.material_shares[m] += double(n);
        }
        differing += double(pairs - same);
    }
    if (count > 1) out.hamming = differing / (double(count) * (count - 1.0) * double(voxels));
    for (double& share : out.material_shares) share /= double(count) * double(voxels);
    out.distinct = different;

    // N^2 times the variance of each gene: N sum of squares - square of the sum, exactly.
    const int64_t* const of_genes = sums + voxels * LIMAX_MAX_MATERIALS;
    const auto deviation = [&](int64_t begin, int64_t end) {
        if (begin == end || !std::isfinite(largest)) return std::nan("");
        double sum = 0;
        for (int64_t gene = begin; gene < end; ++gene) {
            const wide steps = of_genes[gene];
            const wide squares =
                (wide(of_genes[2 * genes() + gene]) << 32) + of_genes[genes() + gene];
            sum += double(count * squares - steps * steps);
        }
        return std::sqrt(sum / double(end - begin)) / (double(count) * gene_scale(largest));
    };
    out.genotype = deviation(0, genes() - control_genes());
    out.control = deviation(genes() - control_genes(), genes());
    return out;
}

limax_diversity population::diversity(const int32_t* robots, int32_t count) const {
    const float largest = largest_gene(robots, count);
    std::vector<int64_t> all(static_cast<std::size_t>(sums_size()));
    sums(robots, count, largest, all.data());
    std::vector<uint64_t> hashes;
    for (int32_t k = 0; k < count; ++k) hashes.push_back(bodies_[std::size_t(robots[k])].hash);
    return diversity_of(all.data(), largest, distinct(hashes.data(), count), count);
}

}  // namespace limax
