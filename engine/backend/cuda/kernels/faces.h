// faces.h: laws on the exposed faces of a robot whose masses lie in global memory. Faces are
// computed once each and their impulses gathered by their corners, axis by axis, as on the CPU. SI
// units.
#pragma once

#include "backend/cuda/kernels/tiles.h"

namespace limax::cuda {

// One robot's columns, [..][site]. Other blocks write what is read of other sites: those reads go
// to the memory that all share.
struct face_columns {
    const site_grid& grid;
    const float* masses;
    const float* lightest;    // of the corners of the face across each axis, [3]
    const mass_real* state;   // as in step_launch
    const spring_real* seen;  // masses as springs see them
    mass_real* after;         // velocities after the kick, [3]
    mass_real* impulse;       // on each corner of the face whose lowest corner a site is, N s, [3]

    template <class T>
    __device__ effects::vector<mass_real> read(const T* column, int site) const {
        const int sites = grid.count();
        return {mass_real(__ldcg(column + site)), mass_real(__ldcg(column + sites + site)),
                mass_real(__ldcg(column + 2 * sites + site))};
    }
    __device__ effects::vector<mass_real> position(int site) const {
        return read(state + column_position * grid.count(), site);
    }
    // What forces read.
    __device__ effects::vector<mass_real> velocity(int site) const {
        if constexpr (keeps_prediction)
            return read(state + column_next_velocity * grid.count(), site);
        else if constexpr (leapfrog)
            return read(seen + 3 * grid.count(), site);
        else
            return read(state + column_velocity * grid.count(), site);
    }
    // Steps between the corners of a face across an axis.
    __device__ int step(int axis) const {
        return axis % 3 == 0 ? 1 : axis % 3 == 1 ? grid.x : grid.x * grid.y;
    }
    __device__ bool is_lowest(int axis, int site) const {
        const int place = axis % 3 == 0   ? site % grid.x
                          : axis % 3 == 1 ? site / grid.x % grid.y
                                          : site / (grid.x * grid.y);
        return place == 0;
    }
};

// The mean of read(site) over four sites.
template <class Read>
__device__ inline effects::vector<mass_real> mean_of_corners(const int (&corner)[4],
                                                             const Read& read) {
    const effects::vector<mass_real> v[4] = {read(corner[0]), read(corner[1]), read(corner[2]),
                                             read(corner[3])};
    const mass_real quarter = mass_real(0.25);
    return {quarter * ((v[0].x + v[1].x) + (v[2].x + v[3].x)),
            quarter * ((v[0].y + v[1].y) + (v[2].y + v[3].y)),
            quarter * ((v[0].z + v[1].z) + (v[2].z + v[3].z))};
}

// What each corner of the face across `axis` at this site takes of an effect's impulse over h.
template <class E>
__device__ inline void push_face(const face_columns& robot, const scene_params& params, int axis,
                                 int site, mass_real h) {
    using effects::vector;
    const int sites = robot.grid.count();
    const float lightest = robot.lightest[axis * sites + site];
    vector<mass_real> impulse{};
    if (lightest > 0.0f) {
        const int a = robot.step(axis + 1), b = robot.step(axis + 2);
        const int corner[4] = {site, site + a, site + b, site + a + b};
        const auto difference = [&](int to, int from) -> vector<mass_real> {
            const auto far = robot.position(to), near = robot.position(from);
            return {far.x - near.x, far.y - near.y, far.z - near.z};
        };
        const auto d1 = difference(corner[3], corner[0]), d2 = difference(corner[2], corner[1]);
        const mass_real half = mass_real(0.5);
        const effects::face_state<mass_real> state{
            {half * (d1.y * d2.z - d1.z * d2.y), half * (d1.z * d2.x - d1.x * d2.z),
             half * (d1.x * d2.y - d1.y * d2.x)},
            mean_of_corners(corner, [&](int at) { return robot.velocity(at); }),
            mean_of_corners(corner, [&](int at) { return robot.read(robot.after, at); }),
            mass_real(lightest)};
        impulse = E::face(params.template of<E>(), state, h);
    }
    robot.impulse[site] = mass_real(0.25) * impulse.x;
    robot.impulse[sites + site] = mass_real(0.25) * impulse.y;
    robot.impulse[2 * sites + site] = mass_real(0.25) * impulse.z;
}

// Gives the mass at a site the impulses of the four faces across `axis` that it is a corner of.
__device__ inline void take_impulses(const face_columns& robot, int axis, int site) {
    const float mass = robot.masses[site];
    if (!(mass > 0.0f)) return;
    const mass_real inverse = mass_real(1) / mass_real(mass);
    const int sites = robot.grid.count();
    const int a = robot.step(axis + 1), b = robot.step(axis + 2);
    const bool first = robot.is_lowest(axis + 1, site), second = robot.is_lowest(axis + 2, site);
    for (int along = 0; along < 3; ++along) {
        const mass_real* const column = robot.impulse + along * sites + site;
        const mass_real here = __ldcg(column);
        const mass_real below = first ? mass_real(0) : __ldcg(column - a);
        const mass_real beside = second ? mass_real(0) : __ldcg(column - b);
        const mass_real across = first || second ? mass_real(0) : __ldcg(column - a - b);
        mass_real& after = robot.after[along * sites + site];
        after = fma(inverse, (here + below) + (beside + across), after);
    }
}

// The impulses over h of all effects on faces. each_mass(visit) calls visit(site) for this thread's
// sites, wait() until all of the robot's blocks are there.
template <class EachMass, class Wait>
__device__ inline void push_faces(const face_columns& robot, const scene_params& params,
                                  mass_real h, const EachMass& each_mass, const Wait& wait) {
    effects::for_each([&]<class E>(E) {
        if constexpr (has<E> && bool(E::hooks & effects::hook_face)) {
            for (int axis = 0; axis < 3; ++axis) {
                wait();
                each_mass([&](int site) { push_face<E>(robot, params, axis, site, h); });
                wait();
                each_mass([&](int site) { take_impulses(robot, axis, site); });
            }
        }
    });
}

}  // namespace limax::cuda
