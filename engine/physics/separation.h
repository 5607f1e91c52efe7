// separation.h: the distance between two masses and how fast it changes, for springs, contacts and
// measures. Includes laws only. SI units.
#pragma once

#include "base/portable.h"

namespace limax {

// m^2. Too small to change the length of a spring; it gives coincident masses a finite 1 / length.
inline constexpr double least_squared_length = 1e-20;

template <class R>
struct separation {
    R x, y, z;  // from one mass to the other, m; or the difference of their velocities, m/s
};

template <class R>
LIMAX_LAW R dot(const separation<R>& a, const separation<R>& b) {
    return fma(a.x, b.x, fma(a.y, b.y, a.z * b.z));
}

template <class R>
struct distance {
    R length;   // m
    R inverse;  // 1/m
};

// The length of a spring.
template <class R>
LIMAX_LAW distance<R> spring_length(const separation<R>& e) {
    const R squared = fma(e.x, e.x, fma(e.y, e.y, fma(e.z, e.z, R(least_squared_length))));
    const R inverse = inverse_length(squared);
    return {squared * inverse, inverse};
}

// The distance of two masses in contact, from its square. Coincident masses have the distance 0.
template <class R>
LIMAX_LAW distance<R> contact_distance(R squared) {
    const R inverse = inverse_length(squared + R(least_squared_length));
    return {squared * inverse, inverse};
}

}  // namespace limax
