// body_frame.h: a frame fitted to a body, and its velocity and spin: what sensors of the body read.
// Sums of whole numbers over the masses, so that no order and no number of threads changes a bit;
// the rest is computed once for a robot. Includes laws only. SI units.
#pragma once

#include "physics/effects/all.h"
#include "physics/rigid_body.h"
#include "physics/sensors.h"

namespace limax::sensors {

using dvector = effects::vector<double>;

// The sums, each of a mass's share of the whole times: 1; x and its velocity v; x x^T; x cross v;
// x X^T, with X the place in the lattice, in edges; X; X X^T.
enum sum : int {
    sum_x = 0,
    sum_v = 3,
    sum_xx = 6,   // xx, xy, xz, yy, yz, zz
    sum_xv = 12,  // x cross v
    sum_xX = 15,  // [axis of x][axis of X]
    sum_X = 24,
    sum_XX = 27,  // as sum_xx
    body_sums = 33
};

LIMAX_LAW double component(const dvector& a, int axis) {
    return axis == 0 ? a.x : axis == 1 ? a.y : a.z;
}
LIMAX_LAW double symmetric_product(const dvector& a, int number) {
    return number < 3   ? a.x * component(a, number)
           : number < 5 ? a.y * component(a, number - 2)
                        : a.z * a.z;
}
// What a mass with this share of the whole adds to a sum.
LIMAX_LAW int64_t part_of_sum(int number, double share, const dvector& x, const dvector& v,
                              const dvector& X) {
    double value = 0;
    if (number < sum_v)
        value = component(x, number);
    else if (number < sum_xx)
        value = component(v, number - sum_v);
    else if (number < sum_xv)
        value = symmetric_product(x, number - sum_xx);
    else if (number < sum_xX)
        value = number == sum_xv       ? x.y * v.z - x.z * v.y
                : number == sum_xv + 1 ? x.z * v.x - x.x * v.z
                                       : x.x * v.y - x.y * v.x;
    else if (number < sum_X)
        value = component(x, (number - sum_xX) / 3) * component(X, (number - sum_xX) % 3);
    else if (number < sum_XX)
        value = component(X, number - sum_X);
    else
        value = symmetric_product(X, number - sum_XX);
    const double scaled = share * value * 0x1p40;
    // what does not fit is of a body that diverges
    return absolute(scaled) < 0x1p62 ? static_cast<int64_t>(scaled) : 0;
}

struct body_frame {
    dvector axis[3];   // unit vectors in the world
    dvector center;    // m, from the robot's own origin
    dvector velocity;  // of the centre, m/s, in the world
    dvector spin;      // rad/s, in the world

    LIMAX_LAW dvector into(const dvector& a) const {
        return {inner(axis[0], a), inner(axis[1], a), inner(axis[2], a)};
    }
};

struct matrix {
    double at[3][3];
};
LIMAX_LAW matrix symmetric(const double s[6]) {
    return {{{s[0], s[1], s[2]}, {s[1], s[3], s[4]}, {s[2], s[4], s[5]}}};
}
// The solution y of m y = b, by cofactors; 0 where m is singular.
LIMAX_LAW dvector solve(const matrix& m, const dvector& b) {
    const auto minor = [&](int i, int j) {
        const int r = (i + 1) % 3, s = (i + 2) % 3, p = (j + 1) % 3, q = (j + 2) % 3;
        return m.at[r][p] * m.at[s][q] - m.at[r][q] * m.at[s][p];
    };
    const double determinant =
        m.at[0][0] * minor(0, 0) + m.at[0][1] * minor(0, 1) + m.at[0][2] * minor(0, 2);
    const double inverse = determinant != 0.0 ? 1.0 / determinant : 0.0;
    const auto row = [&](int j) {
        return (minor(0, j) * b.x + minor(1, j) * b.y + minor(2, j) * b.z) * inverse;
    };
    return {row(0), row(1), row(2)};
}
LIMAX_LAW dvector unit_of(const dvector& a, const dvector& otherwise) {
    const double squared = inner(a, a);
    if (!(squared > 0.0)) return otherwise;
    const double inverse = 1.0 / square_root(squared);
    return {a.x * inverse, a.y * inverse, a.z * inverse};
}

// The frame from the sums: the map x = c + F X that fits best, made orthonormal: the x axis first,
// then the y axis. The spin is that of a rigid body with the same angular momentum.
LIMAX_LAW body_frame frame_of(const int64_t sums[body_sums]) {
    double s[body_sums];
    for (int i = 0; i < body_sums; ++i) s[i] = static_cast<double>(sums[i]) * 0x1p-40;
    const dvector c{s[sum_x], s[sum_x + 1], s[sum_x + 2]};
    const dvector v{s[sum_v], s[sum_v + 1], s[sum_v + 2]};
    const dvector C{s[sum_X], s[sum_X + 1], s[sum_X + 2]};
    double spread[6], inertia[6], about[6];
    for (int i = 0; i < 6; ++i) {
        spread[i] = s[sum_XX + i] - symmetric_product(C, i);
        about[i] = s[sum_xx + i] - symmetric_product(c, i);
    }
    const double trace = about[0] + about[3] + about[5];
    for (int i = 0; i < 6; ++i) inertia[i] = (i == 0 || i == 3 || i == 5 ? trace : 0.0) - about[i];
    const dvector carried = cross(c, v);
    const dvector momentum{s[sum_xv] - carried.x, s[sum_xv + 1] - carried.y,
                           s[sum_xv + 2] - carried.z};
    // rows of F: F S = A
    dvector row[3];
    for (int i = 0; i < 3; ++i)
        row[i] = solve(symmetric(spread), {s[sum_xX + 3 * i] - component(c, i) * C.x,
                                           s[sum_xX + 3 * i + 1] - component(c, i) * C.y,
                                           s[sum_xX + 3 * i + 2] - component(c, i) * C.z});
    body_frame frame;
    frame.center = c;
    frame.velocity = v;
    frame.spin = solve(symmetric(inertia), momentum);
    frame.axis[0] = unit_of({row[0].x, row[1].x, row[2].x}, {1, 0, 0});
    const dvector second{row[0].y, row[1].y, row[2].y};
    frame.axis[1] = unit_of(plus(second, -inner(frame.axis[0], second), frame.axis[0]), {0, 1, 0});
    frame.axis[2] = cross(frame.axis[0], frame.axis[1]);
    return frame;
}

// Whether a controller reads what is measured once for the body.
LIMAX_LAW constexpr bool reads_body(uint64_t mask) { return reads(mask, gravity, measured); }

// What a scene tells the sensors besides the body; places from the robot's own origin.
struct surroundings {
    dvector gravity, target, block, block_velocity;
    bool has_target, has_block;
};

// Fills the inputs from `gravity` on up to `measured`, out[0] being the first. `height(x, y)` is
// that of the ground, m.
template <class Height>
LIMAX_LAW void sense_body(const body_frame& frame, const surroundings& around, double edge,
                          const Height& height, double out[measured - gravity]) {
    const auto put = [&](int at, const dvector& a, double factor) {
        out[at - gravity] = a.x * factor;
        out[at - gravity + 1] = a.y * factor;
        out[at - gravity + 2] = a.z * factor;
    };
    const dvector none{0, 0, 0};
    put(gravity, frame.into(unit_of(around.gravity, none)), scale<gravity, double>);
    put(velocity, frame.into(frame.velocity), scale<velocity, double>);
    put(spin, frame.into(frame.spin), scale<spin, double>);
    const dvector way = around.has_target ? plus(around.target, -1.0, frame.center) : none;
    put(target, frame.into(unit_of(way, none)), scale<target, double>);
    out[target_distance - gravity] = square_root(inner(way, way)) * scale<target_distance, double>;
    put(block, around.has_block ? frame.into(plus(around.block, -1.0, frame.center)) : none,
        scale<block, double>);
    put(block_velocity, around.has_block ? frame.into(around.block_velocity) : none,
        scale<block_velocity, double>);
    const dvector forward = unit_of({frame.axis[0].x, frame.axis[0].y, 0}, {1, 0, 0});
    const double below = height(frame.center.x, frame.center.y);
    double rise[3];
    for (int i = 0; i < 3; ++i) {
        const dvector there = plus(frame.center, 2.0 * (i + 1) * edge, forward);
        rise[i] = height(there.x, there.y) - below;
    }
    put(ahead, {rise[0], rise[1], rise[2]}, scale<ahead, double>);
}

// The height of a surface above (x, y), m.
template <class E, class P>
LIMAX_LAW double height_of(const P& params, double x, double y) {
    const auto point = E::surface(params, dvector{x, y, 0.0});
    return point.depth / effects::along(point.normal, dvector{0, 0, 1});
}

// What a scene, of the host or of a kernel, states for the sensors at a time, s since the muscles
// began.
template <class Scene>
LIMAX_LAW surroundings surroundings_of(const Scene& in, const double origin[3], double time) {
    surroundings around{};
    if (in.has(effects::index_of<effects::gravity>)) {
        const double* g = in.values(effects::index_of<effects::gravity>, 0);
        around.gravity = {g[0], g[1], g[2]};
    }
    using effects::target;
    if (in.has(effects::index_of<target>))
        for (int i = 0; i < in.instances(effects::index_of<target>); ++i) {
            const double* values = in.values(effects::index_of<target>, i);
            if (time < values[target::at_time]) break;
            const double* at = values + target::at_position;
            around.has_target = true;
            around.target = {at[0] - origin[0], at[1] - origin[1], at[2] - origin[2]};
        }
    return around;
}
// The higher of ground and terrain above (x, y), from the robot's own origin, m; 0 without both.
template <class Scene>
LIMAX_LAW double ground_height(const Scene& in, const double origin[3],
                               const effects::height_table& heights, double x, double y) {
    using namespace effects;
    double highest = 0;
    bool any = false;
    for_each([&]<class E>(E) {
        if constexpr (same_type<E, ground> || same_type<E, terrain>)
            if (in.has(index_of<E>)) {
                const double here = height_of<E>(
                    make_params<E, double>(in.values(index_of<E>, 0), origin, heights), x, y);
                highest = any ? larger(highest, here) : here;
                any = true;
            }
    });
    return highest;
}

}  // namespace limax::sensors
