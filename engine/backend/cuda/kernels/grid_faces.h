// grid_faces.h: laws on faces where masses are in tiles in global memory (grid_tiles.h). SI units.
#pragma once

#include "backend/cuda/kernels/faces.h"
#include "backend/cuda/kernels/grid_tiles.h"

namespace limax::cuda {

// One robot's columns, [..][site]. Other blocks write what is read of other sites: those reads go
// to the memory that all share.
struct grid_faces {
    const site_grid& grid;
    const float* masses;
    const float* lightest;  // of the corners of the face across each axis, kg, [3]
    const real* seen;       // masses as springs read them
    real* after;            // velocities after the kick, [3]
    real* impulse;          // on each corner of the face whose lowest corner a site is, N s, [3]

    __device__ axis_steps steps() const { return {{1, grid.x, grid.x * grid.y}}; }
    __device__ effects::vector<real> read(const real* column, int site) const {
        const int sites = grid.count();
        return {__ldcg(column + site), __ldcg(column + sites + site),
                __ldcg(column + 2 * sites + site)};
    }
    __device__ bool is_lowest(int axis, int site) const {
        const int place = axis % 3 == 0   ? site % grid.x
                          : axis % 3 == 1 ? site / grid.x % grid.y
                                          : site / (grid.x * grid.y);
        return place == 0;
    }

    template <class E>
    __device__ void push(E, const scene_params& params, int axis, int site, real h) const {
        const int sites = grid.count(), a = steps()[axis + 1], b = steps()[axis + 2];
        const auto corner_site = [&](int c) { return site + (c & 1 ? a : 0) + (c & 2 ? b : 0); };
        const auto found = impulse_on_corner<E>(
            params, lightest[axis * sites + site], h,
            [&](int c) { return exchanged_corner(grid, seen, corner_site(c)); },
            [&](int c) { return read(after, corner_site(c)); });
        impulse[site] = found.x;
        impulse[sites + site] = found.y;
        impulse[2 * sites + site] = found.z;
    }
    __device__ void take(int axis, int site) const {
        const float mass = masses[site];
        if (!(mass > 0.0f)) return;
        const int sites = grid.count(), a = steps()[axis + 1], b = steps()[axis + 2];
        const bool first = is_lowest(axis + 1, site), second = is_lowest(axis + 2, site);
        real velocity[3] = {after[site], after[sites + site], after[2 * sites + site]};
        take_impulses(velocity, real(1) / real(mass), [&](int k) -> effects::vector<real> {
            if ((k & 1 && first) || (k & 2 && second)) return {};
            return read(impulse, site - (k & 1 ? a : 0) - (k & 2 ? b : 0));
        });
        for (int along = 0; along < 3; ++along) after[along * sites + site] = velocity[along];
    }
};

}  // namespace limax::cuda
