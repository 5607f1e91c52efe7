// cuda_population_test.cpp: what happens to genomes and bodies on a GPU: its kernels compile for
// every architecture; where there is a GPU, everything comes out with the bits of the CPU.
#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include "abi.h"
#include "cuda_compiler.h"
#include "robots.h"

using namespace limax::cuda;
using namespace limax::test::abi;

namespace {

// Null, with a message, if there is no GPU.
handle<limax_device> found_gpu() {
    limax_device* gpu = nullptr;
    if (limax_device_create("cuda", 0, nullptr, &gpu) != LIMAX_OK)
        MESSAGE("skipped: ", std::string(limax_error_text()));
    return handle<limax_device>(gpu);
}

struct parity_case {
    const char* name;
    int32_t lattice[3];
    int32_t features;
    std::vector<int32_t> hidden;
    int32_t count;
    bool require_muscle;
    double sigma = 1;
    int32_t materials = 5;
    int32_t network = LIMAX_NETWORK_FOURIER;
    int32_t control_genes = 0;
};

limax_encoding_options options_of(const parity_case& example) {
    limax_encoding_options options{};
    std::copy_n(example.lattice, 3, options.lattice);
    options.features = example.features;
    options.sigma = example.sigma;
    options.hidden_count = int32_t(example.hidden.size());
    std::copy(example.hidden.begin(), example.hidden.end(), options.hidden);
    options.materials = example.materials;
    options.network = example.network;
    options.genes = 77;
    options.control_genes = example.control_genes;
    options.control_spread = 0.3;
    options.initial_scale = 2;
    options.seed = 0x123456789abcdef;
    options.repetition = 3;
    return options;
}

// One population on the CPU and one on the GPU.
struct pair_of_populations {
    explicit pair_of_populations(const parity_case& example, const limax_encoding* code)
        : count(example.count) {
        for (auto* each : {&cpu, &gpu})
            *each = made<limax_population>(limax_population_create, example.lattice, count, code);
        genes = limax_encoding_genes(code);
        voxels = example.lattice[0] * example.lattice[1] * example.lattice[2];
    }
    void check_genomes() const {
        std::vector<float> a(std::size_t(genes) * count), b(a.size());
        require_done(limax_population_read_genomes(cpu.get(), 0, count, a.data()));
        require_done(limax_population_read_genomes(gpu.get(), 0, count, b.data()));
        CHECK(std::memcmp(a.data(), b.data(), sizeof(float) * a.size()) == 0);
    }
    void check_descriptions() const {
        for (int32_t i = 0; i < count; ++i) {
            CAPTURE(i);
            const limax_body &a = limax_population_bodies(cpu.get())[i],
                             &b = limax_population_bodies(gpu.get())[i];
            REQUIRE(a.status == b.status);
            REQUIRE(a.hash == b.hash);
            REQUIRE(std::memcmp(&a, &b, sizeof a) == 0);
        }
    }
    void check_bodies() const {
        const std::size_t all = std::size_t(voxels) * count;
        CHECK(std::memcmp(limax_population_voxels(cpu.get()), limax_population_voxels(gpu.get()),
                          all) == 0);
        CHECK(std::memcmp(limax_population_weights(cpu.get()), limax_population_weights(gpu.get()),
                          3 * sizeof(float) * all) == 0);
    }
    void check_diversity(const std::vector<int32_t>& robots) const {
        limax_diversity a, b;
        require_done(
            limax_population_diversity(cpu.get(), robots.data(), int32_t(robots.size()), &a));
        require_done(
            limax_population_diversity(gpu.get(), robots.data(), int32_t(robots.size()), &b));
        CHECK(std::memcmp(&a, &b, sizeof a) == 0);
    }

    handle<limax_population> cpu, gpu;
    int32_t count, genes = 0, voxels = 0;
};

// Genomes that random ones never are: no number at all, in some genes, infinite; constant bodies.
void poison(limax_population* robots, int32_t genes, int32_t count, int32_t outputs) {
    float* genome = limax_population_genomes(robots);
    const auto of = [&](int32_t robot) { return genome + int64_t(robot) * genes; };
    if (count < 8) return;
    for (int32_t gene = 0; gene < genes; ++gene) of(1)[gene] = std::nanf("");
    for (int32_t gene = 0; gene < genes; gene += 3) of(2)[gene] = -std::nanf("0x1234");
    of(3)[genes / 2] = INFINITY;
    of(4)[0] = -INFINITY;
    std::fill_n(of(5), genes, 0.0f);  // empty
    std::fill_n(of(6), genes, 0.0f);
    of(6)[genes - outputs + 4] = 1;  // all bone
    std::fill_n(of(7), genes, 0.0f);
    of(7)[genes - outputs + 1] = 1e-42f;  // all muscle, by a subnormal
}

// Expressed, or described as they are if the genomes are for a script to express.
void make_bodies(const parity_case& example, limax_population* robots,
                 const limax_materials* materials, int32_t largest_part, limax_device* device,
                 int32_t first, int32_t count) {
    const int32_t muscle = example.require_muscle;
    require_done(example.network == LIMAX_NETWORK_NONE
                     ? limax_population_check(robots, materials, muscle, largest_part, first, count)
                     : limax_population_express(robots, materials, muscle, largest_part, device,
                                                first, count));
}

}  // namespace

TEST_CASE("the kernels between two simulations compile for the oldest and a new GPU") {
    if (!limax::test::found_compiler()) return;
    kernel_cache none{""};
    for (const int capability : {75, 90})
        for (const std::string entry : {"breed", "express", "describe", "diversity"}) {
            CAPTURE(capability);
            CAPTURE(entry);
            const auto binary = make_binary({entry, {}}, capability, {false, false, true}, none);
            CHECK(binary->log.empty());
        }
}

TEST_CASE("generations on the GPU equal those on the CPU bit for bit") {
    const handle<limax_device> gpu = found_gpu();
    if (!gpu) return;
    const auto cpu = made<limax_device>(limax_device_create, "cpu", 0, nullptr);
    const handle<limax_materials> materials = paper_table();
    const parity_case cases[] = {
        {"one voxel, no hidden layer", {1, 1, 1}, 3, {}, 12, false},
        {"5x5x5, the defaults", {5, 5, 5}, 16, {32, 32}, 200, true},
        {"5x5x5, one hidden layer", {5, 5, 5}, 7, {13}, 33, false},
        {"7x3x2, wide", {7, 3, 2}, 5, {100}, 20, true},
        {"2x9x4, wider than a block's memory", {2, 9, 4}, 4, {200, 300}, 9, false},
        {"20x20x20", {20, 20, 20}, 4, {12}, 9, true},
        {"a long row", {1, 1, 700}, 6, {9, 8, 7}, 10, false},
        // many high frequencies make bodies of many components
        {"small components", {6, 6, 6}, 24, {}, 60, false, 20},
        {"equal components", {9, 1, 1}, 12, {}, 200, false, 20},
        {"components of a large body", {40, 30, 20}, 16, {}, 3, false, 20},
        {"a CPPN", {5, 5, 5}, 0, {32, 32}, 60, true, 0, 5, LIMAX_NETWORK_CPPN},
        {"a CPPN of odd widths", {7, 1, 4}, 0, {13, 3}, 20, false, 0, 5, LIMAX_NETWORK_CPPN},
        {"a direct genome", {6, 5, 7}, 0, {}, 40, true, 0, 5, LIMAX_NETWORK_DIRECT},
        {"numbers of a script", {3, 3, 3}, 0, {}, 40, true, 0, 5, LIMAX_NETWORK_NONE},
        {"genes of control", {3, 3, 3}, 4, {9}, 40, true, 1, 5, LIMAX_NETWORK_FOURIER, 300},
    };
    for (const parity_case& example : cases) {
        CAPTURE(example.name);
        const limax_encoding_options options = options_of(example);
        const auto code = made<limax_encoding>(limax_encoding_create, &options);
        const pair_of_populations one(example, code.get()), other(example, code.get());
        const int32_t count = example.count;
        std::vector<int32_t> everyone = limax::test::everyone(count), half;
        for (int32_t i = count - 1; i >= count / 2; --i) half.push_back(i);

        const auto on_both = [&](const pair_of_populations& both) {
            return std::array{std::pair{both.cpu.get(), cpu.get()},
                              std::pair{both.gpu.get(), gpu.get()}};
        };
        for (const auto& [robots, device] : on_both(one)) {
            require_done(limax_population_initialize(robots, 0, device, 0, count));
            poison(robots, one.genes, count, example.materials + 3);
        }
        const pair_of_populations *now = &one, *next = &other;
        for (uint32_t generation = 1; generation <= 3; ++generation) {
            CAPTURE(generation);
            // in two ranges the second time
            const int32_t cut = generation == 2 ? count / 3 : 0;
            // all parts the last time
            const int32_t largest_part = generation < 3;
            for (const auto& [robots, device] : on_both(*now))
                for (const auto& [first, end] : {std::pair{0, cut}, std::pair{cut, count}})
                    make_bodies(example, robots, materials.get(), largest_part, device, first,
                                end - first);
            now->check_descriptions();
            now->check_diversity(everyone);
            now->check_diversity(half);

            const std::vector<int32_t> pairs = limax::test::some_pairs(count, count);
            limax_breeding breeding = limax::test::some_breeding();
            breeding.seed = 99;
            breeding.generation = generation;
            for (const int32_t first : {0, cut}) {
                const int32_t many = first < cut ? cut : count - first;
                require_done(limax_population_breed(next->cpu.get(), now->cpu.get(), pairs.data(),
                                                    &breeding, cpu.get(), first, many));
                require_done(limax_population_breed(next->gpu.get(), now->gpu.get(), pairs.data(),
                                                    &breeding, gpu.get(), first, many));
            }
            next->check_genomes();
            // views last: from here on the host's arrays count, and are sent again
            if (generation != 2) now->check_bodies();
            now->check_diversity(half);
            std::swap(now, next);
        }
        // first genomes of some robots
        for (const auto& [robots, device] : on_both(*now))
            require_done(limax_population_initialize(robots, 7, device, 1, (count + 1) / 2 - 1));
        now->check_genomes();
        // and some from memory
        const int32_t some = (count + 1) / 2;
        std::vector<float> genomes(std::size_t(now->genes) * std::size_t(some));
        require_done(limax_population_read_genomes(now->cpu.get(), 0, some, genomes.data()));
        for (limax_population* robots : {now->cpu.get(), now->gpu.get()})
            require_done(
                limax_population_write_genomes(robots, count - some, some, genomes.data()));
        now->check_genomes();
        // and back to the CPU
        for (limax_population* robots : {now->cpu.get(), now->gpu.get()})
            make_bodies(example, robots, materials.get(), 1, cpu.get(), 0, count);
        now->check_descriptions();
        now->check_bodies();
    }
}

TEST_CASE("device-resident bodies simulate like uploaded ones and stay on the GPU") {
    const handle<limax_device> gpu = found_gpu();
    if (!gpu) return;
    const handle<limax_materials> materials = paper_table();
    const parity_case example{"4x3x3", {4, 3, 3}, 8, {16}, 6, false};
    const limax_encoding_options options = options_of(example);
    const auto code = made<limax_encoding>(limax_encoding_create, &options);
    const auto land = made<limax_scene>(limax_scene_create);
    for (const char* effect : {"gravity", "ground", "actuation"})
        require_done(limax_scene_add(land.get(), effect));
    limax_simulation_options how;
    limax_simulation_defaults(&how);
    how.duration = 0.05;

    std::vector<limax_outcome> outcomes[2];
    for (const bool sent : {false, true}) {
        const auto robots = made<limax_population>(limax_population_create, example.lattice,
                                                   example.count, code.get());
        require_done(limax_population_initialize(robots.get(), 0, gpu.get(), 0, example.count));
        require_done(limax_population_express(robots.get(), materials.get(), 0, 1, gpu.get(), 0,
                                              example.count));
        if (sent) REQUIRE(limax_population_voxels(robots.get()) != nullptr);
        const auto run =
            made<limax_simulation>(limax_simulation_create, robots.get(), materials.get(),
                                   land.get(), &how, nullptr, gpu.get());
        // the population goes on before the first step, and ends
        require_done(limax_population_initialize(robots.get(), 0, gpu.get(), 2, 3));
        require_done(
            limax_population_express(robots.get(), materials.get(), 0, 1, gpu.get(), 2, 3));
        std::fill_n(limax_population_genomes(robots.get()), limax_encoding_genes(code.get()), 0.0f);
        require_done(limax_population_express(robots.get(), materials.get(), 0, 1, gpu.get(), 0,
                                              example.count));
        limax_progress progress{};
        while (!progress.finished)
            require_done(limax_simulation_advance(run.get(), 1, 0, &progress));
        const limax_outcome* all = limax_simulation_outcomes(run.get());
        outcomes[sent].assign(all, all + example.count);
    }
    int valid = 0;
    for (int32_t i = 0; i < example.count; ++i) {
        const limax_outcome &here = outcomes[0][i], &there = outcomes[1][i];
        CAPTURE(i);
        CHECK(here.status == there.status);
        CHECK(here.masses == there.masses);
        CHECK(here.step == there.step);
        for (int axis = 0; axis < 3; ++axis) CHECK(here.center_end[axis] == there.center_end[axis]);
        valid += here.status == LIMAX_ROBOT_DONE;
    }
    CHECK(valid > 1);
}
