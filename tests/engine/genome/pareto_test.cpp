// pareto_test.cpp: ranks and crowding distances against their definitions.
#include "genome/pareto.h"

#include <doctest/doctest.h>

#include <cmath>
#include <vector>

#include "base/random.h"
#include "failure.h"

using namespace limax;

namespace {

struct ranked {
    std::vector<int32_t> rank;
    std::vector<double> crowding;
};

ranked rank_of(const std::vector<double>& values, int32_t objectives) {
    const std::size_t count = values.size() / std::size_t(objectives);
    ranked out{std::vector<int32_t>(count), std::vector<double>(count)};
    pareto_rank(values.data(), int32_t(count), objectives, out.rank.data(), out.crowding.data());
    return out;
}

// `kinds` different numbers per objective, 0 for any.
std::vector<double> points(int32_t count, int32_t objectives, uint32_t kinds, uint64_t seed) {
    std::vector<double> values;
    const random_key key{seed, 1, 6, 0, 0};
    for (uint32_t k = 0; k < uint32_t(count * objectives); ++k)
        values.push_back(kinds ? double(random_integer(key, k, kinds)) : random_uniform(key, k));
    return values;
}

// Removes front after front; each step compares every pair.
std::vector<int32_t> ranks_by_definition(const std::vector<double>& values, int32_t objectives) {
    const auto count = int32_t(values.size()) / objectives;
    const auto dominates = [&](int32_t a, int32_t b) {
        bool better = false;
        for (int32_t k = 0; k < objectives; ++k) {
            const double x = values[std::size_t(a * objectives + k)],
                         y = values[std::size_t(b * objectives + k)];
            if (x < y) return false;
            better = better || x > y;
        }
        return better;
    };
    std::vector<int32_t> rank(std::size_t(count), -1);
    int32_t left = count;
    for (int32_t front = 0; left > 0; ++front) {
        std::vector<int32_t> found;
        for (int32_t i = 0; i < count; ++i) {
            bool dominated = rank[std::size_t(i)] >= 0;
            for (int32_t j = 0; j < count && !dominated; ++j)
                dominated = rank[std::size_t(j)] < 0 && dominates(j, i);
            if (!dominated) found.push_back(i);
        }
        for (const int32_t i : found) rank[std::size_t(i)] = front;
        left -= int32_t(found.size());
    }
    return rank;
}

}  // namespace

TEST_CASE("Pareto ranks are those of the definition, ties and copies included") {
    for (int32_t objectives = 1; objectives <= most_objectives; ++objectives)
        for (const uint32_t kinds : {0u, 2u, 5u}) {
            CAPTURE(objectives);
            CAPTURE(kinds);
            const auto values = points(150, objectives, kinds, 1 + kinds);
            CHECK(rank_of(values, objectives).rank == ranks_by_definition(values, objectives));
        }
    const double most = INFINITY;
    CHECK(rank_of({-most, 1, 0, 1, most, 0, most, most}, 2).rank ==
          std::vector<int32_t>{2, 1, 1, 0});
    CHECK(rank_of({}, 3).rank.empty());
}

TEST_CASE("crowding distances are the gaps between neighbours; copies have none") {
    // one front along each objective, its third point twice
    const auto front = rank_of({0, 4, 1, 3, 2, 2, 4, 0, 2, 2}, 2);
    CHECK(front.rank == std::vector<int32_t>{0, 0, 0, 0, 0});
    CHECK(front.crowding == std::vector<double>{INFINITY, 1, 1.5, INFINITY, 0});
    // an objective that is the same everywhere, and one that is infinitely far apart
    CHECK(rank_of({7, 0, 2, 7, 1, 1, 7, 2, 0}, 3).crowding ==
          std::vector<double>{INFINITY, 2, INFINITY});
    CHECK(rank_of({0, INFINITY, 1, 1, 2, 0}, 2).crowding ==
          std::vector<double>{INFINITY, 1, INFINITY});
    CHECK(rank_of({3, 3, 3, 3}, 2).crowding == std::vector<double>{INFINITY, 0});
}

TEST_CASE("Pareto ranks refuse NaN and too many objectives") {
    const auto refused = [](const auto& call) {
        return test::failure(LIMAX_INVALID_ARGUMENT, call);
    };
    CHECK(refused([] {
              rank_of({1, 2, 3, NAN}, 2);
          }) == "point 2, objective 2: expected a number, got nan");
    CHECK(refused([] { rank_of({1, 2, 3}, 9); }) == "number of objectives is 9; it must be 1 to 8");
}
