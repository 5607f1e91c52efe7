// robots.h: small populations for tests, and two ways to run a parallel loop.
#pragma once

#include <cstring>
#include <memory>
#include <numeric>
#include <thread>
#include <vector>

#include "backend/cpu/passes.h"
#include "genome/population.h"

namespace limax::test {

inline const parallel_for in_order = [](int count, const std::function<void(int)>& work) {
    for (int i = 0; i < count; ++i) work(i);
};
// In reverse order, each index on its own thread.
inline const parallel_for scattered = [](int count, const std::function<void(int)>& work) {
    std::vector<std::thread> threads;
    for (int i = count - 1; i >= 0; --i) threads.emplace_back([&work, i] { work(i); });
    for (std::thread& thread : threads) thread.join();
};

inline const material_table& paper() {
    static const material_table table =
        material_table::load(LIMAX_SOURCE_DIR "/materials/paper.json");
    return table;
}

inline limax_encoding_options defaults(uint64_t seed = 1) {
    limax_encoding_options options = {};
    options.lattice[0] = 5;
    options.lattice[1] = 4;
    options.lattice[2] = 3;
    options.features = 8;
    options.sigma = 1;
    options.hidden_count = 2;
    options.hidden[0] = 12;
    options.hidden[1] = 9;
    options.materials = 5;
    options.initial_scale = 1;
    options.seed = seed;
    options.repetition = 1;
    return options;
}

inline std::shared_ptr<const encoding> code_of(const limax_encoding_options& options) {
    return std::make_shared<const encoding>(options);
}

inline population make(int32_t count, uint64_t seed = 1) {
    return population(defaults().lattice, count, code_of(defaults(seed)));
}

inline void express_all(population& robots, bool require_muscle = false) {
    robots.express(paper(), {require_muscle, true}, cpu::choose_passes(nullptr).express, in_order,
                   0, robots.count());
}

inline bool same_genomes(const population& a, const population& b) {
    return std::memcmp(a.genomes(), b.genomes(),
                       sizeof(float) * std::size_t(a.genes()) * std::size_t(a.count())) == 0;
}
inline bool same_bodies(const population& a, const population& b) {
    const auto voxels = std::size_t(a.grid().voxels() * a.count());
    return std::memcmp(a.voxels(), b.voxels(), voxels) == 0 &&
           std::memcmp(a.weights(), b.weights(), 3 * sizeof(float) * voxels) == 0 &&
           std::memcmp(a.bodies(), b.bodies(), sizeof(limax_body) * std::size_t(a.count())) == 0;
}

inline std::vector<int32_t> some_pairs(int32_t children, int32_t parents) {
    std::vector<int32_t> pairs;
    pairs.reserve(2 * static_cast<std::size_t>(children));
    for (int32_t k = 0; k < 2 * children; ++k) pairs.push_back(k * 7 % parents);
    return pairs;
}

inline limax_breeding some_breeding() {
    limax_breeding breeding = {};
    breeding.mutation_rate = 0.1;
    breeding.mutation_scale = 0.1;
    breeding.control_mutation_rate = 0.5;
    breeding.control_mutation_scale = 0.2;
    breeding.crossover_rate = 0.4;
    breeding.seed = 1;
    breeding.repetition = 1;
    breeding.generation = 1;
    breeding.elites = 3;
    return breeding;
}

inline std::vector<int32_t> everyone(int32_t count) {
    std::vector<int32_t> robots(static_cast<std::size_t>(count));
    std::iota(robots.begin(), robots.end(), 0);
    return robots;
}

}  // namespace limax::test
