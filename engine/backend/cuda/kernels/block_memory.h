// block_memory.h: what the threads of a block share: masses as springs read them, and the sums of
// their forces by cell. Includes scene.h only. SI units.
#pragma once

#include "backend/cuda/kernels/cells.h"
#include "backend/cuda/kernels/scene.h"

namespace limax::cuda {

// Two of a real, for wide accesses of shared memory.
template <class R>
struct wide;
template <>
struct wide<float> {
    using two = float2;
};
template <>
struct wide<double> {
    using two = double2;
};

// Positions, and velocities where springs read them, by place.
template <int count>
struct corner_columns {
    typename wide<spring_real>::two xy[count], zu[shares_velocity ? count : 1],
        vw[shares_velocity ? count : 1];
    spring_real z[shares_velocity ? 1 : count];

    __device__ corner load(int place) const {
        corner c{};
        const auto first = xy[place];
        c.x = first.x;
        c.y = first.y;
        if constexpr (shares_velocity) {
            const auto second = zu[place], third = vw[place];
            c.z = second.x;
            c.vx = second.y;
            c.vy = third.x;
            c.vz = third.y;
        } else {
            c.z = z[place];
        }
        return c;
    }
    __device__ void store(int place, const corner& c) {
        xy[place] = {c.x, c.y};
        if constexpr (shares_velocity) {
            zu[place] = {c.z, c.vx};
            vw[place] = {c.vy, c.vz};
        } else {
            z[place] = c.z;
        }
    }
};

// The state of a mass that only its own thread reads, by place.
template <int count>
struct private_columns {
    static constexpr bool holds_velocity = sizeof(mass_real) == 8;
    static constexpr int lost = 2, position = 2, velocity = position + (shares_state ? 0 : 3);
    mass_real column[compensated ? 8 : holds_velocity ? velocity + 3 : 2][count];

    // What never changes.
    __device__ void begin(int place, const mass_state& m) {
        column[0][place] = m.mass;
        column[1][place] = m.inverse_mass;
    }
    __device__ void load(int place, mass_state& m) const {
        m.mass = column[0][place];
        m.inverse_mass = column[1][place];
        for (int axis = 0; axis < 3; ++axis) {
            if constexpr (compensated) {
                m.lost_position[axis] = column[lost + axis][place];
                m.lost_velocity[axis] = column[lost + 3 + axis][place];
            }
            if constexpr (!shares_state) m.position[axis] = column[position + axis][place];
            if constexpr (holds_velocity) m.velocity[axis] = column[velocity + axis][place];
        }
    }
    __device__ void store(int place, const mass_state& m) {
        for (int axis = 0; axis < 3; ++axis) {
            if constexpr (compensated) {
                column[lost + axis][place] = m.lost_position[axis];
                column[lost + 3 + axis][place] = m.lost_velocity[axis];
            }
            if constexpr (!shares_state) column[position + axis][place] = m.position[axis];
            if constexpr (holds_velocity) column[velocity + axis][place] = m.velocity[axis];
        }
    }
};

// Forces on the masses as corner `number` of a cell, [number][place]. What no cell writes stays 0.
template <int count>
struct sum_columns {
    typename wide<spring_real>::two xy[corners * count];
    spring_real z[corners * count];

    __device__ force load(int slot) const { return {xy[slot].x, xy[slot].y, z[slot]}; }
    __device__ void store(int slot, const force& f) {
        xy[slot] = {f.x, f.y};
        z[slot] = f.z;
    }
};

}  // namespace limax::cuda
