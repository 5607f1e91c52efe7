// ground.h: a horizontal plane that pushes what is below it and never pulls: N = max(0, k_g d -
// c_g v_n) while d > 0. c_g = 2 zeta_g sqrt(k_g m) of the mass that touches. SI units.
#pragma once

#include "physics/effects/effect.h"

namespace limax::effects {

struct ground {
    static constexpr const char* name = "ground";
    static constexpr const char* summary = "a plane that pushes and never pulls";
    static constexpr const char* needs = "";
    static constexpr unsigned hooks = hook_node | hook_energy | hook_bound;
    static constexpr field fields[] = {
        {"stiffness", "N/m", "k_g, of each mass that touches", 1, 1.0, 1e9, {1e5, 0, 0}},
        {"damping_ratio", "1", "zeta_g, of each mass that touches", 1, 0.0, 2.0, {0.1, 0, 0}},
        {"height", "m", "of the plane", 1, -1e6, 1e6, {0.0, 0, 0}}};
    static constexpr int field_count = 3;

    template <class R>
    struct params {
        R stiffness;      // N/m
        R damping_ratio;  // 1
        R height;         // m, relative to the robot's own origin
    };
    template <class R>
    LIMAX_LAW static params<R> make(const double* values, const double* origin) {
        return {R(values[0]), R(values[1]), R(values[2] - origin[2])};
    }
    template <class R>
    LIMAX_LAW static void follow(params<R>& p, const double* values, const double* origin) {
        p.height = R(values[2] - origin[2]);
    }

    template <class R>
    LIMAX_LAW static R depth(const params<R>& p, const node_state<R>& s) {
        return p.height - s.position.z;
    }

    template <class R>
    LIMAX_LAW static void node(const params<R>& p, const node_state<R>& s, node_force<R>& force) {
        const R damping = R(2) * p.damping_ratio * square_root(p.stiffness * s.mass);
        const R d = depth(p, s);
        const R push = larger(p.stiffness * d - damping * s.velocity.z, R(0));
        force.normal = d > R(0) ? push : R(0);
        force.total.z += force.normal;
    }

    // k_g d^2 / 2 while d > 0, J.
    template <class R>
    LIMAX_LAW static R energy(const params<R>& p, const node_state<R>& s) {
        const R d = depth(p, s);
        return d > R(0) && s.mass > R(0) ? R(0.5) * p.stiffness * d * d : R(0);
    }

    // Any mass may come to touch the ground.
    LIMAX_LAW static stiffness_damping bound(const params<double>& p, double mass) {
        return {p.stiffness, 2.0 * p.damping_ratio * square_root(p.stiffness * mass)};
    }
};

}  // namespace limax::effects
