// grid_plan.cpp: chooses tiles that are as large as shared memory allows and nearly equal in size.
#include "backend/cuda/plan/grid_plan.h"

#include "backend/cuda/kernels/cells.h"
#include "limax.h"

namespace limax::cuda {

namespace {

// Sites of a tile along an axis: 9 leave room for two blocks on a multiprocessor of the largest
// GPUs, 11 for one; each side computes one layer of cells for its neighbour.
constexpr int most_tile = 9, most_tile_alone = 11;
// The largest tiles that fit the 64 KB of the smallest GPUs, in fp32 and in fp64.
constexpr int any_tile = 7, any_tile_of_double = 5;
constexpr int fewest_threads = 128, most_threads = 256, lanes = 32;
constexpr int fewest_threads_alone = 384, most_threads_alone = 512;
constexpr std::size_t shared_slack = 512;

int rounds(int items, int at_once) { return (items + at_once - 1) / at_once; }

std::array<int, 3> sites_along(const lattice& grid) {
    return {grid.nx + 1, grid.ny + 1, grid.nz + 1};
}

grid_shape shape_of(const std::array<int, 3>& along, const std::array<int, 3>& tile,
                    const kernel_needs& needs, bool alone = false) {
    grid_shape shape;
    shape.tile = tile;
    shape.tiles = 1;
    std::size_t window = 1;
    int masses = 1, cells = 1;
    for (int axis = 0; axis < 3; ++axis) {
        shape.tiles *= rounds(along[axis], tile[axis]);
        window *= std::size_t(tile[axis] + 2);
        masses *= tile[axis];
        cells *= tile[axis] + 1;
    }
    // the number of threads that leaves the fewest without a cell
    double best = 0;
    for (int threads = alone ? most_threads_alone : most_threads;
         threads >= (alone ? fewest_threads_alone : fewest_threads); threads -= lanes) {
        const double share = double(cells) / (threads * rounds(cells, threads));
        if (share <= best) continue;
        best = share;
        shape.threads = threads;
    }
    const bool in_double = needs.precision == LIMAX_DOUBLE;
    shape.blocks = in_double ? 1 : 512 / shape.threads;
    const std::size_t real = in_double ? 8 : 4;
    // grid_memory of kernels/grid_tiles.h, which asserts that this suffices
    shape.shared_bytes = (window * (needs.shares_velocity ? 6 : 4) +
                          std::size_t(masses) * 3 * corners + 2 * check_interval) *
                             real +
                         std::size_t(shape.threads / lanes) * grid_sums * sizeof(int64_t) +
                         sizeof(robot_record) + needs.control + shared_slack;
    return shape;
}

}  // namespace

grid_shape shape_grid(const lattice& grid, const kernel_needs& needs, std::size_t most_shared_bytes,
                      int multiprocessors) {
    const auto along = sites_along(grid);
    const auto cut = [&](int most, bool alone) {
        // as equal as the lattice allows
        std::array<int, 3> tile;
        for (int axis = 0; axis < 3; ++axis)
            tile[axis] = rounds(along[axis], rounds(along[axis], most));
        return shape_of(along, tile, needs, alone);
    };
    // a robot whose larger tiles each have a multiprocessor, but not its smaller ones
    const grid_shape large = cut(most_tile_alone, true);
    if (large.shared_bytes <= most_shared_bytes && large.tiles <= multiprocessors &&
        cut(most_tile, false).tiles > multiprocessors)
        return large;
    for (int most = most_tile;; --most) {
        const grid_shape shape = cut(most, false);
        if (shape.shared_bytes <= most_shared_bytes || most == 1) return shape;
    }
}

int robots_together(int tiles, int blocks, int most) {
    int best = 1;
    double most_tiles = 0;  // stepped at a time
    for (int robots = 1; robots <= std::min(most, blocks); ++robots) {
        const int of_robot = std::min(blocks / robots, tiles);
        const double at_once = double(robots) * tiles / rounds(tiles, of_robot);
        if (at_once < most_tiles) continue;
        most_tiles = at_once;
        best = robots;
    }
    return best;
}

grid_shape shape_any_grid(const lattice& grid, const kernel_needs& needs) {
    const int tile = needs.precision == LIMAX_DOUBLE ? any_tile_of_double : any_tile;
    return shape_of(sites_along(grid), {tile, tile, tile}, needs);
}

}  // namespace limax::cuda
