// surface.h: the masses on a robot's surface, and which of them are neighbours: joined by a spring,
// or by a chain of two. SI units.
#pragma once

#include "backend/cuda/kernels/springs.h"
#include "body/lattice.h"

namespace limax::cuda {

// The direction of the spring between a site and the one offset by (x, y, z), each -1 to 1.
__device__ inline int direction_between(int x, int y, int z) {
    int found = 0;
    for (int d = 0; d < direction_count; ++d) {
        const direction to = direction_at(d);
        const bool along = to.x == x && to.y == y && to.z == z;
        const bool against = to.x == -x && to.y == -y && to.z == -z;
        if (along || against) found = d;
    }
    return found;
}

struct body_surface {
    site_grid grid;
    const float* stiffness;  // of springs, [direction][site]
    const int32_t* surface;  // as in pair_lists

    __device__ bool has_spring(int near, int x, int y, int z) const {
        const int far = near + grid.at(x, y, z);
        return stiffness[direction_between(x, y, z) * grid.count() + smaller(near, far)] > 0.0f;
    }
    // Whether a spring joins two sites, or a chain of two does.
    __device__ bool joined(int one, int other) const {
        const int x = one % grid.x, y = one / grid.x % grid.y, z = one / (grid.x * grid.y);
        const int dx = other % grid.x - x, dy = other / grid.x % grid.y - y,
                  dz = other / (grid.x * grid.y) - z;
        const auto adjacent = [](int i, int j, int k) {
            return i >= -1 && i <= 1 && j >= -1 && j <= 1 && k >= -1 && k <= 1 &&
                   !(i == 0 && j == 0 && k == 0);
        };
        if (!(dx >= -2 && dx <= 2 && dy >= -2 && dy <= 2 && dz >= -2 && dz <= 2)) return false;
        if (adjacent(dx, dy, dz) && has_spring(one, dx, dy, dz)) return true;
        for (int way = 0; way < 27; ++way) {
            const int i = way % 3 - 1, j = way / 3 % 3 - 1, k = way / 9 - 1;
            const bool inside = x + i >= 0 && y + j >= 0 && z + k >= 0 && x + i < grid.x &&
                                y + j < grid.y && z + k < grid.z;
            if (inside && adjacent(i, j, k) && adjacent(dx - i, dy - j, dz - k) &&
                has_spring(one, i, j, k) &&
                has_spring(one + grid.at(i, j, k), dx - i, dy - j, dz - k))
                return true;
        }
        return false;
    }

    // Calls visit(site) for every mass of the surface, in ascending order, until it returns false.
    template <class Visit>
    __device__ void each_of_surface(const Visit& visit) const {
        for (int i = 0; i < grid.count(); ++i) {
            const int site = surface[i];
            if (site < 0 || !visit(site)) return;
        }
    }
    __device__ bool is_of_surface(int site) const {
        int low = 0, high = grid.count();
        while (low < high) {
            const int middle = (low + high) / 2, found = surface[middle];
            if (found >= 0 && found < site)
                low = middle + 1;
            else
                high = middle;
        }
        return low < grid.count() && surface[low] == site;
    }
};

// The parameters of an effect between masses; none of them depends on the robot's origin.
template <class R, class E>
__device__ inline typename E::template params<R> pair_params(const scene_values& scene) {
    const double world[3] = {0, 0, 0};
    return E::template make<R>(scene.of(effects::index_of<E>), world);
}
// The distance within which an effect's masses meet, m.
template <class E>
__device__ inline double reach_of(const scene_values& scene, double edge) {
    return pair_params<double, E>(scene).reach * edge;
}

}  // namespace limax::cuda
