// grid_test.cpp: the largest component of a body, its description and its hash.
#include "body/grid.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <set>
#include <vector>

using limax::lattice;

TEST_CASE("only the largest face-connected component stays") {
    limax::component_search search;
    const auto kept = [&](const lattice& grid, std::vector<uint8_t> voxels) {
        limax::keep_largest_component(grid, voxels.data(), search);
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
    limax::component_search search;
    limax::keep_largest_component(grid, voxels.data(), search);
    CHECK(voxels[0] == 0);
    CHECK(std::count(voxels.begin(), voxels.end(), 1) == 3000000 - 4);
}

TEST_CASE("a body is described: counts, extent, masses and springs") {
    limax_body body = {};
    std::vector<uint8_t> voxels(3 * 4 * 5, 0);
    const lattice grid{3, 4, 5};
    limax::describe_body(grid, voxels.data(), body);
    CHECK(body.voxels == 0);
    CHECK(body.size[0] == 0);
    CHECK(body.masses == 0);
    CHECK(body.springs == 0);
    voxels[std::size_t(grid.voxel(1, 1, 2))] = 3;
    voxels[std::size_t(grid.voxel(1, 2, 2))] = 15;
    limax::describe_body(grid, voxels.data(), body);
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

TEST_CASE("hashes tell bodies and lattices apart") {
    const std::vector<uint8_t> voxels(64, 1);
    std::set<uint64_t> hashes;
    for (const lattice grid :
         {lattice{4, 4, 4}, lattice{8, 8, 1}, lattice{1, 8, 8}, lattice{8, 1, 8}, lattice{64, 1, 1},
          lattice{63, 1, 1}, lattice{1, 1, 1}})
        hashes.insert(limax::body_hash(grid, voxels.data()));
    CHECK(hashes.size() == 7);
    // any material of any voxel
    hashes.clear();
    std::vector<uint8_t> body(125);
    const lattice grid{5, 5, 5};
    for (uint8_t& voxel : body)
        for (voxel = 4; voxel > 0; --voxel) hashes.insert(limax::body_hash(grid, body.data()));
    CHECK(hashes.size() == 125 * 4);
    CHECK(limax::body_hash(grid, body.data()) ==
          limax::body_hash(grid, std::vector<uint8_t>(body).data()));
}
