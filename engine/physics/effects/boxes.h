// boxes.h: fixed boxes along the axes that push a mass out through the face that is nearest to it.
// SI units.
#pragma once

#include "physics/effects/contact.h"

namespace limax::effects {

// The depth of a place below the surface of a box with half edges `half` about 0, and the normal of
// the nearest face. Of equally near faces the upper or lower one is taken first, then the one along
// x; of two opposite ones the one on the positive side.
template <class R>
LIMAX_LAW surface_point<R, vector<R>> nearest_face(const vector<R>& half, const vector<R>& place) {
    const R dx = half.x - absolute(place.x), dy = half.y - absolute(place.y),
            dz = half.z - absolute(place.z);
    const bool by_z = dz <= dx && dz <= dy, by_x = !by_z && dx <= dy;
    const R sx = place.x < R(0) ? R(-1) : R(1), sy = place.y < R(0) ? R(-1) : R(1),
            sz = place.z < R(0) ? R(-1) : R(1);
    return {by_z ? dz : (by_x ? dx : dy),
            {by_x ? sx : R(0), by_z || by_x ? R(0) : sy, by_z ? sz : R(0)}};
}

struct boxes {
    static constexpr const char* name = "boxes";
    static constexpr const char* summary =
        "fixed boxes along the axes, which push masses out of the nearest face";
    static constexpr unsigned needs = 0;
    static constexpr unsigned hooks = hook_contact;
    static constexpr int most_instances = 16;
    static constexpr field fields[] = {
        contact_stiffness,
        contact_damping_ratio,
        {"from", "m", "lowest corner in the world", 3, -1e6, 1e6, {0.8, -0.5, 0.0}},
        {"to", "m", "highest corner", 3, -1e6, 1e6, {1.2, 0.5, 0.1}}};
    static constexpr int field_count = 4;

    // Why the values are refused, or null.
    static const char* problem(const double* values) {
        for (int axis = 0; axis < 3; ++axis)
            if (!(values[2 + axis] < values[5 + axis]))
                return "every component of 'from' must be below that of 'to'";
        return nullptr;
    }

    template <class R>
    struct params {
        R stiffness;       // N/m
        R damping;         // of unit_damping(), N s/(m kg^1/2)
        vector<R> center;  // m, relative to the robot's own origin
        vector<R> half;    // half of the edges, m
    };
    template <class R>
    LIMAX_LAW static params<R> make(const double* values, const double* origin) {
        const double* from = values + 2;
        const double* to = values + 5;
        return {
            R(values[0]),
            R(unit_damping(values[0], values[1])),
            {R(0.5 * (from[0] + to[0]) - origin[0]), R(0.5 * (from[1] + to[1]) - origin[1]),
             R(0.5 * (from[2] + to[2]) - origin[2])},
            {R(0.5 * (to[0] - from[0])), R(0.5 * (to[1] - from[1])), R(0.5 * (to[2] - from[2]))}};
    }

    template <class R>
    LIMAX_LAW static surface_point<R, vector<R>> surface(const params<R>& p,
                                                         const vector<R>& position) {
        return nearest_face(p.half, vector<R>{position.x - p.center.x, position.y - p.center.y,
                                              position.z - p.center.z});
    }

    // Whether no mass can touch both.
    LIMAX_LAW static bool apart(const double* a, const double* b) {
        bool found = false;
        for (int axis = 0; axis < 3; ++axis)
            found |= a[5 + axis] <= b[2 + axis] || b[5 + axis] <= a[2 + axis];
        return found;
    }
};

}  // namespace limax::effects
