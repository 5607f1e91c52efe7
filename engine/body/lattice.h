// lattice.h: the rule that turns a lattice of voxels into sites and springs: which sites a voxel
// touches, which pairs of sites a spring may join, and who owns it. A law: it allocates nothing.
// Lengths in units of the voxel edge.
#pragma once

#include "base/portable.h"

namespace limax {

// A spring joins site s to s + step. Thirteen half-directions give every pair of corners of a
// voxel once: 3 edges, 6 face diagonals, 4 space diagonals.
struct direction {
    int x, y, z;
    LIMAX_LAW constexpr int squared() const {
        return x * x + y * y + z * z;
    }  // rest length squared, 1, 2 or 3
};

inline constexpr int direction_count = 13;
// The directions from this one on are space diagonals, which belong to one voxel each.
inline constexpr int first_space_diagonal = 9;

// A function, because device code cannot index a table of the host at run time.
LIMAX_LAW constexpr direction direction_at(int number) {
    constexpr direction table[direction_count] = {
        {1, 0, 0}, {0, 1, 0},  {0, 0, 1},                                      // edges
        {1, 1, 0}, {-1, 1, 0}, {1, 0, 1},  {-1, 0, 1}, {0, 1, 1}, {0, -1, 1},  // face diagonals
        {1, 1, 1}, {-1, 1, 1}, {1, -1, 1}, {-1, -1, 1}};                       // space diagonals
    return table[number];
}

// The same as a table, for the host.
inline constexpr direction directions[direction_count] = {
    direction_at(0),  direction_at(1),  direction_at(2), direction_at(3), direction_at(4),
    direction_at(5),  direction_at(6),  direction_at(7), direction_at(8), direction_at(9),
    direction_at(10), direction_at(11), direction_at(12)};

// Sites of an nx x ny x nz lattice of voxels: site = x + (nx + 1) (y + (ny + 1) z).
struct lattice {
    int nx, ny, nz;  // voxels

    LIMAX_LAW constexpr int64_t voxels() const { return int64_t(nx) * ny * nz; }
    LIMAX_LAW constexpr int64_t sites() const { return int64_t(nx + 1) * (ny + 1) * (nz + 1); }
    LIMAX_LAW constexpr int64_t site(int x, int y, int z) const {
        return x + int64_t(nx + 1) * (y + int64_t(ny + 1) * z);
    }
    LIMAX_LAW constexpr int64_t voxel(int x, int y, int z) const {
        return x + int64_t(nx) * (y + int64_t(ny) * z);
    }
    // Distance in memory between the ends of a spring; always positive.
    LIMAX_LAW constexpr int64_t step(const direction& d) const { return site(d.x, d.y, d.z); }
};

// Voxels that touch both ends of the spring from site (x, y, z) along d, in ascending voxel index.
// `visit(voxel)`. Along an axis where the ends differ there is one layer of such voxels, else two.
template <class Visit>
LIMAX_LAW void for_each_owner(const lattice& grid, int x, int y, int z, const direction& d,
                              const Visit& visit) {
    const int x0 = d.x < 0 ? x - 1 : (d.x > 0 ? x : x - 1), x1 = d.x < 0 ? x - 1 : x;
    const int y0 = d.y < 0 ? y - 1 : (d.y > 0 ? y : y - 1), y1 = d.y < 0 ? y - 1 : y;
    const int z0 = d.z > 0 ? z : z - 1, z1 = z;
    for (int k = z0; k <= z1; ++k)
        for (int j = y0; j <= y1; ++j)
            for (int i = x0; i <= x1; ++i)
                if (i >= 0 && j >= 0 && k >= 0 && i < grid.nx && j < grid.ny && k < grid.nz)
                    visit(grid.voxel(i, j, k));
}

// Voxels that touch a site, in ascending voxel index.
template <class Visit>
LIMAX_LAW void for_each_toucher(const lattice& grid, int x, int y, int z, const Visit& visit) {
    for_each_owner(grid, x, y, z, direction{0, 0, 0}, visit);
}

// Calls visit(x, y, z) for every site, in memory order.
template <class Visit>
LIMAX_LAW void for_each_site(const lattice& grid, const Visit& visit) {
    for (int z = 0; z <= grid.nz; ++z)
        for (int y = 0; y <= grid.ny; ++y)
            for (int x = 0; x <= grid.nx; ++x) visit(x, y, z);
}

// One step along an axis; axes count on from 2 to 0.
LIMAX_LAW constexpr direction unit(int axis) {
    return {axis % 3 == 0, axis % 3 == 1, axis % 3 == 2};
}

// Calls visit(axis, x, y, z) for every face of every voxel, those between two of them once: the
// square across `axis` whose lowest corner is the site (x, y, z).
template <class Visit>
LIMAX_LAW void for_each_face(const lattice& grid, const Visit& visit) {
    for (int axis = 0; axis < 3; ++axis)
        for_each_site(grid, [&](int x, int y, int z) {
            if ((axis == 0 || x < grid.nx) && (axis == 1 || y < grid.ny) &&
                (axis == 2 || z < grid.nz))
                visit(axis, x, y, z);
        });
}

// Whether exactly one of the two voxels beside a face is empty; all are outside of the lattice.
LIMAX_LAW constexpr bool is_exposed(const lattice& grid, const uint8_t* voxels, int axis, int x,
                                    int y, int z) {
    const direction d = unit(axis);
    const int along = axis == 0 ? x : (axis == 1 ? y : z);
    const int voxels_along = axis == 0 ? grid.nx : (axis == 1 ? grid.ny : grid.nz);
    const bool before = along > 0 && voxels[grid.voxel(x - d.x, y - d.y, z - d.z)] != 0;
    const bool after = along < voxels_along && voxels[grid.voxel(x, y, z)] != 0;
    return before != after;
}

#if !defined(__CUDACC_RTC__)
// Sites in use and springs of a body: `voxels` holds material indices, 0 is empty.
int32_t count_masses(const int32_t lattice_size[3], const uint8_t* voxels);
int32_t count_springs(const int32_t lattice_size[3], const uint8_t* voxels);
#endif

}  // namespace limax
