// block_faces.h: laws on faces where masses are in shared memory (block.h). SI units.
#pragma once

#include "backend/cuda/kernels/block.h"

namespace limax::cuda {

__device__ inline effects::vector<real> vector_at(const real (&column)[3][face_places], int place) {
    return {column[0][place], column[1][place], column[2][place]};
}

// Publishes a mass's velocity after the kick for the faces that it is a corner of.
__device__ inline void show_velocity(const real velocity[3], int place, block_memory& shared) {
    for (int along = 0; along < 3; ++along) shared.faces.after[along][place] = velocity[along];
}

// Stores the impulse on each corner of the face across `axis` whose lowest corner is at `place`.
// `lightest` is the robot's, [axis][site].
template <class E>
__device__ inline void push_face(E, const scene_params& params, const float* lightest, int axis,
                                 int place, real h, block_memory& shared) {
    constexpr axis_steps steps{{1, LIMAX_ROW, LIMAX_PLANE}};
    const int a = steps[axis + 1], b = steps[axis + 2];
    const auto corner_at = [&](int c) { return place + (c & 1 ? a : 0) + (c & 2 ? b : 0); };
    const auto found = impulse_on_corner<E>(
        params, lightest[axis * sites + site_at(place)], h,
        [&](int c) { return shared.at.load(corner_at(c)); },
        [&](int c) { return vector_at(shared.faces.after, corner_at(c)); });
    shared.faces.impulse[0][place] = found.x;
    shared.faces.impulse[1][place] = found.y;
    shared.faces.impulse[2][place] = found.z;
}

// Gives a mass the impulses of the four faces across `axis` that it is a corner of.
__device__ inline void take_from_faces(int axis, int place, real inverse_mass, real velocity[3],
                                       block_memory& shared) {
    constexpr axis_steps steps{{1, LIMAX_ROW, LIMAX_PLANE}};
    const int a = steps[axis + 1], b = steps[axis + 2];
    const bool first = is_lowest(axis + 1, place), second = is_lowest(axis + 2, place);
    take_impulses(velocity, inverse_mass, [&](int k) -> effects::vector<real> {
        if ((k & 1 && first) || (k & 2 && second)) return {};
        return vector_at(shared.faces.impulse, place - (k & 1 ? a : 0) - (k & 2 ? b : 0));
    });
}

}  // namespace limax::cuda
