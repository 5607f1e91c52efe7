// block.h: a rigid box that a robot may push, carry or fall over: six degrees of freedom. A scene
// may have several, each once for each robot; they keep the order in which they are listed, since
// sensors, outcomes and fitness read the first. Gravity acts on it, every fixed contact of the
// scene acts on its corners, and masses of the body inside it are pushed out through the nearest
// face, with the opposite force on it. Friction acts on both. SI units. physics/rigid_body.h holds
// how it turns, physics/solid_pairs.h how blocks act on each other.
//
// A mass at depth d > 0 below the block's surface is pushed along the normal n there by
//     N = max(0, k d - c w.n),   c = 2 zeta sqrt(k m_r),
// w its velocity relative to the block's at that place, m_r the reduced mass of the two. A corner
// at a depth below a fixed contact is pushed by the law of that contact on a mass of m / 4: a block
// that stands on four corners then has the contact's own damping ratio.
#pragma once

#include "physics/effects/boxes.h"

namespace limax::effects {

struct block {
    static constexpr const char* name = "block";
    static constexpr const char* summary =
        "rigid boxes that the body can push and carry; gravity, obstacles at their corners, "
        "friction and each other act on them";
    static constexpr unsigned needs = 0;
    static constexpr unsigned hooks = hook_solid | hook_bound;
    static constexpr int most_instances = 4;
    static constexpr bool keeps_order = true;
    static constexpr field fields[] = {
        {"size", "m", "edges along x, y, z", 3, 1e-3, 1000.0, {0.3, 0.5, 0.3}},
        {"position",
         "m",
         "of its lowest corner, relative to the body's lowest corner at the start",
         3,
         -1e6,
         1e6,
         {0.6, 0.0, 0.0}},
        {"mass", "kg", "of the block", 1, 1e-3, 1e6, {1.0, 0, 0}},
        {"stiffness", "N/m", "of each contact", 1, 1.0, 1e9, {1e4, 0, 0}},
        {"damping_ratio", "1", "of each contact", 1, 0.0, 2.0, {0.1, 0, 0}},
        {"velocity", "m/s", "at the start, x, y, z", 3, -1e6, 1e6, {0.0, 0.0, 0.0}},
        {"spin", "rad/s", "angular velocity at the start", 3, -1e6, 1e6, {0.0, 0.0, 0.0}}};
    static constexpr int field_count = 7;
    // Where a field's components begin among the values.
    static constexpr int at_position = 3, at_velocity = 9, at_spin = 12;

    // Share of the block that a corner carries: it stands on four.
    static constexpr double corner_share = 0.25;

    template <class R>
    struct params {
        vector<R> half;  // half of the edges, m
        R mass;          // kg
        R stiffness;     // N/m
        R damping;       // of unit_damping(), N s/(m kg^1/2)
    };
    template <class R>
    LIMAX_LAW static params<R> make(const double* values, const double* /*origin*/) {
        return {{R(0.5 * values[0]), R(0.5 * values[1]), R(0.5 * values[2])},
                R(values[6]),
                R(values[7]),
                R(unit_damping(values[7], values[8]))};
    }

    // The depth in the block of a place in its own frame, and the normal of the nearest face.
    template <class R>
    LIMAX_LAW static surface_point<R, vector<R>> solid(const params<R>& p, const vector<R>& place) {
        return nearest_face(p.half, place);
    }

    // N of a mass at a depth that leaves the block's surface at `rate`, m/s.
    template <class R>
    LIMAX_LAW static R parts(const params<R>& p, R depth, R rate, R mass) {
        const R reduced = mass * p.mass / (mass + p.mass);
        const R damping = p.damping * square_root(reduced);
        const R push = larger(p.stiffness * depth - damping * rate, R(0));
        return depth > R(0) ? push : R(0);
    }

    // Like springs, contacts of two that move count twice. The reduced mass is below the mass's.
    LIMAX_LAW static stiffness_damping bound(const params<double>& p, double mass) {
        return {2.0 * p.stiffness, 2.0 * p.damping * square_root(mass)};
    }

    // ---- the bound of the block itself ----
    //
    // A push along n at r from the centre acts on a mass of m_e, with 1/m_e = 1/m + (r x n) I^-1
    // (r x n). Each component of r x n is bounded by Cauchy and Schwarz, so for any place in a box
    // and any n the last term is at most 6/m, and m_e at least m/7. All eight corners below one
    // flat contact: the translation has 8/m; of the rotation, with D = diag(a^2, b^2, c^2) of the
    // edges, u the axis, w = n x u, the corners' sum is 2 w.D w <= 2 (tr D - u.D u) for |u| = 1,
    // which is 24/m times the inertia about u; the two do not mix, since the corners lie evenly.
    static constexpr double most_of_place = 7.0, most_of_corners = 24.0;

    // Masses of an undeformed lattice that touch the largest face at once.
    LIMAX_LAW static double most_touching(const params<double>& p, double edge) {
        const double x = 2.0 * p.half.x / edge + 1.0, y = 2.0 * p.half.y / edge + 1.0,
                     z = 2.0 * p.half.z / edge + 1.0;
        return larger(larger(x * y, x * z), y * z);
    }
};

}  // namespace limax::effects
