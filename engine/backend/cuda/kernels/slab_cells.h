// slab_cells.h: the cells of a thread and their springs where masses are in shared memory
// (slabs.h). SI units.
#pragma once

#include "backend/cuda/kernels/slabs.h"

namespace limax::cuda {

struct thread_cells {
    spring_set<LIMAX_CUBE_HELD> cube[cube_rounds];
    cell_place place[cell_rounds];  // `at` below 0 for no cell

    __device__ static spring_set<0> rim(block_memory& shared, int round) {
        const int before = cube_rounds * cube_in_memory + round * rim_springs;
        return {{}, shared.parameters + before * threads + threadIdx.x};
    }

    // Finds this thread's cells and loads the parameters of their springs.
    __device__ void load(const launch_arguments& launch, block_memory& shared) {
        const int thread = threadIdx.x, rank = cluster_rank();
        const cell_entry* cells = launch.cells + rank * ((LIMAX_CUBE_SLOTS + LIMAX_RIM_SLOTS) * 32);
        const float* columns =
            launch.springs + robot_of(launch) * (spring_columns * direction_count * sites);
#pragma unroll
        for (int k = 0; k < cube_rounds; ++k)
            cube[k].shared = shared.parameters + k * cube_in_memory * threads + thread;
#pragma unroll
        for (int k = 0; k < cell_rounds; ++k) {
            const int slot = k * warps + thread / 32;
            const cell_entry cell = slot < LIMAX_CUBE_SLOTS + LIMAX_RIM_SLOTS
                                        ? cells[k * threads + thread]
                                        : cell_entry{-1, 0};
            place[k] = place_of_cell(cell);
            if (cell.site < 0) continue;
            if (k >= cube_rounds)
                load_rim(rim(shared, k - cube_rounds), columns, cell);
            else if (slot < LIMAX_CUBE_SLOTS)
                load_cube(cube[k], columns, cell);
            else
                load_rim(cube[k], columns, cell);
        }
    }

    // Calls on_cube(place, parameters) or on_rim(place, parameters) for this thread's cells.
    template <class OnCube, class OnRim>
    __device__ void each(block_memory& shared, const OnCube& on_cube, const OnRim& on_rim) const {
        const int thread = threadIdx.x;
#pragma unroll
        for (int k = 0; k < cell_rounds; ++k) {
            if (place[k].at < 0) continue;
            if (k >= cube_rounds)
                on_rim(place[k], rim(shared, k - cube_rounds));
            else if ((k + 1) * warps <= LIMAX_CUBE_SLOTS ||
                     k * warps + thread / 32 < LIMAX_CUBE_SLOTS)
                on_cube(place[k], cube[k]);
            else
                on_rim(place[k], cube[k]);
        }
    }

    // Stores the forces of this thread's springs.
    __device__ void sum_springs(const launch_arguments& launch, block_memory& shared) const {
        each(
            shared,
            [&](const cell_place& at, const auto& set) {
                cube_forces(
                    launch, set, shared.now,
                    [&](int c) { return shared.at.load(at.at + corner_place(c)); },
                    [&](int c, const force& sum) {
                        shared.sum.store(c * places + at.at + corner_place(c), sum);
                    });
            },
            [&](const cell_place& at, const auto& set) {
                rim_forces(
                    launch, set, shared.now,
                    [&](int c) { return shared.at.load(rim_corner(at, c)); },
                    [&](int c, const force& sum) {
                        if (c < 2 || at.second != 0)
                            shared.sum.store(
                                at.at + (c & 1 ? at.first_sum : 0) + (c & 2 ? at.second_sum : 0),
                                sum);
                    });
            });
    }

    // Whether a spring of this thread is longer than the limit.
    __device__ bool stretched(const launch_arguments& launch, block_memory& shared) const {
        bool too_long = false;
        each(
            shared,
            [&](const cell_place& at, const auto& set) {
                too_long |= cube_stretched(
                    launch, set, [&](int c) { return shared.at.load(at.at + corner_place(c)); });
            },
            [&](const cell_place& at, const auto& set) {
                too_long |= rim_stretched(launch, set,
                                          [&](int c) { return shared.at.load(rim_corner(at, c)); });
            });
        return too_long;
    }
};

}  // namespace limax::cuda
