// springs.h: Hooke's law along a spring. Every scene has it. SI units.
#pragma once

#include "physics/effects/effect.h"

namespace limax::effects {

struct springs {
    static constexpr const char* name = "springs";
    static constexpr const char* summary = "Hooke's law along every spring";
    static constexpr unsigned needs = 0;
    static constexpr unsigned hooks = hook_pair | hook_energy | hook_bound;
    static constexpr int field_count = 0;
    static constexpr const field* fields = nullptr;

    // k (r - L), N. Springs of the same owners share k L.
    template <class R>
    LIMAX_LAW static spring_force<R> pair(const spring_state<R>& s, const spring_force<R>& sum) {
        return {sum.scale + s.stiffness, fma(s.stiffness, s.rest, sum.push)};
    }

    // The same where k L is known, N.
    template <class R>
    LIMAX_LAW static spring_force<R> of_pull(const spring_state<R>& s, R pull) {
        return {s.stiffness, pull};
    }

    // k (r - L)^2 / 2, J.
    template <class R>
    LIMAX_LAW static R energy(const spring_state<R>& s) {
        const R stretch = s.length - s.rest;
        return R(0.5) * s.stiffness * stretch * stretch;
    }

    // A spring's stiffness block has norm at most k in any pose with r >= L / 2.
    LIMAX_LAW static stiffness_damping bound(double stiffness, double /*damping*/) {
        return {stiffness, 0.0};
    }
};

}  // namespace limax::effects
