// anchors.h: masses that stay where they start: those in a box of the body, measured at
// the start. SI units.
//
// A held mass has no velocity, and its inverse mass counts as 0, so that no force moves it. It
// keeps its mass everywhere else: in the centre of mass, and in the damping of its springs, which
// is a property of the material. It bounds no step.
#pragma once

#include "physics/effects/effect.h"

namespace limax::effects {

struct anchors {
    static constexpr const char* name = "anchors";
    static constexpr const char* summary = "masses of a part of the body that are held";
    static constexpr unsigned needs = 0;
    static constexpr unsigned hooks = hook_hold;
    static constexpr field fields[] = {
        {"from",
         "m",
         "lowest corner of that part, relative to the body's lowest corner",
         3,
         -1e6,
         1e6,
         {-1e6, -1e6, -1e6}},
        {"to",
         "m",
         "highest corner; z = 0 is the lowest layer of masses",
         3,
         -1e6,
         1e6,
         {1e6, 1e6, 0.0}}};
    static constexpr int field_count = 2;

    // Why the values are refused, or null.
    static const char* problem(const double* values) {
        for (int axis = 0; axis < 3; ++axis)
            if (values[axis] > values[3 + axis])
                return "no component of 'from' may be above that of 'to'";
        return nullptr;
    }

    template <class R>
    struct params {
        vector<R> from, to;  // m, from the body's lowest corner
    };
    template <class R>
    LIMAX_LAW static params<R> make(const double* values, const double* /*origin*/) {
        return {{R(values[0]), R(values[1]), R(values[2])},
                {R(values[3]), R(values[4]), R(values[5])}};
    }

    LIMAX_LAW static bool holds(const params<double>& p, const vector<double>& start) {
        // m: 3 edges of 0.1 m are not quite 0.3 m
        const double slack = 1e-6;
        const auto within = [&](double x, double from, double to) {
            return x >= from - slack && x <= to + slack;
        };
        return within(start.x, p.from.x, p.to.x) && within(start.y, p.from.y, p.to.y) &&
               within(start.z, p.from.z, p.to.z);
    }
};

}  // namespace limax::effects
