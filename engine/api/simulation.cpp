// simulation.cpp: simulations of limax.h, and what is checked before one begins.
#include <algorithm>
#include <exception>
#include <functional>
#include <utility>
#include <vector>

#include "api/api.h"
#include "base/fields.h"
#include "base/memory.h"
#include "physics/time_step.h"

namespace {

using limax::fail;
using limax::format;
using namespace limax::api;

// Holds a simulation for a call about one of its robots.
[[nodiscard]] std::unique_lock<std::shared_mutex> using_robot(const limax_simulation* simulation,
                                                              int32_t robot) {
    auto use = changing(simulation, "simulation");
    if (robot < 0 || robot >= simulation->count)
        fail(LIMAX_INVALID_ARGUMENT, format("robot %lld does not exist; there are %d",
                                            limax::from_one(robot), simulation->count));
    return use;
}

// Holds several simulations for `seconds`; refuses one that is null, listed twice or in use.
[[nodiscard]] std::vector<std::unique_lock<std::shared_mutex>> using_each(
    limax_simulation* const* simulations, int32_t count, double seconds) {
    require("simulations", simulations);
    limax::require_range("count", count, 0, 2147483647.0, "");
    limax::require_range("seconds", seconds, 0, 1e6, "s");
    std::vector<const limax_simulation*> sorted(simulations, simulations + count);
    std::sort(sorted.begin(), sorted.end(), std::less<>());
    // a null comes first
    if (!sorted.empty()) require("a simulation", sorted.front());
    if (std::adjacent_find(sorted.begin(), sorted.end()) != sorted.end())
        fail(LIMAX_INVALID_ARGUMENT, "one of the simulations is listed twice");
    std::vector<std::unique_lock<std::shared_mutex>> uses;
    uses.reserve(sorted.size());
    for (const limax_simulation* simulation : sorted)
        uses.push_back(changing(simulation, "a simulation"));
    return uses;
}

// Whether bodies on a device can be simulated without copying them to the host: all are described,
// and their materials are in the table.
bool all_fit(const limax::population& population, const limax::material_table& materials) {
    for (int32_t i = 0; i < population.count(); ++i) {
        const limax_body& body = population.bodies()[i];
        if (body.status == LIMAX_BODY_UNKNOWN) return false;
        for (int32_t m = materials.count(); m < LIMAX_MAX_MATERIALS; ++m)
            if (body.counts[m] > 0) return false;
    }
    return true;
}

// Refuses bodies on the host that changed since their last check.
void check_bodies(const limax::simulation_setup& setup, const limax::material_table& materials) {
    const int64_t voxels = setup.grid.voxels();
    for (int32_t i = 0; i < setup.count; ++i) {
        if (!setup.mask[i]) continue;
        const limax_body& body = setup.bodies[i];
        if (body.status == LIMAX_BODY_UNKNOWN)
            fail(LIMAX_INVALID_ARGUMENT, format("robot %d has no body: it must be expressed "
                                                "or checked before it is simulated",
                                                i + 1));
        if (body.status == LIMAX_BODY_VALID &&
            limax::body_hash(setup.grid, setup.voxels.data() + i * voxels) != body.hash)
            fail(LIMAX_INVALID_ARGUMENT,
                 format("robot %d was written to after its check: check it again", i + 1));
        const float* weights = setup.weights.data() + 3 * i * voxels;
        for (int64_t w = 0; w < 3 * voxels; ++w)
            if (!(weights[w] >= 0 && weights[w] <= 1))
                fail(
                    LIMAX_INVALID_ARGUMENT,
                    format("robot %d has a weight of %.9g; weights are 0 to 1", i + 1, weights[w]));
    }
    for (const uint8_t voxel : setup.voxels)
        if (voxel >= materials.count())
            fail(LIMAX_INVALID_ARGUMENT,
                 format("a body uses material index %d; the table '%s' has 0 to %d", voxel,
                        materials.name().c_str(), materials.count() - 1));
}

}  // namespace

limax::simulation_setup limax::api::make_setup(const limax::population& population,
                                               const limax::material_table& materials,
                                               const limax::scene& scene,
                                               const limax_simulation_options& options,
                                               const uint8_t* mask, const limax::device& device) {
    limax::check_options(options, scene);
    limax::simulation_setup setup;
    setup.options = options;
    setup.scene = scene;
    for (int32_t i = 0; i < materials.count(); ++i) setup.materials.push_back(materials.at(i));
    setup.grid = population.grid();
    setup.count = population.count();
    setup.bodies.assign(population.bodies(), population.bodies() + setup.count);
    for (int32_t i = 0; i < setup.count; ++i) setup.mask.push_back(mask ? mask[i] != 0 : 1);
    if (is_stored_on(population, device) && all_fit(population, materials))
        setup.bodies_on_device = population.bodies_on_device();
    if (!setup.bodies_on_device) {
        const int64_t voxels = setup.grid.voxels() * setup.count;
        setup.voxels = limax::array<uint8_t>(voxels);
        setup.weights = limax::array<float>(3 * voxels);
        std::copy_n(population.voxels(), voxels, setup.voxels.begin());
        std::copy_n(population.weights(), 3 * voxels, setup.weights.begin());
        check_bodies(setup, materials);
    }
    setup.control_genes = population.control_genes();
    if (setup.control_genes > 0) {
        const int64_t genes = population.genes(), of_control = setup.control_genes;
        std::vector<float> genomes(static_cast<std::size_t>(genes * setup.count));
        population.read_genomes(0, setup.count, genomes.data());
        for (int64_t i = 1; i <= setup.count; ++i) {
            const auto end = genomes.begin() + i * genes;
            setup.control.insert(setup.control.end(), end - of_control, end);
        }
    }
    if (scene.controller().genes > setup.control_genes)
        fail(LIMAX_INVALID_ARGUMENT,
             format("scene.control reads %d genes of control; the robots have %d",
                    scene.controller().genes, setup.control_genes));
    // a fixed step is refused here rather than by the first robot that is prepared, and so are
    // traces that would not fit; the number of samples does not depend on the step
    const limax::schedule plan = limax::make_schedule(options, scene, setup.grid, 1.0);
    double traces = 0;
    for (int32_t i = 0; i < setup.count; ++i)
        for (int32_t kind = 0; setup.mask[i] && kind < LIMAX_TRACE_KINDS; ++kind)
            traces += double(plan.samples[kind]) *
                      double(limax::trace_width(kind, setup.bodies[i].masses, setup.grid.voxels(),
                                                scene)) *
                      sizeof(double);
    limax::require_memory("record: the traces of this population", traces);
    return setup;
}

extern "C" {

// ---- simulation ----

void limax_simulation_defaults(limax_simulation_options* out) {
    guard([&] {
        require("out", out);
        *out = {};
        out->integrator = LIMAX_LEAPFROG;
        out->precision = LIMAX_COMPENSATED;
        out->sharing = LIMAX_SHARING_MEAN;
        out->bound = LIMAX_BOUND_SPRINGS;
        const auto value = [](const char* name) {
            return limax::field_named(limax::simulation_fields, name).value[0];
        };
        out->duration = value("duration");
        out->bound_fraction = value("bound_fraction");
        out->edge = value("edge");
        out->max_speed = value("max_speed");
        out->max_stretch = value("max_stretch");
    });
}
limax_status limax_simulation_create(const limax_population* population,
                                     const limax_materials* materials, const limax_scene* scene,
                                     const limax_simulation_options* options, const uint8_t* mask,
                                     limax_device* device, limax_simulation** out) {
    return change(population, "population", [&] {
        const auto materials_use = reading(materials, "materials");
        const auto scene_use = reading(scene, "scene");
        require("options, device, out", options, device, out);
        auto setup =
            make_setup(population->it, materials->it, scene->it, *options, mask, *device->it);
        // const access leaves the bodies on the device
        const limax::population& bodies = population->it;
        auto overlap = limax::find_overlap(bodies.grid(), *options, scene->it, setup.mask,
                                           [&] { return bodies.voxels(); });
        *out = new limax_simulation{device->it, device->it->simulate(std::move(setup)),
                                    population->it.count(), *options, std::move(overlap)};
    });
}
void limax_simulation_free(limax_simulation* simulation) { delete simulation; }
limax_status limax_simulation_advance(limax_simulation* simulation, double seconds, int64_t steps,
                                      limax_progress* out) {
    return change(simulation, "simulation", [&] {
        require("out", out);
        limax::require_range("seconds", seconds, 0, 1e6, "s");
        limax::require_range("steps", double(steps), 0, 9223372036854775807.0, "");
        *out = simulation->it->advance(seconds, steps);
    });
}
limax_status limax_simulations_begin(limax_simulation* const* simulations, int32_t count,
                                     double seconds) {
    return guard([&] {
        const auto uses = using_each(simulations, count, seconds);
        for (int32_t i = 0; i < count; ++i) simulations[i]->it->enqueue(seconds);
    });
}
limax_status limax_simulations_advance(limax_simulation* const* simulations, int32_t count,
                                       double seconds, limax_progress* out) {
    return guard([&] {
        require("out", out);
        const auto uses = using_each(simulations, count, seconds);
        // what was sent to a GPU is collected even if another simulation fails
        std::exception_ptr failure;
        int32_t sent = 0;
        const auto attempt = [&](const auto& work) {
            try {
                work();
            } catch (...) {
                if (!failure) failure = std::current_exception();
            }
        };
        for (; sent < count && !failure; ++sent)
            attempt([&] { simulations[sent]->it->enqueue(seconds / count); });
        for (int32_t i = 0; i < sent; ++i) attempt([&] { out[i] = simulations[i]->it->collect(); });
        if (failure) std::rethrow_exception(failure);
    });
}
limax_status limax_simulation_overlap(const limax_simulation* simulation, limax_overlap* out) {
    return guard([&] {
        const auto use = reading(simulation, "simulation");
        require("out", out);
        const limax::overlap& found = simulation->overlap;
        *out = {found.subject.c_str(), found.obstacle.c_str(), found.depth, found.robots};
    });
}
const limax_outcome* limax_simulation_outcomes(const limax_simulation* simulation) {
    return value_or<const limax_outcome*>(nullptr, simulation, "simulation",
                                          [&] { return simulation->it->outcomes(); });
}
limax_status limax_simulation_trace(const limax_simulation* simulation, int32_t robot, int32_t kind,
                                    const double** data, int64_t* samples, int64_t* width) {
    return guard([&] {
        const auto use = using_robot(simulation, robot);
        require("data, samples, width", data, samples, width);
        if (kind < 0 || kind >= LIMAX_TRACE_KINDS || simulation->options.record[kind] == 0)
            fail(LIMAX_INVALID_ARGUMENT, format("trace kind %d is not recorded", kind));
        simulation->it->trace(robot, kind, data, samples, width);
    });
}
limax_status limax_simulation_describe(limax_simulation* simulation, const char** out) {
    return change(simulation, "simulation", [&] {
        require("out", out);
        *out = simulation->it->describe();
    });
}
limax_status limax_simulation_sites(const limax_simulation* simulation, int32_t robot,
                                    const int32_t** sites) {
    return guard([&] {
        const auto use = using_robot(simulation, robot);
        require("sites", sites);
        *sites = simulation->it->sites(robot);
        if (*sites) return;
        // asking for its state prepares a robot, or refuses one that is not simulated
        simulation->it->state(robot, nullptr, nullptr);
        *sites = simulation->it->sites(robot);
    });
}
limax_status limax_simulation_place(limax_simulation* simulation, int32_t robot,
                                    const double* positions, const double* velocities) {
    return guard([&] {
        const auto use = using_robot(simulation, robot);
        simulation->it->place(robot, positions, velocities);
    });
}
limax_status limax_simulation_state(const limax_simulation* simulation, int32_t robot,
                                    double* positions, double* velocities) {
    return guard([&] {
        const auto use = using_robot(simulation, robot);
        simulation->it->state(robot, positions, velocities);
    });
}

limax_status limax_simulation_block(const limax_simulation* simulation, int32_t robot,
                                    int32_t which, double* out) {
    return guard([&] {
        const auto use = using_robot(simulation, robot);
        require("out", out);
        simulation->it->block(robot, which, out);
    });
}

limax_status limax_simulation_set_state(limax_simulation* simulation, int32_t robot, int32_t state,
                                        const double* values) {
    return guard([&] {
        const auto use = using_robot(simulation, robot);
        require("values", values);
        simulation->it->set_state(robot, state, values);
    });
}

}  // extern "C"
