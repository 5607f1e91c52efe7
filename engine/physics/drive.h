// drive.h: laws of a controlled body: what a voxel's activation does to the springs. Includes laws
// only. SI units.
#pragma once

#include "body/spring_laws.h"
#include "physics/effects/all.h"
#include "physics/effects/change.h"
#include "physics/effects/control.h"
#include "physics/sensors.h"

namespace limax {

namespace sensors {

template <class R>
LIMAX_LAW R place_along(int voxel, int voxels) {
    return R(2 * voxel + 1) / R(voxels) - R(1);
}

}  // namespace sensors

// A voxel as its controller finds it: the muscle's gain, s amplitude weight, which is the relative
// change of rest length at an activation of 1; its phase, rad; and one over the mass of the
// corners, 1/kg.
struct muscle {
    float gain, phase, inverse_mass;
};
// `weights` as in voxel_body; mass(c) is that of corner c, kg.
template <class Mass>
LIMAX_LAW muscle muscle_of(const material_law& material, const float* weights, int64_t voxels,
                           int64_t voxel, const Mass& mass) {
    double sum = 0;
    for (int c = 0; c < 8; ++c) sum += double(mass(c));
    return {float(material.amplitude * double(weights[voxels + voxel])),
            float(material.phase * double(weights[2 * voxels + voxel])), float(1.0 / sum)};
}

// How a spring's rest length differs from L0, m: at the tick, and how much more each step.
template <class R>
struct drive_change {
    R at_tick, per_step;
};
// From the sums over the owners' gain times activation, at the tick and at the next one; `share` is
// one over the steps between them, 0 where the next is reached at once. `scale` is L0 over the
// number of owners.
template <class R>
LIMAX_LAW drive_change<R> change_of(R scale, R from, R to, R share) {
    return {scale * (share > R(0) ? from : to), scale * (to - from) * share};
}
// The same for the spring from the site (x, y, z) along d. drive(voxel, which) is that at the tick
// (0) or the next one (1).
template <class R, class Drive>
LIMAX_LAW drive_change<R> change_of_spring(const lattice& grid, int x, int y, int z,
                                           const direction& d, R scale, R share,
                                           const Drive& drive) {
    R from = 0, to = 0;
    for_each_owner(grid, x, y, z, d, [&](int64_t voxel) {
        from += drive(voxel, 0);
        to += drive(voxel, 1);
    });
    return change_of(scale, from, to, share);
}

// A and B of a spring of a controlled body, as control::pull() reads them.
template <class R>
LIMAX_LAW drive_change<float> driven_spring(const drive_change<R>& change, R rest, R stiffness) {
    if constexpr (sizeof(R) > sizeof(float))
        return {float(change.at_tick), float(change.per_step)};
    else
        return {float(stiffness * (rest + change.at_tick)), float(stiffness * change.per_step)};
}

// What a voxel's muscle at an activation, and its growth, make of rest lengths, relative to them,
// at `time`, s since the muscles began. `in` is a scene as in bound.h.
template <class Scene, class R>
LIMAX_LAW R drive_of(const Scene& in, R gain, R activation, const lattice& grid, int64_t voxel,
                     int material, double time) {
    using namespace effects;
    R drive = gain * activation;
    if (in.has(index_of<damage>)) {
        const vector<R> place{
            sensors::place_along<R>(int(voxel % grid.nx), grid.nx),
            sensors::place_along<R>(int(voxel / grid.nx % grid.ny), grid.ny),
            sensors::place_along<R>(int(voxel / (int64_t(grid.nx) * grid.ny)), grid.nz)};
        for (int i = 0; i < in.instances(index_of<damage>); ++i)
            if (damage::stops(in.values(index_of<damage>, i), place, time)) drive = R(0);
    }
    if (in.has(index_of<growth>))
        for (int i = 0; i < in.instances(index_of<growth>); ++i) {
            const double* values = in.values(index_of<growth>, i);
            if (int(values[0]) == material) drive += R(growth::strain_at(values, time));
        }
    return drive;
}

namespace sensors {

// NaN becomes 0: the robot ends.
template <class R>
LIMAX_LAW R next_activation(R wanted, R before, R most_change) {
    const R near = smaller(before + most_change, larger(before - most_change, wanted));
    const R held = smaller(R(1), larger(R(-1), near));
    return held == held ? held : R(0);
}

// The clock of a controller, which counts ticks. `values` are those of the effect.
LIMAX_LAW effects::actuation::clock clock_of(const double* values) {
    using effects::control;
    const double clock[] = {values[control::at_frequency], 0.0};
    return effects::actuation::make_clock(clock, 1.0 / values[control::at_rate]);
}

// Whether the lattice goes on across face `side` of a voxel, and by how much the number of the
// voxel there differs. Of an axis, the lower face is first.
LIMAX_LAW constexpr bool has_neighbour(const lattice& grid, int x, int y, int z, int side) {
    const int at = side < 2 ? x : side < 4 ? y : z;
    const int count = side < 2 ? grid.nx : side < 4 ? grid.ny : grid.nz;
    return side & 1 ? at < count - 1 : at > 0;
}
LIMAX_LAW constexpr int64_t step_to_neighbour(const lattice& grid, int side) {
    const int64_t step = side < 2 ? 1 : side < 4 ? grid.nx : int64_t(grid.nx) * grid.ny;
    return side & 1 ? step : -step;
}

}  // namespace sensors

}  // namespace limax
