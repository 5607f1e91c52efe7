// abi.h: helpers for tests of the C ABI: handles that free themselves, checks of an expected error,
// and two small bodies on the ground.
#pragma once

#include <doctest/doctest.h>

#include <cstring>
#include <string>

#include "limax.h"

namespace limax::test::abi {

template <class T, void (*end)(T*)>
struct handle {
    T* it = nullptr;
    ~handle() { end(it); }
    operator T*() const { return it; }
};
using device = handle<limax_device, limax_device_free>;
using materials = handle<limax_materials, limax_materials_free>;
using population = handle<limax_population, limax_population_free>;
using scene = handle<limax_scene, limax_scene_free>;
using simulation = handle<limax_simulation, limax_simulation_free>;

// Checks a status and that the error text contains `part`.
inline void check_refused(limax_status status, limax_status expected, const char* part) {
    CHECK(status == expected);
    const std::string text = limax_error_text();
    CAPTURE(text);
    CHECK(text.find(part) != std::string::npos);
}

struct ready {
    device cpu;
    materials paper;
    population robots;
    scene land;

    ready() {
        REQUIRE(limax_device_create("cpu", 1, nullptr, &cpu.it) == LIMAX_OK);
        REQUIRE(limax_materials_load(LIMAX_SOURCE_DIR "/materials/paper.json", &paper.it) ==
                LIMAX_OK);
        const int32_t lattice[3] = {2, 2, 2};
        REQUIRE(limax_population_create(lattice, 2, nullptr, &robots.it) == LIMAX_OK);
        std::memset(limax_population_voxels(robots), 3, 16);
        for (int i = 0; i < 48; ++i) limax_population_weights(robots)[i] = 1;
        REQUIRE(limax_scene_create(&land.it) == LIMAX_OK);
        for (const char* effect : {"gravity", "ground"})
            REQUIRE(limax_scene_add(land, effect) == LIMAX_OK);
    }
    limax_simulation_options options() const {
        limax_simulation_options options;
        limax_simulation_defaults(&options);
        options.duration = 0.1;
        return options;
    }
    limax_status simulate(const limax_simulation_options& options, simulation& out) {
        return limax_simulation_create(robots, paper, land, &options, nullptr, cpu, &out.it);
    }
};

}  // namespace limax::test::abi
