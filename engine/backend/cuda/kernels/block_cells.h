// block_cells.h: the cells of a thread and their springs where masses are in shared memory
// (block.h). SI units.
#pragma once

#include "backend/cuda/kernels/block.h"

namespace limax::cuda {

struct thread_cells {
    held_cube cube[cube_rounds];
    int place[cell_rounds];   // of the lowest corner
    int square[cell_rounds];  // axes of the squares of this warp's slot; those of a cube, or 0
    any_square mixed[LIMAX_MIXED ? cube_rounds : 1];

    __device__ static stored_square stored(block_memory& shared, int round) {
        return {shared.squares[round - cube_rounds]};
    }
    __device__ bool has_slot(int round) const {
        return (round + 1) * warps <= slots || square[round] != 0;
    }
    // The cell of this thread in a round. Lanes without one have a site below 0. The warps of a
    // block differ in work, and every fourth warp of a multiprocessor has the same scheduler: from
    // block to block of a multiprocessor they take their slots in turn.
    __device__ static cell_entry entry(const launch_arguments& launch, int round) {
        const int role = (int(threadIdx.x) / 32 + block_of_multiprocessor() * warps / 4) % warps;
        const int slot = round * warps + role;
        if (slot >= slots) return {-1, 0};
        return launch.cells[slot * 32 + threadIdx.x % 32];
    }

    // Finds this thread's cells and loads the parameters of their springs.
    __device__ void load(const launch_arguments& launch, block_memory& shared) {
        constexpr site_grid grid{lattice{}};
        const float* columns =
            launch.springs + robot_of(launch) * (stored_columns * direction_count * sites);
#pragma unroll
        for (int k = 0; k < cell_rounds; ++k) {
            const cell_entry cell = entry(launch, k);
            const bool here = cell.site >= 0;
            place[k] = here ? place_of(cell.site) : unused_place(cell);
            const int across = cell.axes >> 3;
            square[k] = __shfl_sync(0xffffffffu, across, 0);
            if constexpr (LIMAX_MIXED) {
                if (k < cube_rounds)
                    mixed[k].across(across);
                else
                    shared.squares[k - cube_rounds].mixed[threadIdx.x].across(across);
            }
            if (k >= cube_rounds) {
                if (has_slot(k))
                    load_square(stored(shared, k), grid, columns, cell.site,
                                here ? cell.axes & cube_axes : 0, across);
            } else if (square[k] != cube_axes) {
                load_square(cube[k], grid, columns, cell.site, here ? cell.axes & cube_axes : 0,
                            across);
            } else {
                load_cube(cube[k], grid, columns, cell.site, here ? cube_axes : 0);
            }
        }
    }

    // Turns the parameters of a controlled robot's springs, as load() leaves them, into what the
    // last tick makes of them. Sums over owners are in the order of for_each_owner().
    __device__ void drive(const launch_arguments& launch, block_memory& shared) {
        constexpr site_grid grid{lattice{}};
        const real* const halves[2] = {shared.drive[shared.record.ticks - 1 & 1] + sites_before,
                                       shared.drive[shared.record.ticks & 1] + sites_before};
#pragma unroll
        for (int k = 0; k < cell_rounds; ++k) {
            const int cell = larger(entry(launch, k).site, 0);
            const auto follow = [&](spring_parameters& spring, int kind, const real(&sum)[2]) {
                float& last = spring.value[spring_columns - 1];
                const drive_change<float> driven =
                    driven_spring(change_of(real(last), sum[0], sum[1], shared.control.share),
                                  rest_length(launch, kind), real(spring.value[0]));
                spring.value[spring_columns - 2] = driven.at_tick;
                last = driven.per_step;
            };
            // a square's owners are all on one side
            const auto drive_square = [&](auto&& set) {
                const int across = entry(launch, k).axes >> 3;
                const int first = grid.corner(across & -across);
                const int both = grid.corner(across),
                          behind = cell - grid.corner(cube_axes & ~across);
                real sum[3][2];
                for (int half = 0; half < 2; ++half) {
                    const real* const at = halves[half] + behind;
                    sum[0][half] = at[-first] + at[0];
                    sum[1][half] = at[first - both] + at[0];
                    sum[2][half] = at[0];
                }
                for (int i = 0; i < rim_classes; ++i) follow(set.of_class(i), i / 2, sum[i]);
            };
            if (k >= cube_rounds) {
                if (has_slot(k)) drive_square(stored(shared, k));
            } else if (square[k] != cube_axes) {
                drive_square(cube[k]);
            } else {
                each_constant<cube_springs>([&](auto i) {
                    constexpr cube_spring s = cube_spring_at(i.value);
                    constexpr parameter_place at = cube_place(i.value);
                    if constexpr (at.other < 0) {
                        real sum[2] = {};
                        for (int before = corners - 1; before >= 0; --before)
                            if ((before & (s.near ^ s.far)) == 0)
                                for (int half = 0; half < 2; ++half)
                                    sum[half] += halves[half][cell - grid.corner(before)];
                        follow(cube[k].of_class(at.of_class), length_class(s.direction), sum);
                    }
                });
            }
        }
    }

    // Calls on_cube(parameters) or, for a square with axes that are constants,
    // on_square(parameters, axes) for the cell of a round.
    template <class OnCube, class OnSquare>
    __device__ void visit(block_memory& shared, int round, const OnCube& on_cube,
                          const OnSquare& on_square) const {
        const auto each_square = [&](const auto& set) {
            if constexpr (LIMAX_MIXED)
                on_square(set, round < cube_rounds
                                   ? mixed[round]
                                   : shared.squares[round - cube_rounds].mixed[threadIdx.x]);
            else if (square[round] == 3)
                on_square(set, square_across<3>{});
            else if (square[round] == 5)
                on_square(set, square_across<5>{});
            else if (square[round] == 6)
                on_square(set, square_across<6>{});
        };
        if (round >= cube_rounds)
            each_square(stored(shared, round));
        else if ((round + 1) * warps <= LIMAX_CUBE_SLOTS || square[round] == cube_axes)
            on_cube(cube[round]);
        else
            each_square(cube[round]);
    }

    // Forces of this thread's springs in a round: on other masses into the sums, on `mass`, that at
    // its own place, returned.
    __device__ force sum_springs(const launch_arguments& launch, block_memory& shared, int round,
                                 const corner& mass,
                                 const effects::actuation::moment<real>& now) const {
        const int at = place[round];
        force own{};
        visit(
            shared, round,
            [&](const auto& set) {
                cube_forces<alone>(
                    launch, set, now,
                    [&](int c) { return c == 0 ? mass : shared.at.load(at + corner_place(c)); },
                    [&](int c, const force& sum) {
                        if (c == 0)
                            own = sum;
                        else
                            shared.sum.store_at(at + corner_sum(c), sum);
                    });
            },
            [&](const auto& set, const auto& square) {
                square_forces(
                    launch, set, now,
                    [&](int c) { return c == 0 ? mass : shared.at.load(at + square.place(c)); },
                    [&](int c, const force& sum) {
                        if (c == 0)
                            own = sum;
                        else
                            shared.sum.store_at(at + square.sum(c), sum);
                    });
            });
        return own;
    }

    // Whether a spring of this thread is longer than the limit.
    __device__ bool stretched(const launch_arguments& launch, block_memory& shared) const {
        bool too_long = false;
#pragma unroll
        for (int k = 0; k < cell_rounds; ++k) {
            if (!has_slot(k)) continue;
            visit(
                shared, k,
                [&](const auto& set) {
                    too_long |= cube_stretched(launch, set, [&](int c) {
                        return shared.at.load(place[k] + corner_place(c));
                    });
                },
                [&](const auto& set, const auto& square) {
                    too_long |= square_stretched(launch, set, [&](int c) {
                        return shared.at.load(place[k] + square.place(c));
                    });
                });
        }
        return too_long;
    }
};

}  // namespace limax::cuda
