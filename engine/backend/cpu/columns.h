// columns.h: the memory layout of one robot's masses and springs: its own columns, the scratch of
// its thread, and the copy of its masses that its springs read. SI units.
#pragma once

#include <algorithm>
#include <utility>
#include <vector>

#include "backend/cpu/passes.h"
#include "physics/drive.h"

namespace limax::cpu {

inline int64_t longest_step(const lattice& grid) { return grid.step(direction{1, 1, 1}); }

// Steps taken in one pass over a body: several if it is too large for the caches, so that they
// share one read of its memory.
inline constexpr int64_t most_steps_at_once = 8, sites_in_cache = 65536;
constexpr int64_t steps_at_once(int64_t sites) {
    return sites > sites_in_cache ? most_steps_at_once : 1;
}

// Memory that a step writes before it reads it; one per thread, for robots of one precision.
class scratch {
public:
    explicit scratch(const lattice& grid)
        : count_(padded(grid.sites())),
          longest_step_(padded(longest_step(grid))),
          window_(longest_step_ + 2 * site_block),
          memory_(3 * (count_ + longest_step_) +
                  steps_at_once(count_) * 3 * cell_corners * (window_ + site_block)) {}

    // Points the scratch columns of a robot here.
    template <class S>
    void lend(mass_arrays<S>& masses, spring_arrays<S>& springs) {
        S* next = reinterpret_cast<S*>(memory_.data());
        const auto take = [&] {
            S* const column = next + longest_step_;  // memory before it stays zero
            next += count_ + longest_step_;
            return column;
        };
        for (int axis = 0; axis < 3; ++axis) springs.force[axis] = masses.force[axis] = take();
        springs.sums = next;
        springs.sums_window = window_;
        springs.sums_column = window_ + site_block;
    }

private:
    int64_t count_, longest_step_, window_;
    array<double> memory_;
};

// State and forces in S. All masses start at 0, at rest. The body must outlive it.
template <class S, bool compensated>
class robot_columns {
public:
    mass_arrays<S> masses{};
    spring_arrays<S> springs{};

    // `predicted`: forces read another velocity than u.
    robot_columns(const spring_body& body, bool predicted) {
        const int64_t count = body.count;
        // far ends of padded springs are read past the last column's end
        const int64_t column = count + padded(longest_step(body.grid));
        const int columns =
            3 * (3 + (predicted ? 1 : 0) + (compensated ? 2 : 0)) + (sizeof(S) == 8 ? 2 : 1);
        memory_ = array<S>(columns * column);
        S* next = memory_.data();
        const auto take = [&] { return std::exchange(next, next + column); };

        masses.count = springs.count = count;
        springs.sites = body.grid.sites();
        for (int axis = 0; axis < 3; ++axis) {
            masses.position[axis] = take();
            masses.velocity[axis] = take();
            masses.next_velocity[axis] = take();
            masses.predicted[axis] = predicted ? take() : masses.velocity[axis];
            masses.lost_position[axis] = compensated ? take() : nullptr;
            masses.lost_velocity[axis] = compensated ? take() : nullptr;
        }
        S* inverse_mass = inverse_mass_ = take();
        for (int64_t site = 0; site < count; ++site)
            inverse_mass[site] = body.mass[site] > 0 ? S(1) / S(body.mass[site]) : S(0);
        masses.inverse_mass = inverse_mass;
        if constexpr (sizeof(S) == sizeof(float)) {
            masses.mass = body.mass.data();
        } else {
            S* mass = take();
            std::copy(body.mass.begin(), body.mass.end(), mass);
            masses.mass = mass;
        }

        for (int axis = 0; axis < 3; ++axis) masses.step[axis] = body.grid.step(unit(axis));
        masses.faces = body.faces.size() ? body.faces.data() : nullptr;
        for (int d = 0; d < direction_count; ++d) {
            springs.step[d] = body.grid.step(directions[d]);
            springs.used[d] = padded(std::max<int64_t>(0, body.grid.sites() - springs.step[d]));
            springs.rest[d] = S(body.rest[d]);
        }
        springs.stiffness = body.stiffness.data();
        springs.damping = body.damping.data();
        springs.sine = body.sine.data();
        springs.cosine = body.cosine.data();
        fill_cells(body);
    }

    // Holds the mass at a site: no force moves it anymore.
    void hold(int64_t site) { inverse_mass_[site] = S(0); }

    // Lets the springs see masses: those of the robot, or the same where a stage of a step has
    // them.
    void show_springs(const mass_arrays<S>& seen) {
        for (int axis = 0; axis < 3; ++axis) {
            springs.position[axis] = seen.position[axis];
            springs.velocity[axis] = seen.predicted[axis];
        }
    }

    // Lets the springs of a controlled body follow what their owners' gain times activation is at a
    // tick and at the next one, [voxel]. `scale`, by spring, and `share` as in drive.h.
    void follow_drive(const spring_body& body, const float* scale, const S* from, const S* to,
                      S share) {
        // with empty voxels around the lattice
        const lattice& grid = body.grid;
        const int along_x = grid.nx + 3, along_y = grid.ny + 3, along_z = grid.nz + 3;
        for (std::vector<S>* half : {&drive_[0], &drive_[1]})
            half->assign(std::size_t(along_x) * along_y * along_z, S(0));
        if (padded_.empty())
            for_each_site(grid, [&](int x, int y, int z) {
                padded_.push_back(x + along_x * (y + along_y * z));
            });
        const auto padded_at = [&](int x, int y, int z) {
            return x + 1 + along_x * (y + 1 + along_y * (z + 1));
        };
        for (int z = 0, v = 0; z < grid.nz; ++z)
            for (int y = 0; y < grid.ny; ++y)
                for (int x = 0; x < grid.nx; ++x, ++v) {
                    drive_[0][std::size_t(padded_at(x, y, z))] = from[v];
                    drive_[1][std::size_t(padded_at(x, y, z))] = to[v];
                }
        const bool damped = body.damping.size() != 0;
        for (int number = 0, known = 0; number < direction_count; ++number) {
            const cell_spring& spring = cell_springs[number];
            if (known >> spring.owners & 1) continue;
            known |= 1 << spring.owners;
            follow_class(body, spring, scale, share, along_x, along_y,
                         cells_.data() + (sine_row(damped) + spring.owners) * site_block,
                         cells_.data() + (cosine_row(damped) + spring.owners) * site_block);
        }
    }

    // Frees the memory that only springs need.
    void release_springs() { cells_ = array<float>(); }

private:
    void fill_cells(const spring_body& body) {
        const bool damped = body.damping.size() != 0, actuated = body.sine.size() != 0;
        const int64_t rows = actuated ? cosine_row(damped) + owner_classes : sine_row(damped);
        cells_ = array<float>(rows * body.count);
        for (int number = 0; number < direction_count; ++number) {
            const cell_spring& spring = cell_springs[number];
            const int64_t near = body.grid.site(spring.near & 1, spring.near >> 1, 0);
            for (int64_t cell = 0; cell + near < body.count; ++cell) {
                const int64_t slot = spring.direction * body.count + cell + near;
                float* row =
                    cells_.data() + cell / site_block * rows * site_block + cell % site_block;
                row[spring.owners * site_block] = body.stiffness[slot];
                if (damped) row[(damping_row + number) * site_block] = body.damping[slot];
                if (!actuated) continue;
                row[(sine_row(damped) + spring.owners) * site_block] = body.sine[slot];
                row[(cosine_row(damped) + spring.owners) * site_block] = body.cosine[slot];
            }
        }
        springs.cells = cells_.data();
        springs.cell_rows = rows;
    }

    // Fills the rows of one class of springs, at `at_tick` and `per_step` in each block of cells.
    void follow_class(const spring_body& body, const cell_spring& spring, const float* scale,
                      S share, int along_x, int along_y, float* at_tick, float* per_step) {
        const lattice& grid = body.grid;
        const direction d = directions[spring.direction];
        const int near[3] = {spring.near & 1, spring.near >> 1 & 1, spring.near >> 2};
        // owners of the spring from the site 0, in ascending order
        int owners[4], count = 0;
        for (int z = d.z > 0 ? 0 : -1; z <= 0; ++z)
            for (int y = d.y > 0 ? 0 : -1; y <= (d.y < 0 ? -1 : 0); ++y)
                for (int x = d.x > 0 ? 0 : -1; x <= (d.x < 0 ? -1 : 0); ++x)
                    owners[count++] =
                        x + 1 + near[0] + along_x * (y + 1 + near[1] + along_y * (z + 1 + near[2]));
        const int64_t slot = spring.direction * body.count + grid.site(near[0], near[1], near[2]);
        const int64_t end =
            std::min(grid.sites(), body.count - grid.site(near[0], near[1], near[2]));
        const class_drive drive{springs.rest[spring.direction],
                                share,
                                scale + slot,
                                cells_.data() + spring.owners * site_block,
                                owners,
                                end,
                                at_tick,
                                per_step};
        if (count == 4)
            follow_cells<4>(drive);
        else if (count == 2)
            follow_cells<2>(drive);
        else
            follow_cells<1>(drive);
    }
    struct class_drive {
        S rest, share;
        const float *scale, *stiffness;
        const int* owners;
        int64_t end;
        float *at_tick, *per_step;
    };
    template <int owners>
    void follow_cells(const class_drive& of) const {
        const S *const from = drive_[0].data(), *const to = drive_[1].data();
        for (int64_t cell = 0; cell < of.end; ++cell) {
            const int32_t at = padded_[std::size_t(cell)];
            S before = 0, after = 0;
            for (int k = 0; k < owners; ++k) {
                before += from[at + of.owners[k]];
                after += to[at + of.owners[k]];
            }
            const int64_t row =
                cell / site_block * springs.cell_rows * site_block + cell % site_block;
            const drive_change<float> driven =
                driven_spring(change_of(S(of.scale[cell]), before, after, of.share), of.rest,
                              S(of.stiffness[row]));
            of.at_tick[row] = driven.at_tick;
            of.per_step[row] = driven.per_step;
        }
    }

    array<S> memory_;  // all columns of masses that are not the thread's
    S* inverse_mass_;  // within it
    array<float> cells_;
    std::vector<S> drive_[2];      // of follow_drive
    std::vector<int32_t> padded_;  // where its sums begin for each cell
};

}  // namespace limax::cpu
