// kick_drift.h: the order of a step of leapfrog and of symplectic Euler: forces at x_n and t_n,
// kick, impulses, drift. physics/integrator.h explains what each velocity is. SI units.
#pragma once

#include <utility>

#include "backend/cpu/forces.h"
#include "backend/cpu/stepper.h"
#include "physics/time_step.h"

namespace limax::cpu {

// S and `compensated` as in robot_columns. What it is made from must outlive it.
template <class S, bool compensated>
class kick_drift final : public stepper<S> {
public:
    kick_drift(bool leapfrog, const schedule& plan, const spring_body& body,
               const pass_table& passes, robot_columns<S, compensated>& columns,
               robot_forces<S, compensated>& forces)
        : leapfrog_(leapfrog),
          plan_(plan),
          body_(body),
          passes_(passes_of<S>(passes)),
          masses_(columns.masses),
          forces_(forces) {}

    void begin(int64_t step) override {
        forces_.evaluate(masses_, step - plan_.settle_steps);
        kick(masses_, step);
    }

    void finish(int64_t step) override {
        drift(masses_, step);
        change_velocities();
        forces_.drift(plan_.time_step, leapfrog_, double(share(step)));
    }

    bool whole(int64_t step, int64_t count) override {
        if (!forces_.local()) return false;
        for (int64_t n = 0; n < count; ++n) {
            together_[n] = masses_;
            change_velocities();
        }
        forces_.evaluate_parts(together_, step - plan_.settle_steps, count,
                               [&](const auto& part, int64_t n) {
                                   kick(part, step + n);
                                   drift(part, step + n);
                               });
        return true;
    }

    void velocity_now(int64_t step, bool begun, S* const out[3]) const override {
        // at n = 0, and at every step of symplectic Euler, u is the velocity at t_n; a diverged
        // robot has no better one
        const bool between = leapfrog_ && step > 0 && begun;
        for (int axis = 0; axis < 3; ++axis)
            for (int32_t i = 0; i < body_.masses; ++i) {
                const int32_t site = body_.sites[i];
                const S before = masses_.velocity[axis][site],
                        after = masses_.next_velocity[axis][site];
                out[axis][site] = between ? S(0.5) * (before + after) : before;
            }
    }

private:
    static S share(int64_t step) { return step == 0 ? S(1) : S(0.5); }

    // Kick and impulses of some masses, or of all.
    void kick(const mass_arrays<S>& masses, int64_t step) {
        const double h = leapfrog_ && step == 0 ? 0.5 * plan_.time_step : plan_.time_step;
        passes_.kick[compensated](masses, S(h));
        forces_.push(masses, S(h));
    }
    void drift(const mass_arrays<S>& masses, int64_t step) {
        passes_.drift[compensated][leapfrog_](masses, S(plan_.time_step), share(step));
    }
    // The velocities after the kick become those before the next one.
    void change_velocities() {
        for (int axis = 0; axis < 3; ++axis) {
            std::swap(masses_.velocity[axis], masses_.next_velocity[axis]);
            if (!leapfrog_) masses_.predicted[axis] = masses_.velocity[axis];
        }
    }

    const bool leapfrog_;
    const schedule& plan_;
    const spring_body& body_;
    const step_passes<S>& passes_;
    mass_arrays<S>& masses_;
    robot_forces<S, compensated>& forces_;
    mass_arrays<S> together_[most_steps_at_once];  // at each step of whole()
};

}  // namespace limax::cpu
