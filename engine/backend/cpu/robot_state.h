// robot_state.h: the state of one robot: masses, springs, rigid blocks, and the origin that its
// coordinates are relative to. Initial state, placement, moves of the origin and reading. SI
// units.
#pragma once

#include <array>
#include <cmath>
#include <memory>
#include <utility>

#include "backend/backend.h"
#include "backend/cpu/forces.h"
#include "physics/held.h"
#include "physics/integrator.h"
#include "physics/measure.h"
#include "physics/origin.h"

namespace limax::cpu {

// S and `compensated` as in robot_columns. `setup` and `passes` must outlive it; it must
// not be moved, since its parts refer to each other.
template <class S, bool compensated>
struct robot_state {
    const simulation_setup& setup;
    spring_body body;
    robot_columns<S, compensated> columns;
    robot_forces<S, compensated> forces;
    std::unique_ptr<rigid_blocks<S>> blocks;  // null in a scene without any
    double origin[3] = {0, 0, 0};             // m

    // The body where it starts. Muscles count time in ticks of `tick` seconds from t = 0.
    robot_state(const simulation_setup& shared_setup, spring_body of, const pass_table& passes,
                double tick)
        : setup(shared_setup),
          body(std::move(of)),
          columns(body, shared_setup.options.integrator == LIMAX_LEAPFROG),
          forces(shared_setup.scene, body, passes, columns, tick) {
        put_down();
        if (setup.scene.has(effects::index_of<effects::block>)) put_blocks();
        follow_origin({0, 0, 0});
    }
    robot_state(const robot_state&) = delete;
    robot_state& operator=(const robot_state&) = delete;

    // Puts the masses elsewhere, at rest or with velocities, as in robot::place.
    void place(const double* positions, const double* velocities) {
        for (int32_t i = 0; i < 3 * body.masses; ++i)
            if ((positions && !std::isfinite(positions[i])) ||
                (velocities && !std::isfinite(velocities[i])))
                fail(LIMAX_INVALID_ARGUMENT,
                     format("mass %d is to be placed at, or with, a value that is not finite",
                            i / 3 + 1));
        // the robot's own origin comes along, so that fp32 resolves as much there as anywhere
        std::array<double, 3> moved = {0, 0, 0};
        for (int axis = 0; positions && axis < 3; ++axis) {
            double sum = 0;
            for (int32_t i = 0; i < body.masses; ++i) sum += positions[3 * i + axis];
            const double nearest = whole_origin_steps(sum / body.masses);
            moved[axis] = nearest - origin[axis];
            origin[axis] = nearest;
        }
        follow_origin(moved);
        mass_arrays<S>& masses = columns.masses;
        for (int32_t i = 0; i < body.masses; ++i)
            for (int axis = 0; axis < 3; ++axis) {
                const int32_t site = body.sites[i];
                if (positions)
                    masses.position[axis][site] = S(positions[3 * i + axis] - origin[axis]);
                if (!velocities || masses.inverse_mass[site] == S(0)) continue;
                masses.velocity[axis][site] = S(velocities[3 * i + axis]);
                masses.predicted[axis][site] = masses.velocity[axis][site];
            }
    }

    // Moves the robot's own origin after it: a function of this robot only.
    void recenter() {
        std::array<double, 3> moved = {0, 0, 0};
        mass_arrays<S>& masses = columns.masses;
        for (int axis = 0; axis < 3; ++axis) {
            const double shift = origin_shift(center_of_mass(body, masses.position[axis]));
            if (shift == 0.0) continue;
            for (int32_t i = 0; i < body.masses; ++i) {
                const int32_t site = body.sites[i];
                S carried = compensated ? masses.lost_position[axis][site] : S(0);
                S& position = masses.position[axis][site];
                position = accumulate<compensated>(position, S(-1), S(shift), carried);
                if constexpr (compensated) masses.lost_position[axis][site] = carried;
            }
            origin[axis] += shift;
            moved[axis] = shift;
        }
        if (moved != std::array<double, 3>{}) follow_origin(moved);
    }

    // The centre of mass on an axis, in the world, m.
    double center(int axis) const {
        return origin[axis] + center_of_mass(body, columns.masses.position[axis]);
    }
    // Columns of the masses as [mass][3], `from` an origin unless it is null: -0 + 0 loses a sign.
    void write(const S* const column[3], const double* from, double* out) const {
        for (int32_t i = 0; i < body.masses; ++i)
            for (int axis = 0; axis < 3; ++axis) {
                const double value = column[axis][body.sites[i]];
                out[3 * i + axis] = from ? from[axis] + value : value;
            }
    }

    // Frees what only forces need.
    void release_springs() {
        for (array<float>* column :
             {&body.stiffness, &body.damping, &body.sine, &body.cosine, &body.faces})
            *column = array<float>();
        columns.release_springs();
    }

private:
    void put_down() {
        const lattice& grid = body.grid;
        const limax_simulation_options& options = setup.options;
        const int sites_along[3] = {grid.nx + 1, grid.ny + 1, grid.nz + 1};
        mass_arrays<S>& masses = columns.masses;
        for (int axis = 0; axis < 3; ++axis)
            origin[axis] = whole_origin_steps(options.position[axis]);
        for (int64_t site = 0; site < grid.sites(); ++site) {
            const int64_t index[3] = {site % sites_along[0], site / sites_along[0] % sites_along[1],
                                      site / (int64_t(sites_along[0]) * sites_along[1])};
            const bool held = is_held(setup.scene, options.edge, body.corner, int(index[0]),
                                      int(index[1]), int(index[2]));
            if (held) columns.hold(site);
            const bool moving = body.mass[site] > 0 && !held;
            for (int axis = 0; axis < 3; ++axis) {
                masses.position[axis][site] =
                    S((options.position[axis] - origin[axis]) +
                      options.edge * double(index[axis] - body.corner[axis]));
                masses.velocity[axis][site] = moving ? S(options.velocity[axis]) : S(0);
                masses.predicted[axis][site] = masses.velocity[axis][site];
            }
        }
    }

    void put_blocks() {
        double start[3];
        for (int axis = 0; axis < 3; ++axis)
            start[axis] = setup.options.position[axis] - origin[axis];
        blocks = std::make_unique<rigid_blocks<S>>(setup.scene, body, start);
        forces.meet(*blocks);
    }

    // The robot's own origin has moved by `shift`: what is not a mass follows.
    void follow_origin(const std::array<double, 3>& shift) {
        forces.follow(origin);
        if (blocks) blocks->follow(origin, shift.data());
    }
};

}  // namespace limax::cpu
