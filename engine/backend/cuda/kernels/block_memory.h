// block_memory.h: what the threads of a block share: masses as springs read them, and the sums of
// their forces by cell. Includes scene.h only. SI units.
#pragma once

#include "backend/cuda/kernels/cells.h"
#include "backend/cuda/kernels/scene.h"

namespace limax::cuda {

// Groups of a real for wide accesses of shared memory, at most 16 bytes each.
template <class R>
struct wide;
template <>
struct wide<float> {
    using two = float2;
    using four = float4;
};
struct alignas(16) two_pairs {
    double x, y, z, w;
};
template <>
struct wide<double> {
    using two = double2;
    using four = two_pairs;
};

// Positions, and velocities where springs read them, by place.
template <int count>
struct corner_columns {
    typename wide<real>::four xyzu[count];
    typename wide<real>::two vw[shares_velocity ? count : 1];

    __device__ corner load(int place) const {
        const auto first = xyzu[place];
        corner c{first.x, first.y, first.z};
        if constexpr (shares_velocity) {
            const auto second = vw[place];
            c.vx = first.w;
            c.vy = second.x;
            c.vz = second.y;
        }
        return c;
    }
    __device__ void store(int place, const corner& c) {
        xyzu[place] = {c.x, c.y, c.z, c.vx};
        if constexpr (shares_velocity) vw[place] = {c.vy, c.vz};
    }
};

// Forces on the masses as corner `number` of a cell, from corner `first` on, [number][place]. What
// no cell writes stays 0.
template <int count, int first>
struct sum_columns {
    typename wide<real>::two xy[(corners - first) * count];
    real z[(corners - first) * count];

    __device__ force load(int number, int place) const {
        const int slot = (number - first) * count + place;
        return {xy[slot].x, xy[slot].y, z[slot]};
    }
    __device__ void store(int number, int place, const force& f) {
        store_at((number - first) * count + place, f);
    }
    __device__ void store_at(int slot, const force& f) {
        xy[slot] = {f.x, f.y};
        z[slot] = f.z;
    }
};

// The force on the mass at a place: `own`, of the springs of its own cell, and the sums of others.
template <int count>
__device__ inline force force_on(const force& own, int place, const sum_columns<count, 1>& sums) {
    force total = own;
#pragma unroll
    for (int c = 1; c < corners; ++c) {
        const force part = sums.load(c, place);
        total.x += part.x;
        total.y += part.y;
        total.z += part.z;
    }
    return total;
}

}  // namespace limax::cuda
