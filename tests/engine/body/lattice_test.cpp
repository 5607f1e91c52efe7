// lattice_test.cpp: counts of masses and springs, who owns what, and the parameters that follow.
#include <doctest/doctest.h>

#include <set>

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

TEST_CASE("counts of bodies with holes agree with an explicit list of voxel corners and pairs") {
    for (uint32_t seed = 1; seed <= 20; ++seed) {
        stage random(lattice{3, 4, 2});
        random.randomize(seed, true);
        std::set<int64_t> sites;
        std::set<std::pair<int64_t, int64_t>> springs;
        const lattice grid = random.setup.grid;
        for (int z = 0; z < grid.nz; ++z)
            for (int y = 0; y < grid.ny; ++y)
                for (int x = 0; x < grid.nx; ++x) {
                    if (random.setup.voxels[grid.voxel(x, y, z)] == 0) continue;
                    int64_t corners[8];
                    for (int c = 0; c < 8; ++c)
                        corners[c] = grid.site(x + (c & 1), y + (c >> 1 & 1), z + (c >> 2));
                    for (int a = 0; a < 8; ++a) {
                        sites.insert(corners[a]);
                        for (int b = a + 1; b < 8; ++b)
                            springs.insert({std::min(corners[a], corners[b]),
                                            std::max(corners[a], corners[b])});
                    }
                }
        const spring_body body = random.body();
        CHECK(body.masses == static_cast<int>(sites.size()));
        CHECK(body.springs == static_cast<int>(springs.size()));
    }
}

TEST_CASE("a shared spring is one spring with the mean of its owners, or their sum") {
    stage pair(lattice{2, 1, 1});
    pair.setup.voxels[0] = 3;  // soft, 1e3 N/m
    pair.setup.voxels[1] = 4;  // bone, 1e4 N/m
    const auto shared_edge = [&](const spring_body& body) {
        return body.stiffness[2 * body.count +
                              pair.setup.grid.site(1, 0, 0)];  // up from the face between them
    };
    CHECK(shared_edge(pair.body()) == doctest::Approx(5.5e3));
    pair.setup.options.sharing = LIMAX_SHARING_SUM;
    CHECK(shared_edge(pair.body()) == doctest::Approx(1.1e4));
}

TEST_CASE("damping follows from the reduced mass, actuation is the mean over owners") {
    stage pair(lattice{2, 1, 1});
    pair.setup.voxels[0] = 1;  // expanding
    pair.setup.voxels[1] = 3;  // soft: counts 0 in the mean amplitude
    for (int64_t i = 4; i < 6; ++i)
        pair.setup.weights[i] = 0.5f;  // phase pi/2: all in the cosine part
    const spring_body body = pair.body();
    const int64_t inner = 2 * body.count + pair.setup.grid.site(1, 0, 0);
    const int64_t outer = 2 * body.count + pair.setup.grid.site(0, 0, 0);
    CHECK(body.damping[outer] == doctest::Approx(2 * 0.1 * std::sqrt(2e3 * 0.05)));
    CHECK(body.damping[inner] == doctest::Approx(2 * 0.1 * std::sqrt(1.5e3 * 0.05)));
    CHECK(body.cosine[outer] == doctest::Approx(0.1 * 0.25));
    CHECK(body.cosine[inner] == doctest::Approx(0.1 * 0.125));
    CHECK(std::fabs(body.sine[outer]) < 1e-9);
}

TEST_CASE("a contracting muscle opposes an expanding one, and the stiffness floor holds") {
    stage one(lattice{1, 1, 1}, 1, 2);
    one.setup.materials[2].stiffness_floor = 0.2;
    one.setup.weights[0] = 0.05f;
    one.setup.weights[2] = 0.0f;
    const spring_body body = one.body();
    CHECK(body.stiffness[0] == doctest::Approx(0.2 * 2e3));
    CHECK(body.sine[0] == doctest::Approx(-0.1 * 0.25));
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
