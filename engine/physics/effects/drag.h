// drag.h: a fluid that presses on the exposed faces of a body, quadratically and along their
// normals: F = -(1/2) rho C A |v_n| v_n n, with v the mean velocity of a face's four corners
// relative to the fluid's current. SI units. It has no part along a face and no added mass.
//
// Each corner takes a quarter of F h as an impulse. F reads the velocities of t_n that forces read,
// so a steady fall is exact and the order of the integrator stays; only where F h would take more
// than half of the corners' momentum along n at once, it takes that half. So it is safe at any
// speed and needs no bound on the step: at most four faces of one axis meet in a corner, a quarter
// each, and with every impulse g w_n, 0 <= g <= m/2, m the lightest of the face's corners and w_n
// the mean of their velocities now, the sum of g/(4 m_i) over the faces of a corner is at most 1/2.
// One axis after the other, that leaves at least half of every motion relative to the fluid and
// turns none around. A half, since leapfrog's forces read velocities of the step before:
// F h = m w/2 has the derivative m, the largest damping for which leapfrog is stable.
#pragma once

#include "physics/effects/contact.h"

namespace limax::effects {

struct drag {
    static constexpr const char* name = "drag";
    static constexpr const char* summary =
        "pressure of a fluid on exposed faces along their normals, (1/2) density coefficient A "
        "v_n^2";
    static constexpr unsigned needs = 0;
    static constexpr unsigned hooks = hook_face;
    static constexpr field fields[] = {
        {"density", "kg/m^3", "of the fluid", 1, 0.0, 1e5, {1000.0, 0, 0}},
        {"coefficient", "1", "of a face across the flow", 1, 0.0, 1000.0, {1.0, 0, 0}},
        {"current",
         "m/s",
         "the fluid's own velocity along x, y, z",
         3,
         -1000.0,
         1000.0,
         {0.0, 0.0, 0.0}}};
    static constexpr int field_count = 3;

    // The largest share of the momentum along a face's normal that one step may take.
    static constexpr double most_taken = 0.5;

    template <class R>
    struct params {
        vector<R> current;  // m/s
        R half_density;     // rho C / 2, kg/m^3
    };
    template <class R>
    LIMAX_LAW static params<R> make(const double* values, const double* /*origin*/) {
        return {{R(values[2]), R(values[3]), R(values[4])}, R(0.5 * values[0] * values[1])};
    }

    template <class R>
    LIMAX_LAW static vector<R> relative(const params<R>& p, const vector<R>& v) {
        return {v.x - p.current.x, v.y - p.current.y, v.z - p.current.z};
    }

    template <class R>
    LIMAX_LAW static vector<R> face(const params<R>& p, const face_state<R>& s, R h) {
        // m^4: so small that it changes no face, and one without area gets no impulse
        const R least_squared = R(1e-20);
        // velocities along the normal times the area, m^3/s
        const R flow = dot(relative(p, s.velocity), s.area);
        const R after = dot(relative(p, s.after), s.area);
        const R wanted = p.half_density * h * absolute(flow) * flow;
        const R most = R(most_taken) * s.mass * after;
        const R taken = larger(smaller(wanted, larger(most, R(0))), smaller(most, R(0)));
        const R scale = -taken / (dot(s.area, s.area) + least_squared);
        return {scale * s.area.x, scale * s.area.y, scale * s.area.z};
    }
};

}  // namespace limax::effects
