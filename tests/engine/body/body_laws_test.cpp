// body_laws_test.cpp: a body's description by laws that need no walk over the lattice's rule,
// against that rule; and its hash, against published and stored numbers.
#include "body/body_laws.h"

#include <doctest/doctest.h>

#include <random>
#include <vector>

#include "body/grid.h"

using namespace limax;

TEST_CASE("owners around a site follow the lattice rule") {
    const lattice grid{3, 3, 3};
    for (int number = -1; number < direction_count; ++number) {
        const direction d = number < 0 ? direction{0, 0, 0} : direction_at(number);
        int expected = 0;
        // from the site in the middle, whose voxels all exist
        for_each_owner(grid, 1, 1, 1, d, [&](int64_t voxel) {
            const int i = int(voxel % 3), j = int(voxel / 3 % 3), k = int(voxel / 9);
            expected |= 1 << (i + 2 * j + 4 * k);
        });
        CAPTURE(number);
        CHECK(owners_around(d) == expected);
    }
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

TEST_CASE("the hash is the one stored in run folders") {
    // splitmix64's first number from the state 0
    CHECK(scramble(0x9e3779b97f4a7c15) == 0xe220a8397b1dcdaf);
    std::vector<uint8_t> voxels(60);
    for (std::size_t v = 0; v < 60; ++v) voxels[v] = uint8_t(v % 5);
    CHECK(body_hash({5, 4, 3}, voxels.data()) == 0xf5510fcd1063e7a6);
    CHECK(body_hash({3, 4, 5}, voxels.data()) != body_hash({5, 4, 3}, voxels.data()));
    voxels.back() ^= 1;  // in a turn that is not full
    CHECK(body_hash({5, 4, 3}, voxels.data()) != 0xf5510fcd1063e7a6);
}
