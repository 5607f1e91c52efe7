// lattice_test.cpp: counts of masses and springs, and single ones against a body's columns. Their
// values are tested in tests/suites/engine/physics.lua.
#include <doctest/doctest.h>

#include "stage.h"

using namespace limax;
using namespace limax::test;

TEST_CASE("counts follow the lattice rule") {
    // per axis n sites: 3 n^2 (n-1) edges, 6 n (n-1)^2 face diagonals, 4 (n-1)^3 space diagonals
    for (int n = 1; n <= 6; ++n) {
        const stage cube(lattice{n, n, n});
        const spring_body body = cube.body();
        const int s = n + 1;
        CHECK(body.masses == s * s * s);
        CHECK(body.springs == 3 * s * s * n + 6 * s * n * n + 4 * n * n * n);
        const int32_t size[3] = {n, n, n};
        CHECK(count_masses(size, cube.setup.voxels.data()) == body.masses);
        CHECK(count_springs(size, cube.setup.voxels.data()) == body.springs);
    }
    CHECK(stage(lattice{1, 1, 1}).body().springs == 28);
    CHECK(stage(lattice{5, 5, 5}).body().springs == 1940);
}

TEST_CASE("single masses and springs have the bits of the body's columns") {
    for (uint32_t seed = 1; seed <= 12; ++seed) {
        stage random(lattice{3, 2, 4});
        random.randomize(seed, true);
        for (limax_material& material : random.setup.materials) material.stiffness_floor = 0.3;
        random.setup.options.sharing = seed % 2 ? LIMAX_SHARING_SUM : LIMAX_SHARING_MEAN;
        const spring_body body = random.body();
        std::vector<material_law> materials;
        for (const limax_material& material : random.setup.materials)
            materials.push_back(law_of(material));
        const voxel_body law{
            random.setup.grid,           random.setup.voxels.data(),
            random.setup.weights.data(), materials.data(),
            random.setup.options.edge,   random.setup.options.sharing == LIMAX_SHARING_SUM};
        // in reverse order, each from the voxels only
        int different = 0, springs = 0;
        for (int number = direction_count - 1; number >= 0; --number)
            for (int64_t site = law.grid.sites() - 1; site >= 0; --site) {
                const int x = int(site % (law.grid.nx + 1)),
                          y = int(site / (law.grid.nx + 1) % (law.grid.ny + 1)),
                          z = int(site / (law.grid.nx + 1) / (law.grid.ny + 1));
                const direction d = direction_at(number);
                const spring_parameters spring =
                    spring_between(law, x, y, z, d, site_mass(law, x, y, z),
                                   site_mass(law, x + d.x, y + d.y, z + d.z),
                                   [&](int64_t voxel) { return share_of(law, voxel); });
                const int64_t slot = number * body.count + site;
                springs += spring.owned;
                different += site_mass(law, x, y, z) != body.mass[site] ||
                             spring.stiffness != body.stiffness[slot] ||
                             spring.damping != body.damping[slot] ||
                             spring.sine != body.sine[slot] || spring.cosine != body.cosine[slot];
            }
        CHECK(different == 0);
        CHECK(springs == body.springs);
    }
}
