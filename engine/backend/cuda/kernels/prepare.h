// prepare.h: from voxels and weights to what the step kernels read: masses, springs, the bound on
// the time step, the first state. One block per robot; the laws, and so the bits, are those of
// spring_body and time_step_bound(). Compiled for one scene (scene.h). SI units.
#pragma once

#include "backend/cuda/kernels/scene.h"
#include "physics/bound.h"
#include "physics/drive.h"

namespace limax::cuda {

// A scene as the law of the bound reads it. It may have fewer effects than the kernel.
struct bounded_scene {
    const scene_values& scene;
    int32_t effects;
    __device__ bool has(int effect) const { return (effects & LIMAX_EFFECTS) >> effect & 1; }
    __device__ int instances(int effect) const { return scene.count[effect]; }
    __device__ const double* values(int effect, int instance) const {
        return scene.of(effect, instance);
    }
#if defined(LIMAX_SCRIPTED_STIFFNESS)
    __device__ effects::stiffness_damping script_bound() const {
        return {LIMAX_SCRIPTED_STIFFNESS, LIMAX_SCRIPTED_DAMPING};
    }
#endif
};

using prepare_arguments = prepare_launch<real>;

// Whether a mass has springs in all directions: then it is inside the body.
__device__ inline bool is_inside(const lattice& grid, const float* stiffness, int64_t site, int x,
                                 int y, int z) {
    if (x == 0 || y == 0 || z == 0 || x == grid.nx || y == grid.ny || z == grid.nz) return false;
    bool all = true;
    for (int d = 0; d < direction_count; ++d) {
        const float* const along = stiffness + d * grid.sites();
        all &= along[site] > 0.0f && along[site - grid.step(direction_at(d))] > 0.0f;
    }
    return all;
}

// One robot while its block prepares it.
struct robot_in_preparation {
    const prepare_arguments& launch;
    const lattice& grid;
    prepared_robot& prepared;
    // s, as bits: positive numbers have the order of their bits
    unsigned long long &least_step, &least_time;
    const int64_t sites;
    const voxel_body body;
    float *const mass, *const columns;  // columns of springs
    int32_t* const ranks;
    real* const state;

    __device__ robot_in_preparation(const prepare_arguments& arguments, prepared_robot& record,
                                    unsigned long long& step, unsigned long long& time)
        : launch(arguments),
          grid(arguments.grid),
          prepared(record),
          least_step(step),
          least_time(time),
          sites(grid.sites()),
          body{grid,
               launch.voxels + launch.robots[blockIdx.x] * grid.voxels(),
               launch.weights + launch.robots[blockIdx.x] * 3 * grid.voxels(),
               launch.materials,
               launch.edge,
               launch.summed != 0,
               controlled},
          mass(launch.mass + blockIdx.x * sites),
          columns(launch.springs + blockIdx.x * (stored_columns * direction_count) * sites),
          ranks(launch.ranks + blockIdx.x * sites),
          state(launch.state + blockIdx.x * state_columns * sites) {}

    // Calls visit(site, x, y, z) for this thread's sites.
    template <class Visit>
    __device__ void each_site(const Visit& visit) const {
        for (int64_t site = threadIdx.x; site < sites; site += prepare_threads) {
            const int64_t row = site / (grid.nx + 1);
            visit(site, int(site % (grid.nx + 1)), int(row % (grid.ny + 1)),
                  int(row / (grid.ny + 1)));
        }
    }
    __device__ bounded_scene scene() const { return {launch.scene, launch.effects}; }
    __device__ static scheme used_scheme() {
        return leapfrog ? scheme::leapfrog : scheme::symplectic_euler;
    }

    // Masses of all sites, and the lowest corner of the body's box.
    __device__ void make_masses() {
        each_site([&](int64_t site, int x, int y, int z) {
            const float m = site_mass(body, x, y, z);
            mass[site] = m;
            if (!(m > 0.0f)) return;
            atomicMin(&prepared.corner[0], x);
            atomicMin(&prepared.corner[1], y);
            atomicMin(&prepared.corner[2], z);
        });
    }

    // By one thread: numbers the masses and adds them up, in the order of the sites.
    __device__ void number_masses() {
        for (int64_t site = 0; site < sites; ++site) {
            const float m = mass[site];
            ranks[site] = m > 0.0f ? prepared.masses++ : -1;
            prepared.total_mass += m;
        }
    }

    // Parameters of all springs, and the least c / k.
    __device__ void make_springs() const {
        double least = bits_as<double>(0x7ffull << 52);
        for (int64_t slot = threadIdx.x; slot < direction_count * sites; slot += prepare_threads) {
            const int64_t site = slot % sites, row = site / (grid.nx + 1);
            const direction d = direction_at(int(slot / sites));
            const int64_t far = site + grid.step(d);
            const spring_parameters spring = spring_between(
                body, int(site % (grid.nx + 1)), int(row % (grid.ny + 1)), int(row / (grid.ny + 1)),
                d, mass[site], far < sites ? mass[far] : 0.0f,
                [&](int64_t voxel) { return share_of(body, voxel); });
            columns[slot] = spring.stiffness;
            if constexpr (damped) {
                columns[direction_count * sites + slot] =
                    launch.effects & effects::bit<effects::damping> ? spring.damping : 0.0f;
                if (launch.by_voxels)
                    least = smaller(least, damping_time(spring.stiffness, spring.damping));
            }
            if constexpr (actuated) {
                const bool moves = launch.effects & effects::bit<effects::actuation>;
                if constexpr (controlled)
                    columns[spring_columns * direction_count * sites + slot] = spring.sine;
                columns[(spring_columns - 2) * direction_count * sites + slot] =
                    moves ? spring.sine : 0.0f;
                // of a controlled robot what the next column has, until a tick replaces it
                columns[(spring_columns - 1) * direction_count * sites + slot] =
                    controlled ? spring.sine
                    : moves    ? spring.cosine
                               : 0.0f;
            }
        }
        if (damped && launch.by_voxels) atomicMin(&least_time, bits_as<unsigned long long>(least));
    }

    // Gain, phase and inverse mass of each voxel, after the masses.
    __device__ void make_muscles() const {
        const int64_t voxels = grid.voxels();
        float* const out = launch.muscles + blockIdx.x * muscle_columns * voxels;
        for (int64_t v = threadIdx.x; v < voxels; v += prepare_threads) {
            const int x = int(v % grid.nx), y = int(v / grid.nx % grid.ny),
                      z = int(v / (int64_t(grid.nx) * grid.ny));
            const muscle own =
                body.voxels[v] == 0
                    ? muscle{bits_as<float>(0x7fc00000u), 0, 0}
                    : muscle_of(
                          body.materials[body.voxels[v]], body.weights, voxels, v, [&](int c) {
                              return mass[grid.site(x + (c & 1), y + (c >> 1 & 1), z + (c >> 2))];
                          });
            out[v] = own.gain;
            out[voxels + v] = own.phase;
            out[2 * voxels + v] = own.inverse_mass;
            if constexpr (grows) out[3 * voxels + v] = float(body.voxels[v]);
        }
    }

    // The mass of the lightest corner of each exposed face.
    __device__ void make_faces() const {
        float* const faces = launch.faces + blockIdx.x * 3 * sites;
        each_site([&](int64_t site, int x, int y, int z) {
            for (int axis = 0; axis < 3; ++axis) {
                const bool exposed = (axis == 0 || x < grid.nx) && (axis == 1 || y < grid.ny) &&
                                     (axis == 2 || z < grid.nz) &&
                                     is_exposed(grid, body.voxels, axis, x, y, z);
                const int64_t a = grid.step(unit(axis + 1)), b = grid.step(unit(axis + 2));
                faces[axis * sites + site] =
                    exposed ? smaller(smaller(mass[site], mass[site + a]),
                                      smaller(mass[site + b], mass[site + a + b]))
                            : 0.0f;
            }
        });
    }

    // The masses of the surface, as a list in the order of the sites. Holds a barrier.
    __device__ void list_surface() const {
        int32_t* const surface = launch.surface + blockIdx.x * sites;
        each_site([&](int64_t site, int x, int y, int z) {
            surface[site] = mass[site] > 0.0f && !is_inside(grid, columns, site, x, y, z);
        });
        __syncthreads();
        if (threadIdx.x != 0) return;
        int64_t listed = 0;
        for (int64_t site = 0; site < sites; ++site)
            if (surface[site]) surface[listed++] = int32_t(site);
        while (listed < sites) surface[listed++] = -1;
    }

    // The first state, the bound on the time step of all masses, and which masses are held.
    __device__ void make_state() {
        const spring_constants springs{
            columns, damped ? columns + direction_count * sites : nullptr, sites,
            launch.by_voxels != 0, damped ? bits_as<double>(least_time) : 0.0};
        each_site([&](int64_t site, int x, int y, int z) {
            const bool used = mass[site] > 0.0f;
            const bool held =
                holding && used && is_held(scene(), launch.edge, prepared.corner, x, y, z);
            if (used && !held)
                atomicMin(&least_step,
                          bits_as<unsigned long long>(stable_step_of_mass(
                              scene(), used_scheme(), grid, springs, site, mass[site])));
            const int at[3] = {x, y, z};
            for (int column = 0; column < state_columns; ++column)
                state[column * sites + site] = real(0);
            for (int axis = 0; axis < 3; ++axis) {
                state[(column_position + axis) * sites + site] =
                    real((launch.position[axis] - launch.origin[axis]) +
                         launch.edge * double(at[axis] - prepared.corner[axis]));
                if (used && !held)
                    state[(column_velocity + axis) * sites + site] = real(launch.velocity[axis]);
            }
            if (held) mass[site] = -mass[site];
        });
    }

    // The bound of the rigid blocks, which depends on the heaviest mass. Holds barriers.
    __device__ void bound_solids() {
        __shared__ unsigned heaviest;  // kg, as bits
        if (threadIdx.x == 0) heaviest = 0;
        __syncthreads();
        each_site([&](int64_t site, int, int, int) {
            atomicMax(&heaviest, bits_as<unsigned>(absolute(mass[site])));
        });
        __syncthreads();
        if (threadIdx.x != 0) return;
        for (int i = 0; i < scene().instances(effects::index_of<effects::block>); ++i)
            least_step = bits_as<unsigned long long>(
                smaller(bits_as<double>(least_step),
                        stable_step_of_block(scene(), i, used_scheme(), launch.edge,
                                             prepared.masses, double(bits_as<float>(heaviest)))));
    }
};

}  // namespace limax::cuda

extern "C" __global__ void __launch_bounds__(limax::cuda::prepare_threads)
    limax_prepare(const __grid_constant__ limax::cuda::prepare_arguments launch) {
    using namespace limax;
    using namespace limax::cuda;
    __shared__ prepared_robot prepared;
    __shared__ unsigned long long least_step, least_time;
    if (threadIdx.x == 0) {
        prepared = {0.0, 0.0, {launch.grid.nx, launch.grid.ny, launch.grid.nz}, 0};
        least_step = least_time = 0x7ffull << 52;  // infinite
    }
    __syncthreads();
    robot_in_preparation robot(launch, prepared, least_step, least_time);
    robot.make_masses();
    __syncthreads();
    // the other threads go on with the springs
    if (threadIdx.x == 0) robot.number_masses();
    robot.make_springs();
    if constexpr (has_faces) robot.make_faces();
    if constexpr (controlled) robot.make_muscles();
    __syncthreads();
    if constexpr (meets) robot.list_surface();
    robot.make_state();
    __syncthreads();
    if constexpr (has_solid) robot.bound_solids();
    if (threadIdx.x != 0) return;
    prepared.time_step_bound = bits_as<double>(least_step);
    launch.prepared[blockIdx.x] = prepared;
}
