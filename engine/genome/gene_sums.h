// gene_sums.h: sums over robots of a gene and of its square, in whole steps of 2^-30 of a power of
// two above the largest gene of all: exact, so that they have the same bits in any order and may be
// added up in parts. 2^31 robots at most. Laws only.
#pragma once

#include "base/math.h"

namespace limax {

inline constexpr int kinds_of_gene_sums = 3;

// The bits of |gene|, which order as the values do; those of a gene that is not finite are larger.
LIMAX_LAW uint32_t magnitude_bits(float gene) { return bits_as<uint32_t>(gene) & 0x7fffffffu; }
LIMAX_LAW float magnitude_of(uint32_t bits) { return bits_as<float>(bits); }

struct gene_sums {
    int64_t steps = 0;          // counted from -2^30, so that none is negative
    int64_t low = 0, high = 0;  // of the squares, their lower 32 bits and the rest

    // `scale` is steps per unit.
    LIMAX_LAW void add(float gene, double scale) {
        const auto step = uint32_t(int32_t(double(gene) * scale + (0x1p30 + 0.5)));
        const uint64_t square = uint64_t(step) * step;  // 2^62 at most
        steps += step;
        low += uint32_t(square);
        high += int64_t(square >> 32);
    }
};

}  // namespace limax
