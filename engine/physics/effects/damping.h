// damping.h: a dashpot along every spring, c = 2 zeta sqrt(k m_r) with m_r the reduced mass of its
// ends. SI units.
#pragma once

#include "physics/effects/effect.h"

namespace limax::effects {

struct damping {
    static constexpr const char* name = "damping";
    static constexpr const char* summary = "dashpots along the springs";
    static constexpr unsigned needs = 0;
    static constexpr unsigned hooks = hook_pair | hook_bound;
    static constexpr int field_count = 0;
    static constexpr const field* fields = nullptr;

    // c dr/dt, N.
    template <class R>
    LIMAX_LAW static spring_force<R> pair(const spring_state<R>& s, const spring_force<R>& sum) {
        return {sum.scale, fma(-s.damping, s.rate, sum.push)};
    }

    LIMAX_LAW static stiffness_damping bound(double /*stiffness*/, double damping) {
        return {0.0, damping};
    }
};

}  // namespace limax::effects
