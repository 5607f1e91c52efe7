// terrain.h: a height field that pushes what is below it: heights on a square grid, between which
// the surface is bilinear, and beyond whose border the border's height goes on. SI units.
//
// With h the height at x, y and g its gradient, the normal is n = (-g, 1) / sqrt(1 + g^2) and the
// depth d = (h - z) n_z, the distance to the plane that touches the surface above the mass. On a
// flat cell, tilted as it may be, that is the distance to the surface: force and energy are those
// of a plane, and the stiffness is k n n^T, no larger than k however steep the cell is. In a
// twisted cell, and from one to the next, n changes with x and y, which adds a term of the size of
// k d times that change: it vanishes with the depth.
#pragma once

#include "physics/effects/contact.h"

namespace limax::effects {

struct terrain {
    static constexpr const char* name = "terrain";
    static constexpr const char* summary = "a height field";
    static constexpr unsigned needs = 0;
    static constexpr unsigned hooks = hook_contact;
    static constexpr field fields[] = {
        contact_stiffness,
        contact_damping_ratio,
        {"spacing", "m", "between neighbouring heights", 1, 0.001, 1000.0, {0.1, 0, 0}},
        {"origin",
         "m",
         "of the first height along x and y, and of height 0",
         3,
         -1e6,
         1e6,
         {0.0, 0.0, 0.0}},
        {"heights", "m", "[x][y], 2 x 2 to 512 x 512", table_of_heights, -1000.0, 1000.0, {}}};
    static constexpr int field_count = 5;

    LIMAX_LAW static double spacing_of(const double* values) { return values[2]; }  // m

    template <class R>
    struct params {
        R stiffness;        // N/m
        R damping;          // of unit_damping(), N s/(m kg^1/2)
        R inverse_spacing;  // 1/m
        vector<R> origin;   // m, relative to the robot's own
        height_table table;
    };
    template <class R>
    LIMAX_LAW static params<R> make(const double* values, const double* origin) {
        params<R> p{
            R(values[0]), R(unit_damping(values[0], values[1])), R(1.0 / values[2]), {}, {}};
        follow(p, values, origin);
        return p;
    }
    template <class R>
    LIMAX_LAW static void follow(params<R>& p, const double* values, const double* origin) {
        p.origin = {R(values[3] - origin[0]), R(values[4] - origin[1]), R(values[5] - origin[2])};
    }

    // A coordinate in cells, held within the table: which cell, where in it (0 to 1), and whether
    // the surface may slope along it. NaN counts as 0.
    template <class R>
    struct cell {
        int32_t index;
        R share;
        bool within;
    };
    template <class R>
    LIMAX_LAW static cell<R> cell_at(R along, int32_t count) {
        const R last = R(count - 1);
        const R low = along > R(0) ? along : R(0);
        const R held = low < last ? low : last;
        const int32_t below = int32_t(held);
        const int32_t index = below < count - 2 ? below : count - 2;
        return {index, held - R(index), along > R(0) && along < last};
    }

    template <class R>
    LIMAX_LAW static surface_point<R, vector<R>> surface(const params<R>& p,
                                                         const vector<R>& position) {
        const cell<R> x = cell_at((position.x - p.origin.x) * p.inverse_spacing, p.table.nx);
        const cell<R> y = cell_at((position.y - p.origin.y) * p.inverse_spacing, p.table.ny);
        const float* corner = p.table.heights + (x.index * p.table.ny + y.index);
        const float* next = corner + p.table.ny;
        const R near_low = R(corner[0]), near_high = R(corner[1]);
        const R far_low = R(next[0]), far_high = R(next[1]);
        // along y at both ends of x, then along x
        const R near = fma(y.share, near_high - near_low, near_low);
        const R far = fma(y.share, far_high - far_low, far_low);
        const R height = p.origin.z + fma(x.share, far - near, near);
        const R rise =
            fma(x.share, (far_high - far_low) - (near_high - near_low), near_high - near_low);
        const R slope_x = x.within ? (far - near) * p.inverse_spacing : R(0);
        const R slope_y = y.within ? rise * p.inverse_spacing : R(0);
        const R up = inverse_length(fma(slope_x, slope_x, fma(slope_y, slope_y, R(1))));
        return {(height - position.z) * up, {-slope_x * up, -slope_y * up, up}};
    }
};

}  // namespace limax::effects
