// diversity.cpp: how much the robots of a set differ in bodies and in genes.
#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "base/error.h"
#include "genome/population.h"

namespace limax {

limax_diversity population::diversity(const int32_t* robots, int32_t count) const {
    if (count < 1)
        fail(LIMAX_INVALID_ARGUMENT, format("diversity of %d robots: it needs at least 1", count));
    for (int32_t k = 0; k < count; ++k) {
        require_robots(robots[k], 1);
        if (bodies_[std::size_t(robots[k])].status == LIMAX_BODY_UNKNOWN)
            fail(LIMAX_INVALID_ARGUMENT,
                 format("robot %d has no known body: it must be expressed or checked first",
                        robots[k] + 1));
    }
    limax_diversity out = {};
    out.robots = count;
    out.hamming = hamming(robots, count);
    genotype(robots, count, out);

    std::vector<uint64_t> hashes;
    hashes.reserve(static_cast<std::size_t>(count));
    for (int32_t k = 0; k < count; ++k) {
        const limax_body& body = bodies_[std::size_t(robots[k])];
        hashes.push_back(body.hash);
        for (int m = 0; m < LIMAX_MAX_MATERIALS; ++m) out.material_shares[m] += body.counts[m];
    }
    for (double& share : out.material_shares) share /= double(count) * double(grid_.voxels());
    std::sort(hashes.begin(), hashes.end());
    out.distinct = static_cast<int32_t>(std::unique(hashes.begin(), hashes.end()) - hashes.begin());
    return out;
}

// N robots make N^2 ordered pairs. In a voxel that n_m robots fill with material m,
// N^2 - sum over m of n_m^2 pairs differ; N (N - 1) pairs are of distinct robots. Counted exactly,
// tile by tile, so that the counts stay in a cache.
double population::hamming(const int32_t* robots, int32_t count) const {
    if (count < 2) return 0;
    static_assert((LIMAX_MAX_MATERIALS & (LIMAX_MAX_MATERIALS - 1)) == 0);
    constexpr int64_t tile = 1024, materials = LIMAX_MAX_MATERIALS;
    const int64_t voxels = grid_.voxels(), pairs = int64_t(count) * count;
    double differing = 0;
    if (bodies_on_device()) {
        std::vector<int64_t> same(static_cast<std::size_t>(voxels));
        on_device_->count_same(robots, count, same.data());
        for (const int64_t of_voxel : same) differing += double(pairs - of_voxel);
        return differing / (double(count) * (count - 1.0) * double(voxels));
    }
    const uint8_t* const all = this->voxels();
    std::vector<int32_t> counts;
    for (int64_t first = 0; first < voxels; first += tile) {
        const int64_t filled = std::min(tile, voxels - first);
        counts.assign(static_cast<std::size_t>(filled * materials), 0);
        for (int32_t k = 0; k < count; ++k) {
            const uint8_t* voxel = all + robots[k] * voxels + first;
            // A caller may have written other voxels since the check: the mask keeps the index
            // within `counts`.
            for (int64_t v = 0; v < filled; ++v)
                ++counts[static_cast<std::size_t>(v * materials + (voxel[v] & (materials - 1)))];
        }
        for (int64_t v = 0; v < filled; ++v) {
            int64_t same = 0;
            for (int64_t m = 0; m < materials; ++m) {
                const int64_t n = counts[static_cast<std::size_t>(v * materials + m)];
                same += n * n;
            }
            differing += double(pairs - same);
        }
    }
    return differing / (double(count) * (count - 1.0) * double(voxels));
}

// Two passes, mean first: a difference of squares would lose the digits of a nearly converged
// population.
void population::genotype(const int32_t* robots, int32_t count, limax_diversity& out) const {
    out.genotype = out.control = std::nan("");
    if (!code_) return;
    const auto genes = static_cast<std::size_t>(code_->genes());
    std::vector<double> square(genes, 0.0);
    if (genomes_at_.device && !genomes_at_.lent) {
        on_device_->sum_squares(robots, count, square.data());
    } else {
        const float* const all = genomes();
        std::vector<double> mean(genes, 0.0);
        for (int32_t k = 0; k < count; ++k) {
            const float* genome = all + std::size_t(robots[k]) * genes;
            for (std::size_t gene = 0; gene < genes; ++gene) mean[gene] += genome[gene];
        }
        for (double& m : mean) m /= count;
        for (int32_t k = 0; k < count; ++k) {
            const float* genome = all + std::size_t(robots[k]) * genes;
            for (std::size_t gene = 0; gene < genes; ++gene) {
                const double off = genome[gene] - mean[gene];
                square[gene] += off * off;
            }
        }
    }
    const auto mean_deviation = [&](auto begin, auto end) {
        const double sum = std::accumulate(begin, end, 0.0);
        const double deviation = std::sqrt(sum / (double(count) * double(end - begin)));
        // the bits of NaN differ between devices
        return std::isnan(deviation) ? std::nan("") : deviation;
    };
    const auto control = square.end() - control_genes();
    out.genotype = mean_deviation(square.begin(), control);
    out.control = mean_deviation(control, square.end());
}

}  // namespace limax
