// xpbd.h: the order of a step of XPBD: a kick by what is explicit, one sweep over the springs, the
// kick again with their forces, impulses, contacts one by one, drift. physics/integrator.h says
// what a spring does in it, xpbd_passes.inl in which order they come. SI units.
#pragma once

#include <utility>

#include "backend/cpu/forces.h"
#include "backend/cpu/stepper.h"
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
        memory_ = array<F>((mixed ? 6 : 2) * body.count);
        for (int axis = 0; axis < 2; ++axis) {
            F* odd = memory_.data() + axis * body.count;
            for_each_site(grid, [&](int x, int y, int z) {
                odd[grid.site(x, y, z)] = F((axis == 0 ? x : y) % 2);
            });
            step_.odd[axis] = odd;
        }
        step_.sites = grid.sites();
        step_.layer = int64_t(grid.nx + 1) * (grid.ny + 1);
        step_.dt = F(plan.time_step);
    }

    void begin(int64_t step) override {
        const int64_t tick = step - plan_.settle_steps;
        const S dt = S(plan_.time_step);
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

    void release() override { memory_ = array<F>(); }

private:
    static constexpr bool mixed = robot_columns<S, F, compensated>::mixed;

    // Sweeps over velocities and masses rounded to F, and widens the springs' forces.
    void sweep_rounded(int64_t tick) {
        F* next = memory_.data() + 2 * body_.count;
        for (int axis = 0; axis < 3; ++axis, next += body_.count) {
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
    array<F> memory_;  // columns: odd along x and y; velocity and inverse mass of a mixed sweep
    sweep_arrays<F> step_{};
};

}  // namespace limax::cpu
