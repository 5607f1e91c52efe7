// The layout of robots in the shared memory of blocks, without a GPU.
#include "backend/cuda/plan/block_plan.h"

#include <doctest/doctest.h>

#include <set>
#include <vector>

#include "backend/cuda/kernels/cells.h"
#include "backend/cuda/plan/grid_plan.h"

using namespace limax;
using namespace limax::cuda;

TEST_CASE("a plan assigns every cell to one lane of a slot that it fits") {
    for (const lattice& grid : {lattice{1, 1, 1}, lattice{3, 3, 3}, lattice{5, 5, 5},
                                lattice{8, 8, 8}, lattice{7, 4, 3}, lattice{16, 16, 2}}) {
        CAPTURE(grid.nx);
        const block_plan plan = plan_block(grid);
        const int slots = plan.cube_slots + plan.rim_slots;
        REQUIRE(int(plan.cells.size()) == slots * 32);
        const int reach = 1 + plan.row + plan.plane;
        std::set<int> sites;
        for (int i = 0; i < int(plan.cells.size()); ++i) {
            const cell_entry cell = plan.cells[i];
            const int axes = cell.axes & cube_axes, square = cell.axes >> 3;
            const cell_entry first = plan.cells[i / 32 * 32];
            CHECK((square == cube_axes) == (i / 32 < plan.cube_slots));
            CHECK((plan.mixed || square == first.axes >> 3));
            if (cell.site < 0) {
                CHECK(-1 - cell.site + reach < plan.places);
                continue;
            }
            CHECK(sites.insert(cell.site).second);
            const int x = cell.site % (grid.nx + 1), y = cell.site / (grid.nx + 1) % (grid.ny + 1),
                      z = cell.site / ((grid.nx + 1) * (grid.ny + 1));
            CHECK(axes == ((x < grid.nx) | (y < grid.ny) << 1 | (z < grid.nz) << 2));
            CHECK((axes & ~square) == 0);
            CHECK((axes == cube_axes) == (square == cube_axes));
        }
        CHECK(int64_t(sites.size()) == grid.sites());
    }
}

TEST_CASE("the lanes of a block without a cell have places of their own, which no mass has") {
    for (const lattice& grid : {lattice{2, 2, 2}, lattice{5, 5, 5}, lattice{5, 3, 4}}) {
        const block_plan plan = plan_block(grid);
        std::set<int> places;
        for (const cell_entry& cell : plan.cells) {
            const int x = cell.site % (grid.nx + 1), y = cell.site / (grid.nx + 1) % (grid.ny + 1),
                      z = cell.site / ((grid.nx + 1) * (grid.ny + 1));
            const int place = cell.site < 0 ? -1 - cell.site : x + y * plan.row + z * plan.plane;
            CHECK(places.insert(place).second);
        }
    }
}

// Some kernels compute the rim as squares, others as cubes that lack springs: a sum must be the
// same.
TEST_CASE("the springs of a square have the order that they have in a cube") {
    for (const int axes : {3, 5, 6}) {
        CAPTURE(axes);
        const int first = axes & -axes, second = axes & ~first;
        const auto corner = [&](int c) { return (c & 1 ? first : 0) | (c & 2 ? second : 0); };
        int next = 0;
        for (int i = 0; i < cube_springs; ++i) {
            const cube_spring s = cube_spring_at(i);
            if (((s.near | s.far) & ~axes) != 0) continue;
            REQUIRE(next < rim_springs);
            CHECK(s.near == corner(rim_near(next)));
            CHECK(s.far == corner(rim_far(next)));
            CHECK(s.direction == rim_direction(axes, next));
            ++next;
        }
        CHECK(next == rim_springs);
    }
}
