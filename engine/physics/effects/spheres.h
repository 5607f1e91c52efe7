// spheres.h: fixed balls that push a mass out along the line from their centre. SI units.
#pragma once

#include "physics/effects/contact.h"

namespace limax::effects {

struct spheres {
    static constexpr const char* name = "spheres";
    static constexpr const char* summary = "fixed spheres";
    static constexpr unsigned needs = 0;
    static constexpr unsigned hooks = hook_contact;
    static constexpr int most_instances = 16;
    // beyond 100 m fp32 would resolve the surface no better than a hundredth of a millimetre
    static constexpr field fields[] = {
        contact_stiffness,
        contact_damping_ratio,
        {"center", "m", "in the world", 3, -1e6, 1e6, {1.0, 0.0, 0.0}},
        {"radius", "m", "of the sphere", 1, 0.001, 100.0, {0.2, 0, 0}}};
    static constexpr int field_count = 4;

    template <class R>
    struct params {
        R stiffness;       // N/m
        R damping;         // of unit_damping(), N s/(m kg^1/2)
        vector<R> center;  // m, relative to the robot's own origin
        R radius;          // m
    };
    template <class R>
    LIMAX_LAW static params<R> make(const double* values, const double* origin) {
        return {R(values[0]),
                R(unit_damping(values[0], values[1])),
                {R(values[2] - origin[0]), R(values[3] - origin[1]), R(values[4] - origin[2])},
                R(values[5])};
    }

    // At the very centre the way out is up.
    template <class R>
    LIMAX_LAW static surface_point<R, vector<R>> surface(const params<R>& p,
                                                         const vector<R>& position) {
        const vector<R> out{position.x - p.center.x, position.y - p.center.y,
                            position.z - p.center.z};
        const R squared = dot(out, out);
        // m^2: below it the direction is undefined
        const R tiny = R(1e-30);
        const R inverse = inverse_length(larger(squared, tiny));
        const bool centered = squared <= tiny;
        return {fma(-squared, inverse, p.radius),
                {centered ? R(0) : out.x * inverse, centered ? R(0) : out.y * inverse,
                 centered ? R(1) : out.z * inverse}};
    }

    // Whether no mass can touch both.
    LIMAX_LAW static bool apart(const double* a, const double* b) {
        const double x = a[2] - b[2], y = a[3] - b[3], z = a[4] - b[4], reach = a[5] + b[5];
        return x * x + y * y + z * z >= reach * reach;
    }
};

}  // namespace limax::effects
