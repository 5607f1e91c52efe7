// population_test.cpp: genomes and bodies of many robots: first generations, expression, bodies by
// hand, breeding; every one the same however the work is cut, and every refusal with its text.
#include "genome/population.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <set>

#include "failure.h"
#include "genome/breeding.h"
#include "robots.h"

using namespace limax::test;
using limax::population;

TEST_CASE("first genomes: weights N(0, scale^2 / inputs), biases 0, each robot its own") {
    limax_encoding_options options = defaults();
    options.initial_scale = 2;
    population robots(options.lattice, 300, code_of(options));
    robots.initialize(0, 0, 300, in_order);
    // layers of 16 -> 12 -> 9 -> 8
    const int inputs[3] = {16, 12, 9}, units[3] = {12, 9, 8};
    int gene = 0;
    for (int layer = 0; layer < 3; ++layer) {
        double sum = 0, square = 0;
        const int weights = inputs[layer] * units[layer];
        for (int robot = 0; robot < 300; ++robot)
            for (int k = 0; k < weights; ++k) {
                const double w = robots.genomes()[robot * robots.genes() + gene + k];
                sum += w;
                square += w * w;
            }
        const double n = 300.0 * weights, variance = 4.0 / inputs[layer];
        CHECK(std::fabs(sum / n) < 5 * std::sqrt(variance / n));
        CHECK(std::fabs(square / n - variance) < 5 * variance * std::sqrt(2 / n));
        gene += weights;
        for (int robot = 0; robot < 300; ++robot)
            for (int k = 0; k < units[layer]; ++k)
                REQUIRE(robots.genomes()[robot * robots.genes() + gene + k] == 0);
        gene += units[layer];
    }
    CHECK(gene == robots.genes());
    std::set<float> firsts;
    for (int robot = 0; robot < 300; ++robot)
        firsts.insert(robots.genomes()[robot * robots.genes()]);
    CHECK(firsts.size() == 300);
}

TEST_CASE("ranges, threads and the number of robots change no genome and no body") {
    population whole = make(40), parts = make(40), few = make(7), later = make(40);
    whole.initialize(0, 0, 40, in_order);
    parts.initialize(0, 31, 9, scattered);
    parts.initialize(0, 0, 1, scattered);
    parts.initialize(0, 1, 30, scattered);
    few.initialize(0, 0, 7, in_order);
    later.initialize(1, 0, 40, in_order);
    CHECK(same_genomes(whole, parts));
    CHECK(std::memcmp(few.genomes(), whole.genomes(),
                      sizeof(float) * 7 * std::size_t(few.genes())) == 0);
    CHECK_FALSE(same_genomes(whole, later));  // each generation has new ones

    const auto pass = limax::cpu::choose_passes("baseline").express;
    express_all(whole);
    express_all(few);
    parts.express(paper(), {false, true}, pass, scattered, 0, 17);
    for (int32_t robot = 17; robot < 40; ++robot)
        CHECK(parts.bodies()[robot].status == LIMAX_BODY_UNKNOWN);
    parts.express(paper(), {false, true}, pass, scattered, 17, 23);
    CHECK(same_bodies(whole, parts));
    CHECK(std::memcmp(few.voxels(), whole.voxels(), 7 * 60) == 0);
    CHECK(few.bodies()[6].hash == whole.bodies()[6].hash);
}

TEST_CASE("bodies without a voxel, or without a required muscle, are invalid with a reason") {
    population robots = make(3);
    // biases of the last layer, materials first
    const int biases = robots.genes() - 8;
    robots.genomes()[1 * robots.genes() + biases + 4] = 1;  // all bone
    robots.genomes()[2 * robots.genes() + biases + 1] = 1;  // all muscle
    for (const bool require_muscle : {false, true}) {
        express_all(robots, require_muscle);
        CHECK(robots.bodies()[0].status == LIMAX_BODY_NO_VOXEL);
        CHECK(robots.bodies()[1].status ==
              (require_muscle ? LIMAX_BODY_NO_MUSCLE : LIMAX_BODY_VALID));
        CHECK(robots.bodies()[2].status == LIMAX_BODY_VALID);
        CHECK(robots.bodies()[1].counts[4] == 60);
        CHECK(robots.bodies()[0].hash != robots.bodies()[1].hash);
    }
    for (int gene = 0; gene < robots.genes(); ++gene)
        robots.genomes()[2 * robots.genes() + gene] = std::nanf("");
    express_all(robots);
    CHECK(robots.bodies()[2].status == LIMAX_BODY_NO_VOXEL);
}

TEST_CASE("bodies written by hand are checked and described, not changed") {
    const int32_t size[3] = {4, 1, 1};
    population robots(size, 2, nullptr);
    CHECK(robots.genomes() == nullptr);
    CHECK(robots.genes() == 0);
    const uint8_t voxels[8] = {1, 0, 3, 0, 0, 0, 0, 0};
    std::memcpy(robots.voxels(), voxels, 8);
    std::fill(robots.weights(), robots.weights() + 24, 1.0f);
    robots.check(paper(), {true}, 0, 2);
    CHECK(std::memcmp(robots.voxels(), voxels, 8) == 0);
    CHECK(robots.bodies()[0].status == LIMAX_BODY_VALID);
    CHECK(robots.bodies()[0].springs == 56);
    CHECK(robots.bodies()[1].status == LIMAX_BODY_NO_VOXEL);

    robots.voxels()[6] = 5;
    CHECK(refused([&] { robots.check(paper(), {true}, 0, 2); }) ==
          "robot 2, voxel (3, 1, 1): material 5; the table \"paper\" has 0 to 4");
    robots.check(paper(), {true}, 0, 1);  // the other robot is not asked for
    robots.voxels()[6] = 4;
    robots.weights()[12 + 4 + 3] = 1.5f;
    CHECK(refused([&] { robots.check(paper(), {true}, 1, 1); }) ==
          "robot 2, voxel (4, 1, 1): amplitude weight 1.5; it must be 0 to 1");
    robots.weights()[12 + 4 + 3] = std::nanf("");
    CHECK(refused([&] { robots.check(paper(), {true}, 1, 1); }).find("amplitude weight nan") !=
          std::string::npos);
    CHECK(robots.bodies()[1].status == LIMAX_BODY_NO_VOXEL);  // as before the refusals
}

TEST_CASE("children in ranges, on threads and in pieces are the children bred at once") {
    population parents = make(20), whole = make(50), parts = make(50);
    parents.initialize(0, 0, 20, in_order);
    const auto pairs = some_pairs(50, 20);
    const limax_breeding breeding = some_breeding();
    whole.breed(parents, pairs.data(), breeding, in_order, 0, 50);
    for (int32_t child = 49; child >= 30; --child)
        parts.breed(parents, pairs.data(), breeding, in_order, child, 1);
    parts.breed(parents, pairs.data(), breeding, scattered, 2, 28);
    parts.breed(parents, pairs.data(), breeding, scattered, 0, 2);
    CHECK(same_genomes(whole, parts));

    // and the law of breeding.h, gene by gene; elites are copies of their first parent
    const auto genes = std::size_t(whole.genes());
    for (std::size_t child = 0; child < 50; ++child) {
        const float* first = parents.genomes() + std::size_t(pairs[2 * child]) * genes;
        const float* second = parents.genomes() + std::size_t(pairs[2 * child + 1]) * genes;
        const limax::random_key key{1, 1, LIMAX_STREAM_BREEDING, 1, uint32_t(child)};
        for (std::size_t gene = 0; gene < genes; ++gene) {
            const float expected = child < 3
                                       ? first[gene]
                                       : limax::child_gene({0.1, 0.1, 0.4}, key, uint32_t(gene),
                                                           first[gene], second[gene]);
            REQUIRE(whole.genomes()[child * genes + gene] == expected);
        }
    }
}

TEST_CASE("genes of control follow the others, which keep their bits") {
    limax_encoding_options options = defaults();
    options.control_genes = 50;
    options.control_spread = 0.5;
    constexpr int32_t count = 40;
    population plain = make(count), plain_children = make(count);
    population robots(options.lattice, count, code_of(options)),
        children(options.lattice, count, code_of(options));
    const int32_t genes = plain.genes(), all = robots.genes();
    REQUIRE(all == genes + 50);
    const auto same_others = [&](const population& a, const population& b) {
        for (int32_t robot = 0; robot < count; ++robot)
            if (std::memcmp(a.genomes() + robot * genes, b.genomes() + robot * all,
                            sizeof(float) * std::size_t(genes)) != 0)
                return false;
        return true;
    };
    plain.initialize(0, 0, count, in_order);
    robots.initialize(0, 0, count, in_order);
    CHECK(same_others(plain, robots));
    double square = 0;
    for (int32_t robot = 0; robot < count; ++robot)
        for (int32_t gene = genes; gene < all; ++gene)
            square += std::pow(robots.genomes()[robot * all + gene], 2);
    CHECK(std::fabs(square / (50 * count) - 0.25) < 5 * 0.25 * std::sqrt(2.0 / (50 * count)));
    express_all(plain);
    express_all(robots);
    CHECK(same_bodies(plain, robots));
    const auto set = everyone(count);
    const limax_diversity before = robots.diversity(set.data(), count);
    CHECK(before.genotype == plain.diversity(set.data(), count).genotype);
    CHECK(std::fabs(before.control - 0.5) < 0.05);

    const auto pairs = some_pairs(count, count);
    limax_breeding breeding = some_breeding();
    plain_children.breed(plain, pairs.data(), breeding, in_order, 0, count);
    children.breed(robots, pairs.data(), breeding, in_order, 0, count);
    CHECK(same_others(plain_children, children));
    breeding.mutation_rate = breeding.crossover_rate = breeding.elites = 0;
    breeding.control_mutation_rate = 1;
    children.breed(robots, pairs.data(), breeding, in_order, 0, count);
    for (int32_t child = 0; child < count; ++child)
        for (int32_t gene = 0; gene < all; ++gene)
            REQUIRE((children.genomes()[child * all + gene] ==
                     robots.genomes()[pairs[2 * std::size_t(child)] * all + gene]) ==
                    (gene < genes));
    CHECK(refused([&] {
              plain_children.breed(robots, pairs.data(), breeding, in_order, 0, count);
          }) == "the parents have 451 genes, the children 401");

    // a spread of 0 is 0, without a sign
    options.control_spread = 0;
    options.network = LIMAX_NETWORK_NONE;
    options.genes = 0;
    population passive(options.lattice, 1, code_of(options));
    passive.initialize(0, 0, 1, in_order);
    for (int32_t gene = 0; gene < 50; ++gene) CHECK_FALSE(std::signbit(passive.genomes()[gene]));
    options.control_genes = 0;
    CHECK(refused([&] { code_of(options); }) == "genes is 0; it must be 1 to 16777216");
    options.control_genes = 4097;
    CHECK(refused([&] { code_of(options); }) == "control_genes is 4097; it must be 0 to 4096");
}

TEST_CASE("crossover and mutation are independent of each other") {
    const limax::random_key key{42, 1, 3, 7, 11};
    constexpr uint32_t count = 200000;
    uint32_t crossed = 0, mutated = 0, both = 0;
    for (uint32_t gene = 0; gene < count; ++gene) {
        const float got = limax::child_gene({0.3, 0.1, 0.4}, key, gene, 0.0f, 1000.0f);
        const bool second = got > 500, changed = got != 0.0f && got != 1000.0f;
        crossed += second;
        mutated += changed;
        both += second && changed;
    }
    // within five standard errors
    for (const auto& [seen, share] :
         {std::pair{mutated, 0.3}, std::pair{crossed, 0.4}, std::pair{both, 0.12}})
        CHECK(std::fabs(double(seen) / count - share) < 5 * std::sqrt(share * (1 - share) / count));
    // a mutation is added in double and rounded once
    for (uint32_t gene = 0; gene < 2000; ++gene) {
        const float parent = 1.7f;
        const double deviate = limax::random_normal(key, 2 * gene + 1);
        REQUIRE(limax::child_gene({1, 0.3, 0}, key, gene, parent, 9.0f) ==
                static_cast<float>(std::fma(0.3, deviate, double(parent))));
    }
}

TEST_CASE("new genomes make the bodies of the same robots unknown") {
    population parents = make(20), children = make(20);
    parents.initialize(0, 0, 20, in_order);
    children.initialize(0, 0, 20, in_order);
    express_all(parents);
    express_all(children);
    children.breed(parents, some_pairs(20, 20).data(), some_breeding(), in_order, 5, 10);
    parents.initialize(0, 3, 1, in_order);
    for (int32_t robot = 0; robot < 20; ++robot) {
        CHECK((children.bodies()[robot].status == LIMAX_BODY_UNKNOWN) ==
              (robot >= 5 && robot < 15));
        CHECK((parents.bodies()[robot].status == LIMAX_BODY_UNKNOWN) == (robot == 3));
    }
}

TEST_CASE("breeding refuses wrong rates, parents and ranges") {
    population parents = make(20), children = make(20);
    limax_encoding_options smaller = defaults();
    smaller.hidden_count = 1;
    population strangers(smaller.lattice, 20, code_of(smaller));
    const auto with = [&](population& from, const limax_breeding& breeding, int32_t first) {
        auto pairs = some_pairs(20, 20);
        pairs[13] = first;
        return refused([&] { children.breed(from, pairs.data(), breeding, in_order, 0, 20); });
    };
    limax_breeding wrong = some_breeding();
    wrong.mutation_rate = 1.1;
    CHECK(with(parents, wrong, 0) == "mutation_rate is 1.1; it must be 0 to 1 per gene");
    wrong = some_breeding();
    wrong.elites = 21;
    CHECK(with(parents, wrong, 0) == "elites is 21; it must be 0 to 20");
    CHECK(with(parents, some_breeding(), 20) == "child 7: parent 21 does not exist; there are 20");
    CHECK(with(children, some_breeding(), 0) ==
          "children and parents are the same population; breeding needs two");
    CHECK(with(strangers, some_breeding(), 0) == "the parents have 308 genes, the children 401");
}

TEST_CASE("impossible populations and ranges are refused") {
    const int32_t huge[3] = {1000, 1000, 1000};
    CHECK(failure(LIMAX_OUT_OF_MEMORY, [&] {
              population(huge, 100000, nullptr);
          }).find("a population of 100000 robots on a lattice of 1000x1000x1000 voxels") == 0);
    limax_encoding_options options = defaults();
    options.network = LIMAX_NETWORK_NONE;
    options.genes = 500;
    population robots = make(3), by_hand(options.lattice, 3, nullptr),
               scripted(options.lattice, 3, code_of(options));
    CHECK(refused([&] { express_all(scripted); }).find("genomes of network \"none\"") == 0);
    CHECK(refused([&] { express_all(by_hand); }) ==
          "this population was made without an encoding: it has no genomes");
    CHECK(refused([&] { robots.check(paper(), {}, 2, 2147483647); }) ==
          "robots 3 to 2147483649 do not all exist; there are 3");
}
