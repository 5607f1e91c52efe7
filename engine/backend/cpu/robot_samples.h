// robot_samples.h: what is recorded of one robot: a sample of each trace when it is due, and the
// energy ledger, which is updated at every step. Both are of t_n, between the two parts of a
// step, where all velocities around t_n are available. SI units.
#pragma once

#include <algorithm>
#include <array>
#include <memory>

#include "backend/cpu/robot_control.h"
#include "backend/cpu/robot_state.h"
#include "backend/cpu/stepper.h"
#include "backend/cpu/traces.h"
#include "backend/cpu/work_ledger.h"
#include "physics/ledger.h"
#include "physics/time_step.h"

namespace limax::cpu {

// S and `compensated` as in robot_columns. What it is made from must outlive it.
template <class S, bool compensated>
class robot_samples {
public:
    // Muscles count `ticks` to a step. `control` is null without a controller.
    robot_samples(const schedule& plan, robot_state<S, compensated>& state, const stepper<S>& steps,
                  robot_control<S, compensated>* control, int ticks)
        : plan_(plan),
          state_(state),
          stepper_(steps),
          control_(control),
          ticks_(ticks),
          traces_(plan, state.body, state.setup.scene) {
        if (!plan.every[LIMAX_TRACE_LEDGER]) return;
        ledger_ = std::make_unique<work_ledger<S>>(state.body);
        state.forces.set_ledger(*ledger_);
    }

    // Before a tick of the controller: the muscles' power of the step that ends here.
    void before_tick(int64_t step) {
        if (!ledger_) return;
        control_->show_measures();
        const mass_arrays<S>& masses = state_.columns.masses;
        powers now;
        double ahead = 0;
        add_spring_powers(
            state_.body, state_.setup.scene,
            moving_masses<S>{masses.position, masses.predicted, masses.predicted, state_.origin},
            state_.forces.muscles_around(ticks_ * (step - plan_.settle_steps), ticks_), now, ahead);
        ended_power_ = now.of[work_muscles];
        tick_ = step;
    }

    // Is nothing of step n recorded?
    bool idle(int64_t step) const {
        const int64_t since = step - plan_.settle_steps;
        if (since < 0) return true;
        for (int kind = 0; kind < LIMAX_TRACE_KINDS; ++kind)
            if (traces_.due(kind, since)) return false;
        return !ledger_;
    }
    // Records step n once it has begun; does nothing before t = 0.
    void take(int64_t step) {
        const int64_t since = step - plan_.settle_steps;
        if (since < 0) return;
        if (control_ && (ledger_ || traces_.due(LIMAX_TRACE_ENERGY, since)))
            control_->show_measures();
        if (ledger_) update_ledger(step);
        for (int kind = 0; kind < LIMAX_TRACE_KINDS; ++kind)
            if (traces_.due(kind, since)) record(kind, step);
    }

    const traces& all() const { return traces_; }

private:
    using velocities = std::array<S*, 3>;  // [axis][site]

    // Velocities at t_n, in the scratch of forces, which is free between the two parts of a step.
    velocities velocity_at(int64_t step) const {
        S* const* scratch = state_.columns.masses.force;
        const velocities velocity = {scratch[0], scratch[1], scratch[2]};
        stepper_.velocity_now(step, true, velocity.data());
        return velocity;
    }
    // Whether the velocities at t_n are half way between those before and after the kick.
    bool between(int64_t step) const {
        return state_.setup.options.integrator == LIMAX_LEAPFROG && step > 0;
    }

    // Since the muscles began, s.
    double time_of(int64_t step) const {
        return double(step - plan_.settle_steps) * plan_.time_step;
    }

    // Adds the works of the moment t_n to the ledger.
    void update_ledger(int64_t step) {
        const int64_t since = step - plan_.settle_steps;
        const mass_arrays<S>& masses = state_.columns.masses;
        const scene& scene = state_.setup.scene;
        const velocities velocity = velocity_at(step);
        const moving_masses<S> seen{masses.position, masses.predicted, velocity.data(),
                                    state_.origin};
        powers now;
        double muscles_ahead = 0;
        add_spring_powers(state_.body, scene, seen,
                          state_.forces.muscles_around(ticks_ * since, ticks_), now, muscles_ahead);
        if (step == tick_) now.of[work_muscles] = ended_power_;
        add_node_powers(state_.body, scene, seen, time_of(step), now);
        now.of[work_contact_damping] += state_.forces.power_of_pairs(velocity.data());
        if (state_.blocks) {
            now.of[work_contact_damping] +=
                state_.blocks->contact_power(velocity.data(), between(step));
            now.of[work_friction] += state_.blocks->friction_power();
        }
        ledger_->add_impulse_powers(masses, now);
        ledger_->add(now, muscles_ahead, since > 0 ? plan_.time_step : 0.0);
    }

    void record(int kind, int64_t step) {
        double* out = traces_.next(kind);
        const mass_arrays<S>& masses = state_.columns.masses;
        switch (kind) {
            case LIMAX_TRACE_CENTER_OF_MASS:
                for (int axis = 0; axis < 3; ++axis) out[axis] = state_.center(axis);
                break;
            case LIMAX_TRACE_POSITION: state_.write(masses.position, state_.origin, out); break;
            case LIMAX_TRACE_VELOCITY: state_.write(velocity_at(step).data(), nullptr, out); break;
            case LIMAX_TRACE_CONTACT: {
                int64_t touching = 0;
                for (int32_t i = 0; i < state_.body.masses; ++i)
                    touching += state_.forces.touches(state_.body.sites[i]);
                out[0] = double(touching) / state_.body.masses;
                break;
            }
            case LIMAX_TRACE_ENERGY: record_energy(step, out); break;
            case LIMAX_TRACE_LEDGER: record_ledger(step, out); break;
            case LIMAX_TRACE_BLOCK: {
                double of_block[LIMAX_BLOCK_STATE];
                for (int i = 0; i < state_.blocks->count(); ++i) {
                    solid::write_state(state_.blocks->at(i), state_.origin, between(step),
                                       of_block);
                    out = std::copy_n(of_block, solid::sample_width, out);
                }
                break;
            }
            case LIMAX_TRACE_ACTIVATION: control_->write_activations(step, out); break;
            case LIMAX_TRACE_SENSOR: control_->write_sensors(out); break;
            case LIMAX_TRACE_STRAIN: {
                const strains strain = measure_strain<S>(state_.body, masses.position);
                out[0] = strain.mean;
                out[1] = strain.most;
                break;
            }
        }
    }

    // The energies of springs, masses and fixed contacts, without those of contacts within the
    // body.
    energies energy_now(int64_t step, const velocities& velocity) const {
        const int64_t tick = ticks_ * (step - plan_.settle_steps);
        return measure_energy<S>(state_.body, state_.setup.scene, state_.columns.masses.position,
                                 velocity.data(), state_.origin, time_of(step),
                                 state_.forces.measured_moment(tick),
                                 state_.forces.moment_rate(tick));
    }

    void record_energy(int64_t step, double* out) {
        const energies energy = energy_now(step, velocity_at(step));
        out[0] = energy.kinetic;
        out[1] = energy.elastic + state_.forces.energy_of_pairs();
        out[2] = energy.gravitational;
        out[3] = energy.power;
    }

    void record_ledger(int64_t step, double* out) {
        const velocities velocity = velocity_at(step);
        const energies energy = energy_now(step, velocity);
        const double in_pairs = state_.forces.energy_of_pairs();
        const double in_contacts =
            in_pairs + contact_energy<S>(state_.body, state_.setup.scene,
                                         {state_.columns.masses.position, velocity.data(),
                                          velocity.data(), state_.origin},
                                         time_of(step));
        out[0] = energy.kinetic;
        out[1] = energy.elastic + in_pairs - in_contacts;
        out[2] = in_contacts;
        out[3] = energy.gravitational;
        if (state_.blocks) {
            out[0] += state_.blocks->kinetic_energy(between(step));
            out[2] += state_.blocks->contact_energy();
            out[3] += state_.blocks->gravitational_energy(state_.origin);
        }
        std::copy_n(ledger_->works(), work_kinds, out + ledger_energies);
    }

    const schedule& plan_;
    robot_state<S, compensated>& state_;
    const stepper<S>& stepper_;
    robot_control<S, compensated>* const control_;
    const int ticks_;
    double ended_power_ = 0;  // of the muscles at `tick_`, before the tick, W
    int64_t tick_ = -1;
    traces traces_;
    std::unique_ptr<work_ledger<S>> ledger_;  // null unless recorded
};

}  // namespace limax::cpu
