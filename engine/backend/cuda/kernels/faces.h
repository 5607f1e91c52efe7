// faces.h: laws on the exposed faces of a robot: each face is computed once and its corners
// gather the impulses, axis by axis, as on the CPU. The caller decides where masses and impulses
// are stored. SI units.
#pragma once

#include "backend/cuda/kernels/scene.h"

namespace limax::cuda {

// Steps between neighbouring masses along axis 0, 1, 2 and on.
struct axis_steps {
    int of_axis[3];
    __device__ int operator[](int axis) const {
        return axis % 3 == 0 ? of_axis[0] : axis % 3 == 1 ? of_axis[1] : of_axis[2];
    }
};

// The mean of a face's corners.
__device__ inline effects::vector<real> mean_of(const effects::vector<real> (&v)[4]) {
    const real quarter = real(0.25);
    return {quarter * ((v[0].x + v[1].x) + (v[2].x + v[3].x)),
            quarter * ((v[0].y + v[1].y) + (v[2].y + v[3].y)),
            quarter * ((v[0].z + v[1].z) + (v[2].z + v[3].z))};
}

// The share of each corner of a face in an effect's impulse over h, N s. `lightest` is the mass of
// its lightest corner, kg, 0 for a face that is not exposed; seen(c) and after(c) are corner c as
// springs see it and its velocity after the kick: the lowest, its neighbours along the next axis
// and the one after that, the one across.
template <class E, class Seen, class After>
__device__ inline effects::vector<real> impulse_on_corner(const scene_params& params,
                                                          float lightest, real h, const Seen& seen,
                                                          const After& after) {
    using effects::vector;
    if (!(lightest > 0.0f)) return {};
    vector<real> place[4], before[4], now[4];
    for (int c = 0; c < 4; ++c) {
        const corner at = seen(c);
        place[c] = {at.x, at.y, at.z};
        before[c] = {at.vx, at.vy, at.vz};
        now[c] = after(c);
    }
    const auto between = [&](int from, int to) -> vector<real> {
        return {place[to].x - place[from].x, place[to].y - place[from].y,
                place[to].z - place[from].z};
    };
    const vector<real> d1 = between(0, 3), d2 = between(1, 2);
    const real half = real(0.5), quarter = real(0.25);
    const effects::face_state<real> state{
        {half * (d1.y * d2.z - d1.z * d2.y), half * (d1.z * d2.x - d1.x * d2.z),
         half * (d1.x * d2.y - d1.y * d2.x)},
        mean_of(before),
        mean_of(now),
        real(lightest)};
    const vector<real> impulse = E::face(params.template of<E>(), state, h);
    return {quarter * impulse.x, quarter * impulse.y, quarter * impulse.z};
}

// A mass's velocity with the impulses of the four faces across an axis that it is a corner of:
// part(k) is that of the face whose lowest corner the mass itself is, its neighbour below along the
// next axis, along the one after that, and along both.
template <class Part>
__device__ inline void take_impulses(real velocity[3], real inverse_mass, const Part& part) {
    const effects::vector<real> here = part(0), below = part(1), beside = part(2), across = part(3);
    velocity[0] = fma(inverse_mass, (here.x + below.x) + (beside.x + across.x), velocity[0]);
    velocity[1] = fma(inverse_mass, (here.y + below.y) + (beside.y + across.y), velocity[1]);
    velocity[2] = fma(inverse_mass, (here.z + below.z) + (beside.z + across.z), velocity[2]);
}

// The impulses of all effects on faces. push(effect, axis) finds those on the corners of every
// face, take(axis) adds them to the masses and publishes their velocities; wait() is a barrier of
// the robot's threads.
template <class Push, class Take, class Wait>
__device__ inline void each_face_law(const Push& push, const Take& take, const Wait& wait) {
    effects::for_each([&]<class E>(E effect) {
        if constexpr (has<E> && bool(E::hooks & effects::hook_face)) {
            for (int axis = 0; axis < 3; ++axis) {
                wait();
                push(effect, axis);
                wait();
                take(axis);
            }
        }
    });
}

}  // namespace limax::cuda
