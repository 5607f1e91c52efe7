// xpbd.h: the order of a step of XPBD: a kick by what is explicit, one sweep over the springs, the
// kick again with their forces, impulses, contacts one by one, drift. physics/integrator.h explains
// what a spring does in it, xpbd_passes.inl in which order they come. SI units.
#pragma once

#include <algorithm>
#include <utility>

#include "backend/cpu/forces.h"
#include "backend/cpu/stepper.h"
#include "physics/integrator.h"
#include "physics/time_step.h"

namespace limax::cpu {

// S, F and `compensated` as in robot_columns. What it is made from must outlive it.
template <class S, class F, bool compensated>
class xpbd final : public stepper<S> {
public:
    xpbd(const schedule& plan, const spring_body& body, const pass_table& passes,
         robot_columns<S, F, compensated>& columns, robot_forces<S, F, compensated>& forces)
        : plan_(plan),
          body_(body),
          table_(passes),
          passes_(mass_passes_of<S>(passes)),
          columns_(columns),
          masses_(columns.masses),
          forces_(forces) {
        const lattice& grid = body.grid;
        const int voxels_along[3] = {grid.nx, grid.ny, grid.nz};
        odd_ = array<F>(3 * body.count);
        for (int axis = 0; axis < 3; ++axis) {
            F* odd = odd_.data() + axis * body.count;
            for_each_site(grid, [&](int x, int y, int z) {
                const int index[3] = {x, y, z};
                odd[grid.site(x, y, z)] = F(index[axis] % 2);
            });
            step_.odd[axis] = odd;
            step_.halves[axis] = voxels_along[axis] > 1 ? 2 : 1;
        }
        step_.dt = F(plan.time_step);
    }

    void begin(int64_t step) override {
        const int64_t tick = step - plan_.settle_steps;
        const S dt = S(plan_.time_step);
        if (!step_.stiffness) soften();
        forces_.evaluate_explicit(masses_, tick);
        passes_.kick[false](masses_, dt);
        columns_.show_springs(table_, masses_);
        // muscles are where they will be at the end of the step, but none works before t = 0
        const int64_t end = forces_.actuated(tick) ? tick + 1 : tick;
        if constexpr (mixed) {
            sweep_rounded(end);
            // what is explicit has kicked already
            mass_arrays<S> kicked = masses_;
            for (int axis = 0; axis < 3; ++axis)
                kicked.velocity[axis] = masses_.next_velocity[axis];
            passes_.kick[false](kicked, dt);
        } else {
            for (int axis = 0; axis < 3; ++axis) step_.velocity[axis] = masses_.next_velocity[axis];
            step_.inverse_mass = masses_.inverse_mass;
            forces_.sweep(step_, end);
            passes_.kick[compensated](masses_, dt);
        }
        forces_.push_before_friction(masses_, dt);
        forces_.press(masses_, dt);
    }

    void finish(int64_t) override {
        passes_.drift[compensated][false](masses_, S(plan_.time_step), S(0));
        for (int axis = 0; axis < 3; ++axis) {
            std::swap(masses_.velocity[axis], masses_.next_velocity[axis]);
            masses_.predicted[axis] = masses_.velocity[axis];
        }
    }

    void velocity_now(int64_t, bool, S* const out[3]) const override {
        for (int axis = 0; axis < 3; ++axis)
            for (int32_t i = 0; i < body_.masses; ++i)
                out[axis][body_.sites[i]] = masses_.velocity[axis][body_.sites[i]];
    }

    void release() override {
        odd_ = array<F>();
        softened_ = array<F>();
        rounded_ = array<F>();
    }

private:
    static constexpr bool mixed = robot_columns<S, F, compensated>::mixed;

    // Finds what reaction() leaves of the springs, once it is known which masses are held.
    void soften() {
        const bool damped = body_.damping.size() != 0;
        const int64_t springs = direction_count * body_.count;
        softened_ = array<F>((damped ? 2 : 1) * springs);
        F* stiffness = softened_.data();
        F* damping = damped ? stiffness + springs : nullptr;
        for (int d = 0; d < direction_count; ++d) {
            const int64_t step = body_.grid.step(directions[d]);
            for (int64_t near = 0; near + step < body_.grid.sites(); ++near) {
                const int64_t slot = d * body_.count + near;
                const F k = F(body_.stiffness[slot]), c = damped ? F(body_.damping[slot]) : F(0);
                const F inverse_mass =
                    F(masses_.inverse_mass[near]) + F(masses_.inverse_mass[near + step]);
                const F left = reaction(k, c, inverse_mass, step_.dt);
                stiffness[slot] = left * k;
                if (damped) damping[slot] = left * c;
            }
        }
        step_.stiffness = stiffness;
        step_.damping = damping;
    }

    // Sweeps over velocities and masses rounded to F, and widens the springs' forces.
    void sweep_rounded(int64_t tick) {
        // far ends of padded springs are read past the last column's end
        const int64_t column = body_.count + padded(longest_step(body_.grid));
        if (rounded_.size() == 0) rounded_ = array<F>(4 * column);
        F* next = rounded_.data();
        for (int axis = 0; axis < 3; ++axis, next += column) {
            table_.narrow(body_.count, masses_.next_velocity[axis], next);
            step_.velocity[axis] = next;
            std::fill_n(columns_.springs.force[axis], body_.count, F(0));
        }
        table_.narrow(body_.count, masses_.inverse_mass, next);
        step_.inverse_mass = next;
        forces_.sweep(step_, tick);
        columns_.take_forces(table_);
    }

    const schedule& plan_;
    const spring_body& body_;
    const pass_table& table_;
    const mass_passes<S>& passes_;
    robot_columns<S, F, compensated>& columns_;
    mass_arrays<S>& masses_;
    robot_forces<S, F, compensated>& forces_;
    array<F> odd_;       // [axis][site]
    array<F> softened_;  // stiffness, and damping where there is any, [direction][site]
    array<F> rounded_;   // velocities and inverse masses of a mixed sweep
    sweep_arrays<F> step_{};
};

}  // namespace limax::cpu
