// modes.cpp: the natural modes and the slopes of scripted forces of limax.h.
#include "physics/modes.h"

#include <algorithm>

#include "api/api.h"
#include "physics/scripted/stiffness.h"

namespace {

using namespace limax::api;

// Masses and springs of a robot, as a simulation makes them.
limax::spring_body body_of(limax::population& population, int32_t robot,
                           const limax::material_table& materials, const limax::scene& scene,
                           const limax_simulation_options& options) {
    if (robot < 0 || robot >= population.count())
        limax::fail(LIMAX_INVALID_ARGUMENT,
                    limax::format("robot %lld does not exist; there are %d", limax::from_one(robot),
                                  population.count()));
    if (population.bodies()[robot].status != LIMAX_BODY_VALID)
        limax::fail(LIMAX_INVALID_ARGUMENT,
                    limax::format("robot %lld has no valid body", limax::from_one(robot)));
    std::vector<limax_material> table;
    table.reserve(std::size_t(materials.count()));
    for (int32_t i = 0; i < materials.count(); ++i) table.push_back(materials.at(i));
    const int64_t voxels = population.grid().voxels();
    return limax::spring_body(
        limax::body_description{population.grid(), population.voxels() + robot * voxels,
                                population.weights() + 3 * robot * voxels, table.data(),
                                options.edge, limax_sharing(options.sharing),
                                scene.has(limax::effects::index_of<limax::effects::damping>),
                                scene.has(limax::effects::index_of<limax::effects::actuation>)});
}

}  // namespace

extern "C" {

limax_status limax_modes(limax_population* population, int32_t robot,
                         const limax_materials* materials, const limax_scene* scene,
                         const limax_simulation_options* options, const double* positions,
                         int32_t count, limax_mode* modes, double* shapes, int32_t* found,
                         int32_t* rigid) {
    return change(population, "population", [&] {
        const auto materials_use = reading(materials, "materials");
        const auto scene_use = reading(scene, "scene");
        require("options, modes, shapes, found, rigid", options, modes, shapes, found, rigid);
        limax::require_range("count", count, 1, 1e6, "");
        limax::check_options(*options, scene->it);
        const limax::natural_modes result =
            limax::modes_of(body_of(population->it, robot, materials->it, scene->it, *options),
                            scene->it, positions, count);
        std::copy(result.modes.begin(), result.modes.end(), modes);
        std::copy(result.shapes.begin(), result.shapes.end(), shapes);
        *found = int32_t(result.modes.size());
        *rigid = result.rigid;
    });
}
limax_status limax_script_slopes(limax_population* population, int32_t robot,
                                 const limax_materials* materials, const limax_scene* scene,
                                 const limax_simulation_options* options, const double* positions,
                                 const double* velocities, double time, limax_script_slope* out,
                                 int32_t* count) {
    return change(population, "population", [&] {
        const auto materials_use = reading(materials, "materials");
        const auto scene_use = reading(scene, "scene");
        require("options, positions, velocities", options, positions, velocities);
        require("out, count", out, count);
        const limax::spring_body body =
            body_of(population->it, robot, materials->it, scene->it, *options);
        // small beside a voxel, large beside the rounding of a force
        constexpr double share_of_edge = 1e-4;
        *count = 0;
        for (const limax::scripted_effect& script : scene->it.scripts()) {
            limax_script_slope& slope = out[(*count)++];
            slope = {script.name.c_str(),
                     script.bounded,
                     script.bound.stiffness,
                     script.bound.damping,
                     0,
                     0};
            for (int32_t i = 0; i < body.masses; ++i) {
                const double *x = positions + 3 * i, *v = velocities + 3 * i;
                const double in[limax::scripted::force_inputs] = {
                    x[0], x[1], x[2], v[0], v[1], v[2], body.mass[body.sites[i]], time};
                const auto most =
                    limax::scripted::steepness(script.law, in, share_of_edge * options->edge);
                slope.stiffness = std::max(slope.stiffness, most.stiffness);
                slope.damping = std::max(slope.damping, most.damping);
            }
        }
    });
}

}  // extern "C"
