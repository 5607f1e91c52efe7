// diversity_test.cpp: how much the robots of a set differ, against comparing every pair.
#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <set>
#include <string>
#include <vector>

#include "failure.h"
#include "robots.h"

using namespace limax::test;
using limax::population;

TEST_CASE("diversity agrees with comparing every pair") {
    for (const int32_t count : {2, 3, 30}) {
        population robots = make(50, uint64_t(count));
        robots.initialize(0, 0, 50, in_order);
        express_all(robots);
        std::vector<int32_t> set = everyone(50);
        set.erase(set.begin(), set.begin() + 50 - count);
        std::memcpy(robots.voxels() + set[0] * 60, robots.voxels() + set[1] * 60, 60);  // twins
        robots.check(paper(), {}, 0, 50);
        const limax_diversity got = robots.diversity(set.data(), count);

        double differing = 0, variance = 0;
        std::set<std::string> bodies;
        double shares[16] = {};
        for (const int32_t a : set) {
            bodies.insert(std::string(robots.voxels() + a * 60, robots.voxels() + a * 60 + 60));
            for (int v = 0; v < 60; ++v)
                shares[robots.voxels()[a * 60 + v]] += 1.0 / (60.0 * count);
            for (const int32_t b : set)
                for (int v = 0; v < 60; ++v)
                    differing += robots.voxels()[a * 60 + v] != robots.voxels()[b * 60 + v];
        }
        for (int gene = 0; gene < robots.genes(); ++gene) {
            double mean = 0, square = 0;
            for (const int32_t a : set)
                mean += double(robots.genomes()[a * robots.genes() + gene]) / count;
            for (const int32_t a : set)
                square += std::pow(robots.genomes()[a * robots.genes() + gene] - mean, 2) / count;
            variance += square / robots.genes();
        }
        CHECK(got.robots == count);
        CHECK(got.hamming ==
              doctest::Approx(differing / (60.0 * count * (count - 1))).epsilon(1e-12));
        CHECK(got.genotype == doctest::Approx(std::sqrt(variance)).epsilon(1e-12));
        CHECK(got.distinct == int32_t(bodies.size()));
        CHECK(got.distinct < count);
        for (int m = 0; m < 16; ++m)
            CHECK(got.material_shares[m] == doctest::Approx(shares[m]).epsilon(1e-12));
    }
}

TEST_CASE("diversity without genomes, of one robot, and of one that does not exist") {
    const int32_t size[3] = {2, 1, 1}, one[1] = {2}, missing[1] = {4};
    population robots(size, 4, nullptr);
    robots.check(paper(), {}, 0, 4);
    CHECK(std::isnan(robots.diversity(everyone(4).data(), 4).genotype));
    CHECK(robots.diversity(one, 1).hamming == 0);
    CHECK(refused([&] { (void)robots.diversity(missing, 1); }) ==
          "robots 5 to 5 do not all exist; there are 4");
}
