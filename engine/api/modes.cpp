// modes.cpp: the natural modes of limax.h.
#include "physics/modes.h"

#include <algorithm>

#include "api/api.h"

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
    return limax::spring_body(limax::body_description{
        population.grid(), population.voxels() + robot * voxels,
        population.weights() + 3 * robot * voxels, table.data(), options.edge,
        limax_sharing(options.sharing),
        scene.has(limax::effects::index_of<limax::effects::damping>), false});
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

}  // extern "C"
