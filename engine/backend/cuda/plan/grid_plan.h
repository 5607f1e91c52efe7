// grid_plan.h: how a lattice too large for a block is cut into tiles. Trajectories do not depend
// on it.
#pragma once

#include <array>

#include "backend/cuda/plan/block_plan.h"

namespace limax::cuda {

struct grid_shape {
    std::array<int, 3> tile{};  // sites along x, y, z
    int tiles = 0;              // of a robot
    int threads = 0;            // of a block
    int blocks = 0;             // of a multiprocessor that its registers are shared out for
    std::size_t shared_bytes = 0;
};

// Tiles for a kernel that is compiled for this lattice, on a GPU with so many multiprocessors,
// whose blocks have at most `most_shared_bytes`.
grid_shape shape_grid(const lattice& grid, const kernel_needs& needs, std::size_t most_shared_bytes,
                      int multiprocessors);

// Robots that are best stepped together by so many blocks, at most `most`: blocks of a robot that
// has few tiles left wait for the others.
int robots_together(int tiles, int blocks, int most);

// The tiles of a kernel that serves every lattice on every GPU, here for this lattice.
grid_shape shape_any_grid(const lattice& grid, const kernel_needs& needs);

}  // namespace limax::cuda
