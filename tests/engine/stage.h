// stage.h: small scenes for the physics tests: one body per robot, run on the CPU device through
// the backend's own interface.
#pragma once

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "backend/cpu/device.h"
#include "backend/cpu/robot.h"
#include "body/material.h"

namespace limax::test {

// The paper's materials, by index: 0 empty, 1 expanding, 2 contracting, 3 soft, 4 bone. Weights may
// take all of their stiffness.
inline std::vector<limax_material> paper_materials() {
    const auto table = material_table::load(LIMAX_SOURCE_DIR "/materials/paper.json");
    std::vector<limax_material> materials;
    for (int32_t i = 0; i < table.count(); ++i) {
        materials.push_back(table.at(i));
        materials.back().stiffness_floor = 0;
    }
    return materials;
}

inline limax_simulation_options default_options() {
    limax_simulation_options options{};
    options.integrator = LIMAX_LEAPFROG;
    options.precision = LIMAX_DOUBLE;
    options.duration = 1.0;
    options.bound_fraction = 0.9;
    options.edge = 0.1;
    options.max_speed = 1000.0;
    options.max_stretch = 10.0;
    return options;
}

inline constexpr int every_precision[] = {LIMAX_SINGLE, LIMAX_COMPENSATED, LIMAX_DOUBLE};

// Numbers between -1 and 1, the same at every run.
struct draws {
    uint32_t state;
    double operator()() {
        return double((state = state * 1664525u + 1013904223u) >> 8) / double(1 << 23) - 1;
    }
};

// A population of bodies with equal lattice, to be filled in and run.
struct stage {
    simulation_setup setup;

    explicit stage(lattice grid, int count = 1, uint8_t material = 4) {
        setup.options = default_options();
        setup.materials = paper_materials();
        setup.grid = grid;
        setup.count = count;
        setup.voxels = array<uint8_t>(count * grid.voxels());
        setup.weights = array<float>(3 * count * grid.voxels());
        for (uint8_t& voxel : setup.voxels) voxel = material;
        for (float& weight : setup.weights) weight = 1.0f;
        setup.bodies.assign(count, limax_body{});
        setup.mask.assign(count, 1);
    }

    stage& effects(const std::vector<std::string>& names) {
        for (const std::string& name : names) setup.scene.add(name);
        return *this;
    }
    stage& set(const char* effect, const char* field, std::vector<double> values) {
        setup.scene.set(effect, field, values.data(), static_cast<int>(values.size()));
        return *this;
    }
    // Random materials (no empty voxel unless `holes`) and weights, the same for the same seed.
    stage& randomize(uint32_t seed, bool holes = false) {
        uint32_t state = seed * 2654435761u + 1;
        const auto draw = [&] { return (state = state * 1664525u + 1013904223u) >> 8; };
        for (uint8_t& voxel : setup.voxels)
            voxel = static_cast<uint8_t>(holes ? draw() % 5 : 1 + draw() % 4);
        for (float& weight : setup.weights)
            weight = 0.2f + 0.8f * static_cast<float>(draw() % 1000) / 999.0f;
        return *this;
    }
    // A copy of the setup whose bodies are marked as checked.
    simulation_setup checked() const {
        simulation_setup ready;
        ready.options = setup.options;
        ready.scene = setup.scene;
        ready.materials = setup.materials;
        ready.grid = setup.grid;
        ready.count = setup.count;
        ready.voxels = array<uint8_t>(setup.voxels.size());
        ready.weights = array<float>(setup.weights.size());
        std::copy(setup.voxels.begin(), setup.voxels.end(), ready.voxels.begin());
        std::copy(setup.weights.begin(), setup.weights.end(), ready.weights.begin());
        ready.bodies = setup.bodies;
        ready.mask = setup.mask;
        const int32_t size[3] = {ready.grid.nx, ready.grid.ny, ready.grid.nz};
        for (int i = 0; i < ready.count; ++i) {
            const uint8_t* voxels = ready.voxels.data() + i * ready.grid.voxels();
            ready.bodies[i].status = LIMAX_BODY_VALID;
            ready.bodies[i].masses = count_masses(size, voxels);
            ready.bodies[i].springs = count_springs(size, voxels);
        }
        return ready;
    }
    std::unique_ptr<simulation> open(int threads = 1, const char* isa = "") const {
        return cpu::make_cpu_device(threads, isa)->simulate(checked());
    }
    std::unique_ptr<simulation> run(int threads = 1, const char* isa = "") const {
        auto result = open(threads, isa);
        finish(*result);
        return result;
    }
    static void finish(simulation& simulation) {
        while (!simulation.advance(1.0, 0).finished) {
        }
    }
    // Masses and springs of robot `index`, as the simulation makes them.
    spring_body body(int index = 0) const {
        return spring_body(body_description{
            setup.grid, setup.voxels.data() + index * setup.grid.voxels(),
            setup.weights.data() + 3 * index * setup.grid.voxels(), setup.materials.data(),
            setup.options.edge, limax_sharing(setup.options.sharing), true, true});
    }
};

struct trace_view {
    const double* data;
    int64_t samples, width;
    double at(int64_t sample, int64_t column) const { return data[sample * width + column]; }
};

inline trace_view trace_of(const simulation& simulation, int robot, int kind) {
    trace_view view{};
    simulation.trace(robot, kind, &view.data, &view.samples, &view.width);
    return view;
}

// Positions and velocities of a robot at its current time, [mass][3] each.
struct snapshot {
    std::vector<double> positions, velocities;
};
inline snapshot state_of(simulation& simulation, int robot = 0) {
    const std::size_t size = 3 * simulation.outcomes()[robot].masses;
    snapshot result{std::vector<double>(size), std::vector<double>(size)};
    simulation.state(robot, result.positions.data(), result.velocities.data());
    return result;
}

}  // namespace limax::test
