// self_collision.h: parts of a body that are not neighbours push each other apart when they come
// close. SI units.
//
// Every pair of masses on the body's surface that neither a spring nor a chain of two joins is a
// separate contact: at distance r below the reach R it is pushed apart by
//     N = max(0, k (R - r) - c dr/dt),   c = 2 zeta sqrt(k m_r),
// m_r the reduced mass of the pair. With R one edge, a mass that comes up to the middle of a face
// touches the four masses of its corners 0.7 edges away. No friction between parts.
#pragma once

#include "physics/effects/effect.h"

namespace limax::effects {

struct self_collision {
    static constexpr const char* name = "self_collision";
    static constexpr const char* summary = "contact between parts of a body";
    static constexpr unsigned needs = 0;
    static constexpr unsigned hooks = hook_meet | hook_bound;
    static constexpr field fields[] = {
        {"stiffness", "N/m", "of each pair of masses", 1, 1.0, 1e7, {2e3, 0, 0}},
        {"damping_ratio", "1", "of each pair of masses", 1, 0.0, 2.0, {0.1, 0, 0}},
        {"reach", "1", "of contact, in edges of a voxel", 1, 0.1, 1.5, {1.0, 0, 0}}};
    static constexpr int field_count = 3;

    // Contacts per mass that the bound assumes. A half ball of one edge on the surface of another
    // part holds at most eight sites of an undeformed lattice.
    static constexpr double most_pairs = 8.0;

    template <class R>
    struct params {
        R stiffness;      // N/m
        R damping_ratio;  // 1
        R reach;          // edges
    };
    template <class R>
    LIMAX_LAW static params<R> make(const double* values, const double* /*origin*/) {
        return {R(values[0]), R(values[1]), R(values[2])};
    }

    template <class R>
    LIMAX_LAW static R meet(const params<R>& p, const pair_state<R>& s) {
        const R damping = R(2) * p.damping_ratio * square_root(p.stiffness * s.reduced_mass);
        const R push = larger(p.stiffness * s.depth - damping * s.rate, R(0));
        return s.depth > R(0) ? push : R(0);
    }

    // k d^2 / 2 while d > 0, J.
    template <class R>
    LIMAX_LAW static R stored(const params<R>& p, const pair_state<R>& s) {
        return s.depth > R(0) ? R(0.5) * p.stiffness * s.depth * s.depth : R(0);
    }

    // Like springs, pairs count twice: both ends move. The reduced mass is below either.
    LIMAX_LAW static stiffness_damping bound(const params<double>& p, double mass) {
        return {2.0 * most_pairs * p.stiffness,
                2.0 * most_pairs * 2.0 * p.damping_ratio * square_root(p.stiffness * mass)};
    }
};

}  // namespace limax::effects
