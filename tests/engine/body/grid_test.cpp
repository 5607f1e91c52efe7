// grid_test.cpp: the largest component of a body, its masses and springs against the lattice's
// rule, and its hash. Values of springs are tested in tests/suites/engine/physics.lua.
#include "body/grid.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <random>
#include <set>
#include <vector>

#include "body/body_laws.h"
#include "stage.h"

using namespace limax;
using namespace limax::test;

TEST_CASE("only the largest face-connected component stays") {
    component_search search;
    const auto kept = [&](const lattice& grid, std::vector<uint8_t> voxels) {
        keep_largest_component(grid, voxels.data(), search);
        return voxels;
    };
    using body = std::vector<uint8_t>;
    CHECK(kept({5, 1, 1}, {1, 0, 2, 3, 0}) == body{0, 0, 2, 3, 0});
    // equal sizes: the one with the lowest index, wherever its other voxels are
    CHECK(kept({5, 1, 1}, {1, 2, 0, 3, 4}) == body{1, 2, 0, 0, 0});
    CHECK(kept({5, 1, 1}, {0, 2, 0, 3, 0}) == body{0, 2, 0, 0, 0});
    CHECK(kept({3, 2, 1}, {0, 1, 1, 2, 0, 0}) == body{0, 1, 1, 0, 0, 0});
    // edges and corners do not connect; materials do not separate
    CHECK(kept({2, 2, 1}, {1, 0, 0, 2}) == body{1, 0, 0, 0});
    CHECK(kept({2, 2, 2}, {1, 0, 0, 0, 0, 0, 2, 3}) == body{0, 0, 0, 0, 0, 0, 2, 3});
    CHECK(kept({2, 2, 2}, {1, 2, 3, 4, 1, 2, 3, 4}) == body{1, 2, 3, 4, 1, 2, 3, 4});
    // the end of a row does not touch the start of the next, nor a layer's end the next layer's
    // start
    CHECK(kept({2, 3, 1}, {0, 1, 2, 0, 3, 0}) == body{0, 0, 2, 0, 3, 0});
    CHECK(kept({1, 2, 2}, {0, 1, 2, 0}) == body{0, 1, 0, 0});
    // joined along z
    CHECK(kept({1, 2, 3}, {1, 2, 1, 0, 1, 2}) == body{1, 2, 1, 0, 1, 2});
    CHECK(kept({1, 1, 1}, {0}) == body{0});
    CHECK(kept({1, 1, 1}, {3}) == body{3});
}

TEST_CASE("a component can be of any size: the search is not recursive") {
    const lattice grid{300, 200, 50};
    std::vector<uint8_t> voxels(3000000, 1);
    voxels[1] = voxels[300] = voxels[60000] = 0;  // cuts the corner voxel 0 off
    component_search search;
    keep_largest_component(grid, voxels.data(), search);
    CHECK(voxels[0] == 0);
    CHECK(std::count(voxels.begin(), voxels.end(), 1) == 3000000 - 4);
}

TEST_CASE("a body is described: counts, extent, masses and springs") {
    limax_body body = {};
    std::vector<uint8_t> voxels(3 * 4 * 5, 0);
    const lattice grid{3, 4, 5};
    describe_body(grid, voxels.data(), body);
    CHECK(body.voxels == 0);
    CHECK(body.size[0] == 0);
    CHECK(body.masses == 0);
    CHECK(body.springs == 0);
    voxels[std::size_t(grid.voxel(1, 1, 2))] = 3;
    voxels[std::size_t(grid.voxel(1, 2, 2))] = 15;
    describe_body(grid, voxels.data(), body);
    CHECK(body.voxels == 2);
    CHECK(body.counts[0] == 58);
    CHECK(body.counts[3] == 1);
    CHECK(body.counts[15] == 1);
    CHECK(body.size[0] == 1);
    CHECK(body.size[1] == 2);
    CHECK(body.size[2] == 1);
    CHECK(body.masses == 12);
    CHECK(body.springs == 28 + 28 - 6);  // the shared face: four edges, two diagonals
}

TEST_CASE("counts by owners around sites agree with count_masses and count_springs") {
    std::mt19937 random(5);
    struct example {
        lattice grid;
        unsigned one_in;  // voxels that are filled
    };
    for (const example& each : {example{{1, 1, 1}, 1}, example{{5, 4, 3}, 2}, example{{7, 1, 2}, 3},
                                example{{6, 6, 6}, 8}}) {
        const lattice& grid = each.grid;
        std::vector<uint8_t> voxels;
        for (int64_t v = 0; v < grid.voxels(); ++v) voxels.push_back(random() % each.one_in == 0);
        int32_t masses = 0, springs = 0;
        for_each_site(grid, [&](int x, int y, int z) {
            int around = 0;
            for (int bit = 0; bit < 8; ++bit) {
                const int i = x - 1 + (bit & 1), j = y - 1 + (bit >> 1 & 1), k = z - 1 + (bit >> 2);
                if (i >= 0 && j >= 0 && k >= 0 && i < grid.nx && j < grid.ny && k < grid.nz)
                    around |= voxels[std::size_t(grid.voxel(i, j, k))] << bit;
            }
            masses += around != 0;
            for (const direction& d : directions) springs += (around & owners_around(d)) != 0;
        });
        const int32_t size[3] = {grid.nx, grid.ny, grid.nz};
        CHECK(masses == count_masses(size, voxels.data()));
        CHECK(springs == count_springs(size, voxels.data()));
    }
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

TEST_CASE("the hash is the one stored in run folders, and tells lattices and materials apart") {
    // splitmix64's first number from the state 0
    CHECK(scramble(0x9e3779b97f4a7c15) == 0xe220a8397b1dcdaf);
    std::vector<uint8_t> voxels(60);
    for (std::size_t v = 0; v < 60; ++v) voxels[v] = uint8_t(v % 5);
    CHECK(body_hash({5, 4, 3}, voxels.data()) == 0xf5510fcd1063e7a6);

    const std::vector<uint8_t> ones(64, 1);
    std::set<uint64_t> hashes;
    for (const lattice grid :
         {lattice{4, 4, 4}, lattice{8, 8, 1}, lattice{1, 8, 8}, lattice{8, 1, 8}, lattice{64, 1, 1},
          lattice{63, 1, 1}, lattice{1, 1, 1}})
        hashes.insert(body_hash(grid, ones.data()));
    CHECK(hashes.size() == 7);
    hashes.clear();
    std::vector<uint8_t> body(125);
    const lattice grid{5, 5, 5};
    for (uint8_t& voxel : body)
        for (voxel = 4; voxel > 0; --voxel) hashes.insert(body_hash(grid, body.data()));
    CHECK(hashes.size() == 125 * 4);
}
