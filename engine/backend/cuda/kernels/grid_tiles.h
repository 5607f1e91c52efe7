// grid_tiles.h: how the grid path stores a lattice in tiles in global memory: places, the exchange
// of masses between blocks, the forces of springs on the masses of a tile. Compiled with the
// defines of grid.h. SI units.
#pragma once

#include "backend/cuda/kernels/block_memory.h"
#include "backend/cuda/kernels/control.h"
#include "backend/cuda/kernels/robot_sums.h"
#include "backend/cuda/kernels/run.h"
#include "backend/cuda/kernels/springs.h"

namespace limax::cuda {

constexpr int threads = LIMAX_THREADS, warps = threads / 32;
constexpr int tile_x = LIMAX_TILE_X, tile_y = LIMAX_TILE_Y, tile_z = LIMAX_TILE_Z;
constexpr int tile_masses = tile_x * tile_y * tile_z;
// The window of a tile reaches one site beyond it on every side.
constexpr int window_x = tile_x + 2, window_y = tile_y + 2, window_z = tile_z + 2;
constexpr int window = window_x * window_y * window_z;
// Its cells begin one site before it.
constexpr int cells_x = tile_x + 1, cells_y = tile_y + 1, cells_z = tile_z + 1;
constexpr int tile_cells = cells_x * cells_y * cells_z;
// Values of a mass that its springs read.
constexpr int exchanged = shares_velocity ? 6 : 3;
// Whether the velocity that forces read must be stored too: then it is in the columns of the next
// velocity, which only the end of a slice needs.
constexpr bool keeps_prediction = leapfrog && !shares_velocity;

struct grid_memory {
    corner_columns<window> at;
    sum_columns<tile_masses, 0> sum;
    effects::actuation::moment<real> moments[check_interval];  // of the muscles, from the
                                                               // last event on
    int64_t part[grid_sums][warps];
    int64_t sum_of[grid_sums];
    step_times times;
    double shift[3];  // of the origin, m
    int moved, broken;
    double touching;
    robot_record record;  // every block keeps its own, and they agree
    int64_t stop;
    control_block control;
};
static_assert(sizeof(grid_memory) <= LIMAX_SHARED_BYTES);

// A place in the lattice.
struct place {
    int x, y, z;
    __device__ bool inside(const site_grid& grid) const {
        return x >= 0 && y >= 0 && z >= 0 && x < grid.x && y < grid.y && z < grid.z;
    }
    __device__ int site(const site_grid& grid) const { return grid.at(x, y, z); }
};

// Tiles of the lattice along an axis.
__device__ constexpr int tiles_along(int sites, int of_tile) {
    return (sites + of_tile - 1) / of_tile;
}
__device__ constexpr int tiles_of(const site_grid& grid) {
    return tiles_along(grid.x, tile_x) * tiles_along(grid.y, tile_y) * tiles_along(grid.z, tile_z);
}
__device__ inline place tile_base(const site_grid& grid, int tile) {
    const int tiles_x = tiles_along(grid.x, tile_x), tiles_y = tiles_along(grid.y, tile_y);
    return {tile % tiles_x * tile_x, tile / tiles_x % tiles_y * tile_y,
            tile / (tiles_x * tiles_y) * tile_z};
}

using grid_arguments = grid_launch<real>;

// Calls visit(site, index within the tile) for this thread's masses of a tile.
template <class Visit>
__device__ inline void each_site(const site_grid& grid, int tile, const Visit& visit) {
    const place base = tile_base(grid, tile);
    for (int index = threadIdx.x; index < tile_masses; index += threads) {
        const place at{base.x + index % tile_x, base.y + index / tile_x % tile_y,
                       base.z + index / (tile_x * tile_y)};
        if (at.inside(grid)) visit(at.site(grid), index);
    }
}

// Other blocks write what is read here: the reads bypass the first-level cache.
__device__ inline corner exchanged_corner(const site_grid& grid, const real* column, int site) {
    const int sites = grid.count();
    corner c{};
    c.x = __ldcg(column + site);
    c.y = __ldcg(column + sites + site);
    c.z = __ldcg(column + 2 * sites + site);
    if constexpr (shares_velocity) {
        c.vx = __ldcg(column + 3 * sites + site);
        c.vy = __ldcg(column + 4 * sites + site);
        c.vz = __ldcg(column + 5 * sites + site);
    }
    return c;
}
__device__ inline void exchange_corner(const site_grid& grid, real* column, int site,
                                       const corner& c) {
    const int sites = grid.count();
    column[site] = c.x;
    column[sites + site] = c.y;
    column[2 * sites + site] = c.z;
    if constexpr (shares_velocity) {
        column[3 * sites + site] = c.vx;
        column[4 * sites + site] = c.vy;
        column[5 * sites + site] = c.vz;
    }
}

__device__ constexpr int window_corner(int number) {
    return (number & 1) + (number >> 1 & 1) * window_x + (number >> 2) * (window_x * window_y);
}
__device__ constexpr int tile_corner(int number) {
    return (number & 1) + (number >> 1 & 1) * tile_x + (number >> 2) * (tile_x * tile_y);
}

// A cell of a tile: in the lattice, within the tile (-1 before it), and its places in memory.
struct tile_cell {
    place at, within;
    int in_window, in_tile;

    __device__ tile_cell(const site_grid& grid, int tile, int index)
        : within{index % cells_x - 1, index / cells_x % cells_y - 1,
                 index / (cells_x * cells_y) - 1} {
        const place base = tile_base(grid, tile);
        at = {base.x + within.x, base.y + within.y, base.z + within.z};
        in_window = (within.x + 1) + window_x * ((within.y + 1) + window_y * (within.z + 1));
        in_tile = within.x + tile_x * (within.y + tile_y * within.z);
    }
    __device__ bool reaches(const site_grid& grid, int c) const {
        return at.x + (c & 1) < grid.x && at.y + (c >> 1 & 1) < grid.y && at.z + (c >> 2) < grid.z;
    }
    __device__ int axes(const site_grid& grid) const {
        return (reaches(grid, 1) ? 1 : 0) | (reaches(grid, 2) ? 2 : 0) | (reaches(grid, 4) ? 4 : 0);
    }
    __device__ bool ends_in_tile(int c) const {
        const int x = within.x + (c & 1), y = within.y + (c >> 1 & 1), z = within.z + (c >> 2);
        return x >= 0 && y >= 0 && z >= 0 && x < tile_x && y < tile_y && z < tile_z;
    }
};

// Forces on the masses of a tile, of all springs that end in it. Loads the first
// parameters, then the masses of the window.
__device__ inline void tile_forces(const site_grid& grid, const launch_arguments& launch,
                                   const float* columns, const real* seen, int tile,
                                   const effects::actuation::moment<real>& now,
                                   grid_memory& shared) {
    // they never change and are in global memory: loaded a cell ahead
    held_cube springs;
    const auto fetch = [&](int index) {
        if (index >= tile_cells) return;
        const tile_cell cell(grid, tile, index);
        if (cell.at.inside(grid))
            load_cube(springs, grid, columns, cell.at.site(grid), cell.axes(grid));
    };
    fetch(threadIdx.x);
    const place base = tile_base(grid, tile);
    for (int index = threadIdx.x; index < window; index += threads) {
        const place at{base.x + index % window_x - 1, base.y + index / window_x % window_y - 1,
                       base.z + index / (window_x * window_y) - 1};
        if (at.inside(grid)) shared.at.store(index, exchanged_corner(grid, seen, at.site(grid)));
    }
    __syncthreads();
    for (int index = threadIdx.x; index < tile_cells; index += threads) {
        const tile_cell cell(grid, tile, index);
        const auto store = [&](int c, const force& sum) {
            if (cell.ends_in_tile(c) && cell.reaches(grid, c))
                shared.sum.store(c, cell.in_tile + tile_corner(c), sum);
        };
        if (cell.at.inside(grid)) {
            // A spring to a corner that does not exist has no stiffness, and gets no length.
            cube_forces<false>(
                launch, springs, now,
                [&](int c) {
                    return shared.at.load(cell.in_window +
                                          (cell.reaches(grid, c) ? window_corner(c) : 0));
                },
                store);
        } else {
            // a mass on the lattice's low side is not a corner of such a cell
#pragma unroll
            for (int c = 0; c < corners; ++c) store(c, {});
        }
        fetch(index + threads);
    }
    __syncthreads();
}

__device__ inline force force_on(int index, const grid_memory& shared) {
    force total = shared.sum.load(0, index);
#pragma unroll
    for (int c = 1; c < corners; ++c) {
        const force part = shared.sum.load(c, index);
        total.x += part.x;
        total.y += part.y;
        total.z += part.z;
    }
    return total;
}

}  // namespace limax::cuda
