// tile_plan.h: how a lattice too large for a block is cut into tiles that stay in the registers and
// the shared memory of their blocks (kernels/tiles.h). Trajectories do not depend on it.
#pragma once

#include <array>

#include "backend/cuda/plan/block_plan.h"

namespace limax::cuda {

struct tile_plan {
    std::array<int, 3> cut{};     // tiles along x, y, z
    int tiles = 0;                // of a robot
    int threads = 0, rounds = 0;  // of a block; cells of a thread
    int rim_slots = 0;            // threads with a cell in a last round that only the rim has, or 0
    int senders = 0;              // rounds, from the second on, with cells that reach out
    int row = 0, plane = 0;       // places between neighbours along y and z in shared memory
    int places = 0;               // of the largest tile and one layer beyond it
    int own_places = 0;           // up to its last mass
    int readers = 0;              // threads up to the last with a mass or a cell of another tile
    int halo = 0, inbox = 0;      // most masses and forces that a thread receives
    std::size_t shared_bytes = 0;

    int shown = 0;               // most masses of a tile that others read
    std::vector<int32_t> table;  // see tile_rows
};

// Tiles along each axis, and whether cells of the lattice's rim have a round of their own.
struct tile_cut {
    std::array<int, 3> tiles;
    bool rims_apart;
};
// Null where the tiles are too large for a block with `most_shared_bytes`, or too thin.
std::optional<tile_plan> cut_into_tiles(const lattice& grid, const tile_cut& cut,
                                        const kernel_needs& needs, std::size_t most_shared_bytes);

// The cut in which `robots` robots take the least time on so many multiprocessors, each with one
// tile. Null where one robot does not fit.
std::optional<tile_plan> plan_tiles(const lattice& grid, const kernel_needs& needs,
                                    std::size_t most_shared_bytes, int multiprocessors, int robots);

}  // namespace limax::cuda
