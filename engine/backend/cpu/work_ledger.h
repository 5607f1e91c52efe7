// work_ledger.h: adds up, step by step, what puts energy into a robot and takes it out: trapezoids
// over t_n of each effect's power, in double. Impulses count as a force over their step, at the
// mean of the velocities before and after it. Only for a robot whose ledger is recorded. SI units.
#pragma once

#include <vector>

#include "backend/cpu/passes.h"
#include "physics/ledger.h"

namespace limax::cpu {

template <class S>
class work_ledger {
public:
    explicit work_ledger(const spring_body& body) : body_(body), before_(3 * body.masses) {}

    // ---- around the impulses of a step, which change next_velocity ----

    void forget_impulses() {
        for (std::vector<double>& of_effect : impulse_) of_effect.assign(before_.size(), 0.0);
    }
    void before_impulse(const mass_arrays<S>& masses) {
        each([&](std::size_t k, int axis, int32_t site) {
            before_[k] = masses.next_velocity[axis][site];
        });
    }
    // `h` is how long the kick before it lasted, s.
    void after_impulse(const mass_arrays<S>& masses, int effect, double h) {
        each([&](std::size_t k, int axis, int32_t site) {
            impulse_[effect][k] +=
                (double(masses.next_velocity[axis][site]) - before_[k]) * body_.mass[site] / h;
        });
    }

    // ---- at t_n ----

    // Adds the impulses of this step, as forces over it.
    void add_impulse_powers(const mass_arrays<S>& masses, powers& now) const {
        effects::for_each([&]<class E>(E) {
            const std::vector<double>& force = impulse_[effects::index_of<E>];
            constexpr unsigned kicks = effects::hook_face | effects::hook_slip;
            if (!(E::hooks & kicks) || force.empty()) return;
            each([&](std::size_t k, int axis, int32_t site) {
                const double before = masses.velocity[axis][site],
                             after = masses.next_velocity[axis][site];
                now.of[account_of<E>()] += force[k] * 0.5 * (before + after);
            });
        });
    }
    // Goes on by a step, of 0 s at t = 0. `muscles_ahead` is the muscles' power of the next, W.
    void add(const powers& now, double muscles_ahead, double time_step) {
        for (int kind = 0; kind < work_kinds; ++kind)
            works_[kind] += 0.5 * time_step * (last_.of[kind] + now.of[kind]);
        last_ = now;
        last_.of[work_muscles] = muscles_ahead;
    }
    const double* works() const { return works_; }  // since t = 0, J, [work_kinds]

private:
    template <class Visit>
    void each(const Visit& visit) const {
        std::size_t k = 0;
        for (int axis = 0; axis < 3; ++axis)
            for (int32_t i = 0; i < body_.masses; ++i) visit(k++, axis, body_.sites[i]);
    }

    const spring_body& body_;
    std::vector<double> before_;                        // m/s, [axis][mass]
    std::vector<double> impulse_[effects::all::count];  // N, the same
    powers last_;
    double works_[work_kinds] = {};
};

}  // namespace limax::cpu
