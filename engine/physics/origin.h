// origin.h: what happens to a robot between steps that decides its bits on every device: how often
// it is looked at, what counts as coarse there, and the robot's own origin, which follows its
// centre of mass so that fp32 resolves as much anywhere as at 0. Laws; includes portable.h only.
// SI units.
#pragma once

#include "base/portable.h"

namespace limax {

// Steps between checks of limits and origin: part of the result, so a constant.
inline constexpr int check_interval = 64;
// A mass that moves farther than this share of an edge in one step may
// detect contacts too late.
inline constexpr double coarse_share = 0.1;
// The speed from which on it does, m/s.
LIMAX_LAW double coarse_speed(double edge, double time_step) {
    return coarse_share * edge / time_step;
}

// The origin follows when the centre of mass is farther away than this on an axis, by whole
// multiples of a step that fp32 subtracts exactly. m.
inline constexpr double origin_reach = 4.0, origin_step = 2.0;

// The whole multiple of origin_step nearest to a place on an axis.
LIMAX_LAW double whole_origin_steps(double place) {
    const double steps = place / origin_step + 0.5;
    // so far out every double is a whole number of steps
    if (!(absolute(steps) < 0x1p62)) return place;
    const double whole = double(int64_t(steps));
    return origin_step * (whole > steps ? whole - 1.0 : whole);
}

// How far the origin moves along an axis for a centre of mass at `away` from it.
LIMAX_LAW double origin_shift(double away) {
    return absolute(away) > origin_reach ? whole_origin_steps(away) : 0.0;
}

}  // namespace limax
