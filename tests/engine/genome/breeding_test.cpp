// breeding_test.cpp: the law of one gene: rates, independent choices and rounding.
#include "genome/breeding.h"

#include <doctest/doctest.h>

#include <cmath>

namespace {

using limax::breeding_rates;
using limax::random_key;

constexpr random_key key{42, 1, 3, 7, 11};
constexpr uint32_t count = 200000;

// Five standard errors of a share p of `n`.
double share_error(double p, double n) { return 5 * std::sqrt(p * (1 - p) / n); }

}  // namespace

TEST_CASE("crossover and mutation are independent of each other") {
    const breeding_rates rates{0.3, 0.1, 0.4};
    uint32_t crossed = 0, mutated = 0, both = 0;
    for (uint32_t gene = 0; gene < count; ++gene) {
        const float got = limax::child_gene(rates, key, gene, 0.0f, 1000.0f);
        const bool second = got > 500, changed = got != 0.0f && got != 1000.0f;
        crossed += second;
        mutated += changed;
        both += second && changed;
    }
    CHECK(std::fabs(double(mutated) / count - 0.3) < share_error(0.3, count));
    CHECK(std::fabs(double(crossed) / count - 0.4) < share_error(0.4, count));
    CHECK(std::fabs(double(both) / count - 0.12) < share_error(0.12, count));
}

TEST_CASE("a mutation is added in double and rounded once") {
    const breeding_rates rates{1, 0.3, 0};
    for (uint32_t gene = 0; gene < 2000; ++gene) {
        const float parent = 1.7f;
        const double deviate = limax::random_normal(key, 2 * gene + 1);
        const auto expected = static_cast<float>(std::fma(0.3, deviate, double(parent)));
        REQUIRE(limax::child_gene(rates, key, gene, parent, 9.0f) == expected);
    }
}
