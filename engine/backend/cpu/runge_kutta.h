// runge_kutta.h: the order of a step of RK4: four force evaluations, at t_n, twice at t_n + dt/2
// and at t_n + dt, each where the slopes of the one before lead, then one move. Positions and
// velocities are those of t_n. It has no impulses: a scene with them is refused. SI units.
#pragma once

#include "backend/cpu/forces.h"
#include "backend/cpu/stepper.h"
#include "physics/time_step.h"

namespace limax::cpu {

// S and `compensated` as in robot_columns. What it is made from must outlive it.
template <class S, bool compensated>
class runge_kutta final : public stepper<S> {
public:
    // The muscles' clock has a tick at each half step, so that their phase is exact there too.
    static constexpr int ticks_per_step = 2;

    runge_kutta(const schedule& plan, const spring_body& body, const pass_table& passes,
                robot_columns<S, compensated>& columns, robot_forces<S, compensated>& forces)
        : plan_(plan),
          body_(body),
          passes_(passes_of<S>(passes)),
          masses_(columns.masses),
          forces_(forces) {
        // far ends of padded springs are read past the last column's end
        const int64_t column = body.count + padded(longest_step(body.grid));
        memory_ = array<S>(12 * column);
        S* next = memory_.data();
        for (int axis = 0; axis < 3; ++axis)
            for (S** to : {&between_.position[axis], &between_.velocity[axis],
                           &between_.position_slope[axis], &between_.velocity_slope[axis]}) {
                *to = next;
                next += column;
            }
    }

    // The slopes at t_n.
    void begin(int64_t step) override {
        const double dt = plan_.time_step;
        forces_.evaluate(masses_, tick(step));
        passes_.stage[compensated][true](masses_, between_, S(1), S(0.5 * dt));
    }

    void finish(int64_t step) override {
        const double dt = plan_.time_step;
        mass_arrays<S> seen = masses_;
        for (int axis = 0; axis < 3; ++axis) {
            seen.position[axis] = between_.position[axis];
            seen.predicted[axis] = between_.velocity[axis];
        }
        forces_.evaluate(seen, tick(step) + 1);
        passes_.stage[compensated][false](masses_, between_, S(2), S(0.5 * dt));
        forces_.evaluate(seen, tick(step) + 1);
        passes_.stage[compensated][false](masses_, between_, S(2), S(dt));
        forces_.evaluate(seen, tick(step) + 2);
        passes_.stage_end[compensated](masses_, between_, S(dt / 6.0));
    }

    void velocity_now(int64_t, bool, S* const out[3]) const override {
        for (int axis = 0; axis < 3; ++axis)
            for (int32_t i = 0; i < body_.masses; ++i)
                out[axis][body_.sites[i]] = masses_.velocity[axis][body_.sites[i]];
    }

    void release() override { memory_ = array<S>(); }

private:
    int64_t tick(int64_t step) const { return ticks_per_step * (step - plan_.settle_steps); }

    const schedule& plan_;
    const spring_body& body_;
    const step_passes<S>& passes_;
    mass_arrays<S>& masses_;
    robot_forces<S, compensated>& forces_;
    array<S> memory_;  // the columns of `between_`
    stage_arrays<S> between_{};
};

}  // namespace limax::cpu
