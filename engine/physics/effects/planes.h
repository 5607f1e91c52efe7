// planes.h: planes in any position, each with its own stiffness and damping; a tilted one is a
// slope, two are a gorge. SI units.
//
// A plane is n.x = offset with n the unit vector along `normal`; a mass at n.x < offset
// is below it and is pushed along n.
#pragma once

#include "physics/effects/contact.h"

namespace limax::effects {

struct planes {
    static constexpr const char* name = "planes";
    static constexpr const char* summary = "planes in any position";
    static constexpr unsigned needs = 0;
    static constexpr unsigned hooks = hook_contact;
    static constexpr int most_instances = 16;
    static constexpr field fields[] = {
        contact_stiffness,
        contact_damping_ratio,
        {"normal", "1", "outward, of any length but 0", 3, -1e6, 1e6, {0.0, 0.0, 1.0}},
        {"offset",
         "m",
         "of the plane from the world's origin, along the normal",
         1,
         -1e6,
         1e6,
         {0.0, 0, 0}}};
    static constexpr int field_count = 4;

    // Why the values are refused, or null.
    static const char* problem(const double* values) {
        const double* n = values + 2;
        return n[0] == 0 && n[1] == 0 && n[2] == 0 ? "normal is 0: it has no direction" : nullptr;
    }

    template <class R>
    struct params {
        R stiffness;       // N/m
        R damping;         // of unit_damping(), N s/(m kg^1/2)
        vector<R> normal;  // of length 1
        R offset;          // m, from the robot's own origin
    };
    template <class R>
    LIMAX_LAW static params<R> make(const double* values, const double* origin) {
        // the largest component first: no square overflows or vanishes
        const double* n = values + 2;
        const double most = larger(larger(absolute(n[0]), absolute(n[1])), absolute(n[2]));
        const double x = n[0] / most, y = n[1] / most, z = n[2] / most;
        const double inverse = 1.0 / square_root(x * x + y * y + z * z);
        const vector<double> unit{x * inverse, y * inverse, z * inverse};
        const vector<double> here{origin[0], origin[1], origin[2]};
        return {R(values[0]),
                R(unit_damping(values[0], values[1])),
                {R(unit.x), R(unit.y), R(unit.z)},
                R(values[5] - dot(unit, here))};
    }

    template <class R>
    LIMAX_LAW static surface_point<R, vector<R>> surface(const params<R>& p,
                                                         const vector<R>& position) {
        return {p.offset - dot(p.normal, position), p.normal};
    }
};

}  // namespace limax::effects
