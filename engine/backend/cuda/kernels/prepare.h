// prepare.h: from voxels and weights to what the step kernels run on: masses, springs, the bound on
// the time step, the body where it starts. One block per robot; the laws, and so the bits, are
// those of spring_body and time_step_bound(). Compiled for one scene (scene.h). SI units.
#pragma once

#include "backend/cuda/kernels/scene.h"
#include "physics/bound.h"

namespace limax::cuda {

// A scene as the law of the bound asks for it. It may have fewer effects than the kernel.
struct bounded_scene {
    const scene_values& scene;
    int32_t effects;
    __device__ bool has(int effect) const { return effects >> effect & 1; }
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

using prepare_arguments = prepare_launch<mass_real>;

// Whether springs go out from a mass in all directions: then it lies below the surface.
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

}  // namespace limax::cuda

extern "C" __global__ void __launch_bounds__(limax::cuda::prepare_threads)
    limax_prepare(const __grid_constant__ limax::cuda::prepare_arguments launch) {
    using namespace limax;
    using namespace limax::cuda;
    __shared__ prepared_robot prepared;
    __shared__ unsigned long long least_step;  // s, as bits: of numbers above 0 their order
    const int64_t robot = blockIdx.x, from = launch.robots[robot];
    const lattice grid = launch.grid;
    const int64_t voxels = grid.voxels(), sites = grid.sites();
    const voxel_body body{grid,
                          launch.voxels + from * voxels,
                          launch.weights + from * 3 * voxels,
                          launch.materials,
                          launch.edge,
                          launch.summed != 0};
    float* const mass = launch.mass + robot * sites;
    float* const columns = launch.springs + robot * (spring_columns * direction_count) * sites;
    int32_t* const ranks = launch.ranks + robot * sites;
    mass_real* const state = launch.state + robot * state_columns * sites;
    if (threadIdx.x == 0) {
        prepared = {0.0, 0.0, {grid.nx, grid.ny, grid.nz}, 0};
        least_step = 0x7ffull << 52;  // infinite
    }
    __syncthreads();

    // calls visit(site, x, y, z) for this thread's sites
    const auto each_site = [&](const auto& visit) {
        for (int64_t site = threadIdx.x; site < sites; site += prepare_threads) {
            const int64_t row = site / (grid.nx + 1);
            visit(site, int(site % (grid.nx + 1)), int(row % (grid.ny + 1)),
                  int(row / (grid.ny + 1)));
        }
    };

    each_site([&](int64_t site, int x, int y, int z) {
        const float m = site_mass(body, x, y, z);
        mass[site] = m;
        if (!(m > 0.0f)) return;
        atomicMin(&prepared.corner[0], x);
        atomicMin(&prepared.corner[1], y);
        atomicMin(&prepared.corner[2], z);
    });
    __syncthreads();
    // one thread adds up, in the order of the sites; the others go on with the springs
    if (threadIdx.x == 0)
        for (int64_t site = 0; site < sites; ++site) {
            const float m = mass[site];
            ranks[site] = m > 0.0f ? prepared.masses++ : -1;
            prepared.total_mass += m;
        }
    for (int64_t slot = threadIdx.x; slot < direction_count * sites; slot += prepare_threads) {
        const int64_t site = slot % sites, row = site / (grid.nx + 1);
        const direction d = direction_at(int(slot / sites));
        const int64_t far = site + grid.step(d);
        const spring_parameters spring =
            spring_between(body, int(site % (grid.nx + 1)), int(row % (grid.ny + 1)),
                           int(row / (grid.ny + 1)), d, mass[site], far < sites ? mass[far] : 0.0f,
                           [&](int64_t voxel) { return share_of(body, voxel); });
        columns[slot] = spring.stiffness;
        if constexpr (damped)
            columns[direction_count * sites + slot] =
                launch.effects & effects::bit<effects::damping> ? spring.damping : 0.0f;
        if constexpr (actuated) {
            const bool moves = launch.effects & effects::bit<effects::actuation>;
            columns[(spring_columns - 2) * direction_count * sites + slot] =
                moves ? spring.sine : 0.0f;
            columns[(spring_columns - 1) * direction_count * sites + slot] =
                moves ? spring.cosine : 0.0f;
        }
    }
    if constexpr (has_faces) {
        float* const faces = launch.faces + robot * 3 * sites;
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
    __syncthreads();
    if constexpr (meets) {
        int32_t* const surface = launch.surface + robot * sites;
        each_site([&](int64_t site, int x, int y, int z) {
            surface[site] = mass[site] > 0.0f && !is_inside(grid, columns, site, x, y, z);
        });
        __syncthreads();
        // from marks to a list, in the order of the sites
        if (threadIdx.x == 0) {
            int64_t listed = 0;
            for (int64_t site = 0; site < sites; ++site)
                if (surface[site]) surface[listed++] = int32_t(site);
            while (listed < sites) surface[listed++] = -1;
        }
    }

    const spring_constants springs{columns, damped ? columns + direction_count * sites : nullptr,
                                   sites};
    each_site([&](int64_t site, int x, int y, int z) {
        const bool used = mass[site] > 0.0f;
        const bool held = holding && used &&
                          is_held(bounded_scene{launch.scene, launch.effects}, launch.edge,
                                  prepared.corner, x, y, z);
        if (used && !held)
            atomicMin(&least_step, bits_as<unsigned long long>(stable_step_of_mass(
                                       bounded_scene{launch.scene, launch.effects},
                                       leapfrog ? scheme::leapfrog : scheme::symplectic_euler, grid,
                                       springs, site, mass[site])));
        const int at[3] = {x, y, z};
        for (int column = 0; column < state_columns; ++column)
            state[column * sites + site] = mass_real(0);
        for (int axis = 0; axis < 3; ++axis) {
            state[(column_position + axis) * sites + site] =
                mass_real((launch.position[axis] - launch.origin[axis]) +
                          launch.edge * double(at[axis] - prepared.corner[axis]));
            if (used && !held)
                state[(column_velocity + axis) * sites + site] = mass_real(launch.velocity[axis]);
        }
        if (held) mass[site] = -mass[site];
    });
    __syncthreads();
    if constexpr (has_solid) {
        __shared__ unsigned heaviest;  // kg, as bits: of numbers above 0 their order
        if (threadIdx.x == 0) heaviest = 0;
        __syncthreads();
        each_site([&](int64_t site, int, int, int) {
            atomicMax(&heaviest, bits_as<unsigned>(absolute(mass[site])));
        });
        __syncthreads();
        if (threadIdx.x == 0)
            least_step = bits_as<unsigned long long>(
                smaller(bits_as<double>(least_step),
                        stable_step_of_block(bounded_scene{launch.scene, launch.effects},
                                             leapfrog ? scheme::leapfrog : scheme::symplectic_euler,
                                             launch.edge, prepared.masses,
                                             double(bits_as<float>(heaviest)))));
    }
    if (threadIdx.x != 0) return;
    prepared.time_step_bound = bits_as<double>(least_step);
    launch.prepared[robot] = prepared;
}
