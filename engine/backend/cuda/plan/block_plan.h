// block_plan.h: how a lattice is laid out over the threads and the shared memory of a block. A
// function of lattice, precision and effects only: results do not depend on the population.
#pragma once

#include <array>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "backend/cuda/kernels/records.h"
#include "body/lattice.h"

namespace limax::cuda {

// Cells (kernels/cells.h) in slots of 32 lanes. Cubes fill the first `cube_slots`, the rim the
// rest: squares of one orientation share a slot, with bars and the topmost site where they fit.
struct block_plan {
    int row = 0, plane = 0;  // places between neighbours along y and along z in shared memory
    int places = 0;          // all of a block, with those that no mass has: what sticks out of the
                             // lattice, and the cells of lanes without one
    int cube_slots = 0, rim_slots = 0;
    bool mixed = false;             // squares of different orientation share a slot
    std::vector<cell_entry> cells;  // [slot][32]
};

// Lays the masses out and assigns the cells to lanes so that what a warp reads is in different
// banks, as far as the lattice allows.
block_plan plan_block(const lattice& grid);

// Plans, each made once. Safe from any thread.
class block_plans {
public:
    std::shared_ptr<const block_plan> of(const lattice& grid);

private:
    std::mutex mutex_;
    std::map<std::array<int, 3>, std::shared_ptr<const block_plan>> plans_;
};

// The demands of a scene on a kernel's memory.
struct kernel_needs {
    int32_t precision;        // limax_precision
    int spring_columns;       // parameters of a spring: 1 to 4
    bool shares_velocity;     // laws on several masses read their velocities
    bool has_faces;           // laws act on faces
    bool many_laws;           // laws on masses that need many registers
    std::size_t control = 0;  // bytes of a controller in shared memory
    std::size_t drive = 0;    // the same on the block path only
};

// Threads and memory of a block.
struct block_shape {
    int threads = 0;
    int blocks = 0;  // of a multiprocessor that its registers are shared out for
    std::size_t shared_bytes = 0;
};

// The purpose of a step kernel: many robots of this lattice on each multiprocessor, with few
// warps each; one of them, with as many warps as slots, so that its step is short; or robots of any
// lattice, on the grid path. Results do not depend on it.
enum class kernel_form { many, one, any_lattice };

// Null where the plan's part of a robot is too large for a block with `most_shared_bytes`.
std::optional<block_shape> shape_block(const block_plan& plan, const kernel_needs& needs,
                                       std::size_t most_shared_bytes,
                                       kernel_form form = kernel_form::many);

}  // namespace limax::cuda
