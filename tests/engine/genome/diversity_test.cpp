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
        CHECK(got.genotype == doctest::Approx(std::sqrt(variance)).epsilon(1e-9));
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

TEST_CASE("the diversity of a set is the same in parts, and finite to the last bit of a float") {
    population whole = make(40), first = make(15), second = make(25);
    second.number(15);
    for (population* each : {&whole, &first, &second}) {
        each->initialize(3, 0, each->count(), in_order);
        express_all(*each);
    }
    CHECK(std::memcmp(whole.genomes() + 15 * whole.genes(), second.genomes(),
                      sizeof(float) * 25 * std::size_t(whole.genes())) == 0);
    const float largest = std::max(first.largest_gene(everyone(15).data(), 15),
                                   second.largest_gene(everyone(25).data(), 25));
    std::vector<int64_t> sums(std::size_t(first.sums_size()), 0), some = sums;
    std::vector<uint64_t> hashes;
    for (const population* each : {&first, &second}) {
        each->sums(everyone(each->count()).data(), each->count(), largest, some.data());
        for (std::size_t k = 0; k < sums.size(); ++k) sums[k] += some[k];
        for (int32_t k = 0; k < each->count(); ++k) hashes.push_back(each->bodies()[k].hash);
    }
    const limax_diversity all = whole.diversity(everyone(40).data(), 40),
                          added = second.diversity_of(sums.data(), largest,
                                                      limax::distinct(hashes.data(), 40), 40);
    CHECK(std::memcmp(&all, &added, sizeof all) == 0);
    CHECK(second.largest_gene(nullptr, 0) == 0);

    // genes from the smallest float to the largest
    for (int32_t k = 0; k < 40; ++k)
        whole.genomes()[k * whole.genes()] = k % 2 == 0 ? 3.4e38f : -1e-45f;
    CHECK(whole.diversity(everyone(40).data(), 40).genotype ==
          doctest::Approx(1.7e38 / std::sqrt(whole.genes())).epsilon(1e-6));
    whole.genomes()[7] = INFINITY;
    CHECK(std::isnan(whole.diversity(everyone(40).data(), 40).genotype));
}
