// population_device_test.cpp: populations stored on a device, and what is copied to it and back,
// with a fake device that works on the host and counts the copies.
#include <doctest/doctest.h>

#include <cmath>
#include <cstring>

#include "failure.h"
#include "robots.h"

using namespace limax::test;
using limax::population;

namespace {

// Copies between host and device, of everything.
struct traffic {
    int sent_genomes = 0, sent_bodies = 0, fetched_genomes = 0, fetched_bodies = 0, cleared = 0;
    bool operator==(const traffic&) const = default;
};

struct copied_bodies final : limax::device_bodies {
    copied_bodies(const population& robots, traffic& seen) : seen(seen) {
        const auto voxels_of_all = std::size_t(robots.grid().voxels() * robots.count());
        voxels.assign(robots.voxels(), robots.voxels() + voxels_of_all);
        weights.assign(robots.weights(), robots.weights() + 3 * voxels_of_all);
    }
    void fetch(uint8_t* to, float* to_weights) const override {
        ++seen.fetched_bodies;
        std::copy(voxels.begin(), voxels.end(), to);
        std::copy(weights.begin(), weights.end(), to_weights);
    }
    traffic& seen;
    std::vector<uint8_t> voxels;
    std::vector<float> weights;
};

// Its memory is a population that stays on the host.
struct fake_device_population final : limax::device_population {
    explicit fake_device_population(const population& robots)
        : twin(grid_of(robots).data(), robots.count(), robots.code()) {
        // memory is not initialised
        std::fill_n(twin.genomes(), twin.genes() * twin.count(), std::nanf(""));
        std::fill_n(twin.voxels(), twin.grid().voxels() * twin.count(), uint8_t(77));
    }
    static std::array<int32_t, 3> grid_of(const population& robots) {
        return {robots.grid().nx, robots.grid().ny, robots.grid().nz};
    }
    std::size_t genes() const { return std::size_t(twin.genes()); }
    std::size_t voxels() const { return std::size_t(twin.grid().voxels()); }

    void clear_genomes() override {
        ++seen.cleared;
        std::fill_n(twin.genomes(), twin.genes() * twin.count(), 0.0f);
    }
    void clear_bodies() override {
        ++seen.cleared;
        std::fill_n(twin.voxels(), voxels() * twin.count(), uint8_t(0));
        std::fill_n(twin.weights(), 3 * voxels() * twin.count(), 0.0f);
    }
    void send_genomes(const float* from, int32_t first, int32_t count) override {
        ++seen.sent_genomes;
        std::copy_n(from, genes() * count, twin.genomes() + first * genes());
    }
    void send_bodies(const uint8_t* from, const float* weights) override {
        ++seen.sent_bodies;
        std::copy_n(from, voxels() * twin.count(), twin.voxels());
        std::copy_n(weights, 3 * voxels() * twin.count(), twin.weights());
    }
    void fetch_genomes(float* to, int32_t first, int32_t count) const override {
        ++seen.fetched_genomes;
        const population& from = twin;
        std::copy_n(from.genomes() + first * genes(), count * genes(), to);
    }
    void initialize(uint32_t generation, int32_t before, int32_t first, int32_t count) override {
        twin.number(before);
        twin.initialize(generation, first, count, in_order);
    }
    void breed(const limax::device_population& parents, const int32_t* pairs,
               const limax_breeding& breeding, int32_t before, int32_t first,
               int32_t count) override {
        twin.number(before);
        std::vector<int32_t> all(2 * std::size_t(twin.count()));
        std::copy_n(pairs, 2 * count, all.begin() + 2 * first);
        twin.breed(dynamic_cast<const fake_device_population&>(parents).twin, all.data(), breeding,
                   in_order, first, count);
    }
    void express(bool largest_part, int32_t first, int32_t count, limax_body* bodies) override {
        twin.express(paper(), {false, largest_part}, limax::cpu::choose_passes(nullptr).express,
                     in_order, first, count);
        std::copy_n(twin.bodies() + first, count, bodies);
        for (int32_t k = 0; k < count; ++k) bodies[k].status = LIMAX_BODY_UNKNOWN;
    }
    // sums of a GPU are compared in cuda_population_test.cpp
    void count_materials(const int32_t*, int32_t, int64_t*) const override {
        FAIL("not asked for");
    }
    uint32_t largest_gene(const int32_t*, int32_t) const override {
        FAIL("not asked for");
        return 0;
    }
    void sum_genes(const int32_t*, int32_t, double, int64_t*) const override {
        FAIL("not asked for");
    }
    std::shared_ptr<const limax::device_bodies> bodies() const override {
        return std::make_shared<copied_bodies>(twin, seen);
    }

    population twin;
    mutable traffic seen;
};

std::shared_ptr<fake_device_population> move_out(const population& robots) {
    auto stored = std::make_shared<fake_device_population>(robots);
    robots.move_to(stored);
    return stored;
}

}  // namespace

TEST_CASE("generations on a device are those of the host and copy nothing that is not requested") {
    population host_parents = make(20), host_children = make(20);
    population parents = make(20), children = make(20);
    const auto stored = move_out(parents), nursery = move_out(children);
    const auto pairs = some_pairs(20, 20);
    for (int generation = 0; generation < 3; ++generation) {
        for (population* robots : {&host_parents, &parents}) {
            if (generation == 0) robots->initialize(0, 0, 20, in_order);
            robots->express(paper(), {true, true}, limax::cpu::choose_passes(nullptr).express,
                            in_order, 0, 20);
        }
        host_children.breed(host_parents, pairs.data(), some_breeding(), in_order, 0, 20);
        children.breed(parents, pairs.data(), some_breeding(), in_order, 0, 20);
        CHECK(std::memcmp(parents.bodies(), host_parents.bodies(), 20 * sizeof(limax_body)) == 0);
        CHECK(parents.bodies_on_device());
        CHECK(stored->seen == traffic{});
        CHECK(nursery->seen == traffic{});
        host_parents.breed(host_children, pairs.data(), some_breeding(), in_order, 0, 20);
        parents.breed(children, pairs.data(), some_breeding(), in_order, 0, 20);
    }
    CHECK(parents.bodies()[0].status == LIMAX_BODY_UNKNOWN);  // bred, not expressed
    std::vector<float> some(3 * std::size_t(parents.genes()));
    parents.read_genomes(5, 3, some.data());
    CHECK(std::equal(some.begin(), some.end(), host_parents.genomes() + 5 * parents.genes()));
    CHECK(stored->seen == traffic{0, 0, 1, 0, 0});
    // reading once brings everything here, and the device keeps counting
    for (int i = 0; i < 2; ++i) CHECK(same_genomes(parents, host_parents));
    CHECK(stored->seen == traffic{0, 0, 2, 0, 0});
    children.breed(parents, pairs.data(), some_breeding(), in_order, 0, 20);
    CHECK(stored->seen == traffic{0, 0, 2, 0, 0});
    CHECK(refused([&] { parents.read_genomes(18, 3, some.data()); }) ==
          "robots 19 to 21 do not all exist; there are 20");

    // writing sends these alone
    for (population* each : {&parents, &host_parents}) each->write_genomes(9, 3, some.data());
    for (int i = 0; i < 2; ++i) CHECK(same_genomes(parents, host_parents));
    CHECK(stored->seen == traffic{1, 0, 3, 0, 0});
    CHECK(refused([&] { parents.write_genomes(18, 3, some.data()); }) ==
          "robots 19 to 21 do not all exist; there are 20");
}

TEST_CASE("a device gets values written before and after the move") {
    population robots = make(4), expected = make(4), children = make(4);
    for (population* each : {&robots, &expected}) each->initialize(0, 0, 4, in_order);
    const auto stored = move_out(robots);
    express_all(robots);
    express_all(expected);
    CHECK(stored->seen == traffic{1, 0, 0, 0, 0});
    express_all(robots);
    CHECK(stored->seen == traffic{1, 0, 0, 0, 0});

    // a pointer that somebody holds may be written through at any time
    float* genes = robots.genomes();
    for (const float value : {0.5f, -0.5f}) {
        for (population* each : {&robots, &expected}) {
            (each == &robots ? genes : expected.genomes())[7] = value;
            express_all(*each);
        }
        CHECK(same_bodies(robots, expected));
    }
    CHECK(stored->seen.sent_genomes == 3);
    CHECK(stored->seen.fetched_genomes == 0);

    // the same of bodies: the host's count until the device writes them
    CHECK(robots.bodies_on_device());
    robots.voxels()[3] = uint8_t(robots.voxels()[3] == 1 ? 2 : 1);
    CHECK_FALSE(robots.bodies_on_device());
    robots.check(paper(), {}, 0, 4);
    CHECK(robots.bodies()[0].hash == limax::body_hash(robots.grid(), robots.voxels()));
    // a device that writes some robots gets the others as the host has them
    const std::vector<uint8_t> before(robots.voxels(), robots.voxels() + 60);
    robots.express(paper(), {false, true}, nullptr, nullptr, 1, 3);
    CHECK(stored->seen.sent_bodies == 1);
    CHECK(robots.bodies_on_device());
    CHECK(std::memcmp(robots.voxels(), before.data(), 60) == 0);
}

TEST_CASE("a population that moves back, or to another device, keeps its values") {
    population robots = make(6), expected = make(6), children = make(6),
               expected_children = make(6);
    for (population* each : {&robots, &expected}) each->initialize(0, 0, 6, in_order);
    std::weak_ptr<fake_device_population> left = move_out(robots);
    express_all(robots);
    express_all(expected);
    const auto next = move_out(robots);
    CHECK(left.expired());
    CHECK(same_bodies(robots, expected));
    CHECK(next->seen == traffic{});
    express_all(robots);
    CHECK(next->seen == traffic{1, 0, 0, 0, 0});

    // parents on a device, children on the host
    const auto pairs = some_pairs(6, 6);
    children.breed(robots, pairs.data(), some_breeding(), in_order, 0, 6);
    expected_children.breed(expected, pairs.data(), some_breeding(), in_order, 0, 6);
    CHECK(same_genomes(children, expected_children));
    // and the other way round
    const auto nursery = move_out(children);
    children.breed(expected, pairs.data(), some_breeding(), in_order, 2, 4);
    expected_children.breed(expected, pairs.data(), some_breeding(), in_order, 2, 4);
    CHECK(same_genomes(children, expected_children));

    robots.move_to(nullptr);
    CHECK(robots.on_device() == nullptr);
    CHECK_FALSE(robots.bodies_on_device());
    CHECK(same_genomes(robots, expected));
    CHECK(same_bodies(robots, expected));
    express_all(robots);
    CHECK(same_bodies(robots, expected));
}
