// random.h: random numbers as functions of their arguments only: Philox4x32-10, a law. Without
// state, any order, any number of threads and any device gives the same numbers.
//
// Source: J. Salmon, M. Moraes, R. Dror, D. Shaw, "Parallel random numbers: as easy as 1, 2, 3", SC
// 2011: ten rounds, the multipliers and the key increments below.
#pragma once

#include "base/math.h"
#include "base/portable.h"

namespace limax {

// The purpose of a random number. Streams never share a number.
enum class random_stream : uint32_t {
    encoding = 1,
    initial = 2,
    breeding = 3,
    selection = 4,
    supervision = 5,
    user = 6,
    variation = 7,
    sensors = 8
};

// Everything but the draw. The fields use every bit of Philox's key and counter:
//   key      seed (64)
//   counter  draw (32), individual (32), generation (32), repetition (24) | stream (8)
// so different arguments give different numbers, if repetition and stream fit into their bits.
struct random_key {
    uint64_t seed;
    uint32_t repetition;  // at most most_repetitions
    uint32_t stream;      // random_stream
    uint32_t generation;
    uint32_t individual;
};

inline constexpr uint32_t most_repetitions = (1u << 24) - 1;

// 128 random bits, or the counter that they come from.
struct random_block {
    uint32_t word[4];
};

LIMAX_LAW random_block philox(random_block counter, uint32_t key0, uint32_t key1) {
    constexpr uint32_t multiplier0 = 0xd2511f53, multiplier1 = 0xcd9e8d57;
    constexpr uint32_t increment0 = 0x9e3779b9, increment1 = 0xbb67ae85;
    for (int round = 0; round < 10; ++round) {
        const uint64_t product0 = uint64_t(multiplier0) * counter.word[0];
        const uint64_t product1 = uint64_t(multiplier1) * counter.word[2];
        counter = {{uint32_t(product1 >> 32) ^ counter.word[1] ^ key0, uint32_t(product1),
                    uint32_t(product0 >> 32) ^ counter.word[3] ^ key1, uint32_t(product0)}};
        key0 += increment0;
        key1 += increment1;
    }
    return counter;
}

LIMAX_LAW random_block random_bits(const random_key& key, uint32_t draw) {
    return philox({{draw, key.individual, key.generation,
                    (key.repetition & most_repetitions) | key.stream << 24}},
                  uint32_t(key.seed), uint32_t(key.seed >> 32));
}

LIMAX_LAW uint64_t join_words(uint32_t low, uint32_t high) { return uint64_t(high) << 32 | low; }

// 53 of 64 random bits as a number in [0, 1).
LIMAX_LAW double unit_interval(uint64_t bits) { return double(bits >> 11) * 0x1p-53; }

LIMAX_LAW double random_uniform(const random_key& key, uint32_t draw) {
    const random_block block = random_bits(key, draw);
    return unit_interval(join_words(block.word[0], block.word[1]));
}

// 0 to n - 1, by the high part of 64 random bits times n: probabilities differ by at most
// n / 2^64. 0 for n = 0.
LIMAX_LAW uint32_t random_integer(const random_key& key, uint32_t draw, uint32_t n) {
    const random_block block = random_bits(key, draw);
    const uint64_t carried = uint64_t(block.word[0]) * n >> 32;
    return uint32_t((uint64_t(block.word[1]) * n + carried) >> 32);
}

// N(0, 1) by Box and Muller (1958): one deviate per block, |z| <= 8.6. In double; the caller
// rounds, once.
LIMAX_LAW double random_normal(const random_key& key, uint32_t draw) {
    const random_block block = random_bits(key, draw);
    // (0, 1], so that the logarithm is finite.
    const double u = unit_interval(join_words(block.word[0], block.word[1])) + 0x1p-53;
    double sine, cosine;
    sine_cosine(join_words(block.word[2], block.word[3]), sine, cosine);
    return square_root(-2.0 * logarithm(u)) * cosine;
}

}  // namespace limax
