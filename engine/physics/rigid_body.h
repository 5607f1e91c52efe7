// rigid_body.h: laws of a rigid solid that turns about its centre of mass: its frame, its inertia,
// its free turning. Its state is where it points and its angular momentum in the world, which no
// step changes where nothing acts. Laws; includes laws only. SI units, doubles.
//
// Products and sums are rounded one by one: without a fused multiply-add instruction the compiler
// would call a library function for each.
//
// Free turning over dt splits the energy L_k^2 / (2 I_k) of the three axes of the solid's own frame
// into five turns, about x, y, z, y, x by dt/2, dt/2, dt, dt/2, dt/2, each of them exact: symmetric
// and symplectic, so of second order with an energy that does not drift.
#pragma once

#include "base/math.h"
#include "physics/effects/contact.h"

namespace limax {

// A turn from the solid's own frame to the world: of unit length.
struct quaternion {
    double w, x, y, z;
};

// The same as a matrix, by rows.
struct rotation {
    effects::vector<double> x, y, z;
};

LIMAX_LAW double inner(const effects::vector<double>& a, const effects::vector<double>& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
LIMAX_LAW effects::vector<double> cross(const effects::vector<double>& a,
                                        const effects::vector<double>& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

// a + s b
LIMAX_LAW effects::vector<double> plus(const effects::vector<double>& a, double s,
                                       const effects::vector<double>& b) {
    return {a.x + s * b.x, a.y + s * b.y, a.z + s * b.z};
}

LIMAX_LAW rotation rotation_of(const quaternion& q) {
    return {{1.0 - 2.0 * (q.y * q.y + q.z * q.z), 2.0 * (q.x * q.y - q.w * q.z),
             2.0 * (q.x * q.z + q.w * q.y)},
            {2.0 * (q.x * q.y + q.w * q.z), 1.0 - 2.0 * (q.x * q.x + q.z * q.z),
             2.0 * (q.y * q.z - q.w * q.x)},
            {2.0 * (q.x * q.z - q.w * q.y), 2.0 * (q.y * q.z + q.w * q.x),
             1.0 - 2.0 * (q.x * q.x + q.y * q.y)}};
}

// From the solid's own frame to the world, and back.
LIMAX_LAW effects::vector<double> to_world(const rotation& r, const effects::vector<double>& v) {
    return {inner(r.x, v), inner(r.y, v), inner(r.z, v)};
}
LIMAX_LAW effects::vector<double> to_solid(const rotation& r, const effects::vector<double>& v) {
    return {r.x.x * v.x + r.y.x * v.y + r.z.x * v.z, r.x.y * v.x + r.y.y * v.y + r.z.y * v.z,
            r.x.z * v.x + r.y.z * v.y + r.z.z * v.z};
}

// Moments of inertia of a box with half edges `half` about its axes, kg m^2: m (b^2 + c^2) / 12 of
// whole edges.
LIMAX_LAW effects::vector<double> inertia_of_box(const effects::vector<double>& half, double mass) {
    const double third = mass / 3.0;
    return {third * (half.y * half.y + half.z * half.z),
            third * (half.x * half.x + half.z * half.z),
            third * (half.x * half.x + half.y * half.y)};
}

// Angular velocity of a solid with moments of inertia `inertia` and an angular momentum, rad/s, in
// the world.
LIMAX_LAW effects::vector<double> angular_velocity(const rotation& r,
                                                   const effects::vector<double>& inertia,
                                                   const effects::vector<double>& momentum) {
    const effects::vector<double> own = to_solid(r, momentum);
    return to_world(r, {own.x / inertia.x, own.y / inertia.y, own.z / inertia.z});
}

// The matrix from angular momentum to angular velocity, both in the world: R I^-1 R^T, 1/(kg m^2),
// by rows.
LIMAX_LAW rotation inverse_inertia(const rotation& r, const effects::vector<double>& inertia) {
    const effects::vector<double> inverse{1.0 / inertia.x, 1.0 / inertia.y, 1.0 / inertia.z};
    const auto row = [&](const effects::vector<double>& of) {
        return to_world(r, {inverse.x * of.x, inverse.y * of.y, inverse.z * of.z});
    };
    return {row(r.x), row(r.y), row(r.z)};
}

LIMAX_LAW quaternion normalized(const quaternion& q) {
    const double inverse = inverse_length(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
    return {q.w * inverse, q.x * inverse, q.y * inverse, q.z * inverse};
}

// Turns by an angular momentum about one axis of the solid's own frame, 0 to 2, for dt.
LIMAX_LAW void turn_about(int axis, double dt, const effects::vector<double>& inertia,
                          effects::vector<double>& own, quaternion& q) {
    const double momentum = axis == 0 ? own.x : (axis == 1 ? own.y : own.z);
    const double moment = axis == 0 ? inertia.x : (axis == 1 ? inertia.y : inertia.z);
    double s, c;  // of half of the angle
    sine_cosine_turns(0.5 * dt * momentum / (moment * radians_per_turn), s, c);
    const double sine = 2.0 * s * c, cosine = 1.0 - 2.0 * s * s;
    // the momentum keeps its place in the world, so it turns the other way in the solid
    if (axis == 0) {
        own = {own.x, cosine * own.y + sine * own.z, cosine * own.z - sine * own.y};
        q = {q.w * c - q.x * s, q.x * c + q.w * s, q.y * c + q.z * s, q.z * c - q.y * s};
    } else if (axis == 1) {
        own = {cosine * own.x - sine * own.z, own.y, cosine * own.z + sine * own.x};
        q = {q.w * c - q.y * s, q.x * c - q.z * s, q.y * c + q.w * s, q.z * c + q.x * s};
    } else {
        own = {cosine * own.x + sine * own.y, cosine * own.y - sine * own.x, own.z};
        q = {q.w * c - q.z * s, q.x * c + q.y * s, q.y * c - q.x * s, q.z * c + q.w * s};
    }
}

// Where a solid points after dt of free turning with an angular momentum in the world.
LIMAX_LAW quaternion turned_freely(const quaternion& from, const effects::vector<double>& inertia,
                                   const effects::vector<double>& momentum, double dt) {
    quaternion q = from;
    effects::vector<double> own = to_solid(rotation_of(q), momentum);
    turn_about(0, 0.5 * dt, inertia, own, q);
    turn_about(1, 0.5 * dt, inertia, own, q);
    turn_about(2, dt, inertia, own, q);
    turn_about(1, 0.5 * dt, inertia, own, q);
    turn_about(0, 0.5 * dt, inertia, own, q);
    return normalized(q);
}

}  // namespace limax
