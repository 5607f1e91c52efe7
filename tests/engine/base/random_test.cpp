// random_test.cpp: Philox against its published vectors, the layout of key and counter, and the
// distributions drawn from it.
#include "base/random.h"

#include <doctest/doctest.h>

#include <cmath>
#include <vector>

namespace {

using limax::random_key;

constexpr random_key some_key{12345, 1, 6, 0, 0};

void check_block(const limax::random_block& got, const limax::random_block& expected) {
    for (int i = 0; i < 4; ++i) CHECK(got.word[i] == expected.word[i]);
}

}  // namespace

TEST_CASE("philox4x32-10 gives the published vectors") {
    // Known-answer vectors that come with Random123 (Salmon et al. 2011): counter, key, result.
    check_block(limax::philox({{0, 0, 0, 0}}, 0, 0),
                {{0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8}});
    check_block(
        limax::philox({{0xffffffff, 0xffffffff, 0xffffffff, 0xffffffff}}, 0xffffffff, 0xffffffff),
        {{0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd}});
    check_block(
        limax::philox({{0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344}}, 0xa4093822, 0x299f31d0),
        {{0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1}});
}

TEST_CASE("key and counter store every argument in its own bits") {
    const random_key key{0x0123456789abcdef, 0x00c0ffee, 0x5a, 0xfeed0001, 0xbeef0002};
    check_block(
        limax::random_bits(key, 0xdead0003),
        limax::philox({{0xdead0003, 0xbeef0002, 0xfeed0001, 0x5ac0ffee}}, 0x89abcdef, 0x01234567));
}

TEST_CASE("uniform numbers: in [0, 1), flat, with 53 bits") {
    constexpr int count = 200000, bins = 100;
    constexpr double expected = double(count) / bins;
    std::vector<int> histogram(bins, 0);
    bool low_bit = false;
    for (uint32_t draw = 0; draw < count; ++draw) {
        const double u = limax::random_uniform(some_key, draw);
        REQUIRE(u >= 0.0);
        REQUIRE(u < 1.0);
        ++histogram[static_cast<std::size_t>(u * bins)];
        low_bit |= std::fmod(u * 0x1p53, 2.0) == 1.0;
    }
    double chi_squared = 0;
    for (const int n : histogram) chi_squared += (n - expected) * (n - expected) / expected;
    // 99 degrees of freedom: mean 99, standard deviation 14
    CHECK(chi_squared < 99 + 5 * 14);
    CHECK(chi_squared > 99 - 5 * 14);
    CHECK(low_bit);
    CHECK(limax::unit_interval(~uint64_t(0)) < 1.0);
}

TEST_CASE("integers: every value below n, equally often, and large n reach their ends") {
    std::vector<int> histogram(7, 0);
    constexpr int count = 70000;
    for (uint32_t draw = 0; draw < count; ++draw) {
        const uint32_t value = limax::random_integer(some_key, draw, 7);
        REQUIRE(value < 7);
        ++histogram[value];
    }
    for (const int n : histogram) CHECK(std::abs(n - 10000) < 5 * 93);  // sqrt(n p (1 - p)) = 93
    for (uint32_t draw = 0; draw < 100; ++draw) {
        CHECK(limax::random_integer(some_key, draw, 1) == 0);
        CHECK(limax::random_integer(some_key, draw, 0) == 0);
        // the high word of 64 bits times n
        const limax::random_block block = limax::random_bits(some_key, draw);
        const auto bits =
            static_cast<unsigned __int128>(limax::join_words(block.word[0], block.word[1]));
        for (const uint32_t n : {3u, 30u, 1000003u, 0xffffffffu})
            CHECK(limax::random_integer(some_key, draw, n) ==
                  static_cast<uint32_t>((bits * n) >> 64));
    }
}

TEST_CASE("a normal deviate is Box and Muller's of its block") {
    for (uint32_t draw = 0; draw < 1000; ++draw) {
        const limax::random_block block = limax::random_bits(some_key, draw);
        const long double u =
            (static_cast<long double>(limax::join_words(block.word[0], block.word[1]) >> 11) + 1) *
            0x1p-53L;
        const long double turns = std::ldexp(
            static_cast<long double>(limax::join_words(block.word[2], block.word[3])), -64);
        const long double truth =
            std::sqrt(-2 * std::log(u)) * std::cos(6.283185307179586476925L * turns);
        CHECK(std::fabs(static_cast<double>(limax::random_normal(some_key, draw) - truth)) < 2e-15);
    }
}
