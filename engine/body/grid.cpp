// grid.cpp: walks over the voxels of one body.
#include "body/grid.h"

#include <algorithm>

#include "base/error.h"
#include "base/memory.h"
#include "body/body_laws.h"

namespace limax {

namespace {

struct voxel_place {
    int x, y, z;
};

voxel_place place_of(const lattice& grid, int32_t voxel) {
    const int row = voxel / grid.nx;
    return {voxel % grid.nx, row % grid.ny, row / grid.ny};
}

// Calls `visit(voxel)` for the up to six voxels that share a face with this one.
template <class Visit>
void for_each_face_neighbour(const lattice& grid, int32_t voxel, const Visit& visit) {
    const auto [x, y, z] = place_of(grid, voxel);
    const int32_t row = grid.nx, layer = grid.nx * grid.ny;
    if (z > 0) visit(voxel - layer);
    if (y > 0) visit(voxel - row);
    if (x > 0) visit(voxel - 1);
    if (x + 1 < grid.nx) visit(voxel + 1);
    if (y + 1 < grid.ny) visit(voxel + row);
    if (z + 1 < grid.nz) visit(voxel + layer);
}

}  // namespace

void keep_largest_component(const lattice& grid, uint8_t* voxels, component_search& search) {
    const auto count = static_cast<int32_t>(grid.voxels());
    search.component.assign(static_cast<std::size_t>(count), 0);
    int32_t components = 0, largest = 0, largest_size = 0;
    for (int32_t start = 0; start < count; ++start) {
        if (voxels[start] == 0 || search.component[start] != 0) continue;
        ++components;
        int32_t size = 0;
        search.component[start] = components;
        search.open.assign(1, start);
        while (!search.open.empty()) {
            const int32_t voxel = search.open.back();
            search.open.pop_back();
            ++size;
            for_each_face_neighbour(grid, voxel, [&](int32_t neighbour) {
                if (voxels[neighbour] == 0 || search.component[neighbour] != 0) return;
                search.component[neighbour] = components;
                search.open.push_back(neighbour);
            });
        }
        // Starts ascend, so the first of several largest components has the lowest index.
        if (size > largest_size) {
            largest = components;
            largest_size = size;
        }
    }
    if (components < 2) return;
    for (int32_t voxel = 0; voxel < count; ++voxel)
        if (search.component[voxel] != largest) voxels[voxel] = 0;
}

uint64_t body_hash(const lattice& grid, const uint8_t* voxels) {
    uint64_t hash = hash_of_lattice(grid);
    const int64_t count = grid.voxels();
    for (int64_t first = 0; first < count; first += voxels_per_turn) {
        uint64_t eight = 0;
        for (int64_t k = 0; k < std::min<int64_t>(voxels_per_turn, count - first); ++k)
            eight |= static_cast<uint64_t>(voxels[first + k]) << (8 * k);
        hash = hash_with(hash, eight);
    }
    return hash;
}

void describe_body(const lattice& grid, const uint8_t* voxels, limax_body& body) {
    std::fill(std::begin(body.counts), std::end(body.counts), 0);
    int lowest[3] = {grid.nx, grid.ny, grid.nz}, highest[3] = {-1, -1, -1};
    const uint8_t* voxel = voxels;
    for (int z = 0; z < grid.nz; ++z)
        for (int y = 0; y < grid.ny; ++y)
            for (int x = 0; x < grid.nx; ++x, ++voxel) {
                ++body.counts[*voxel];
                if (*voxel == 0) continue;
                const int at[3] = {x, y, z};
                for (int axis = 0; axis < 3; ++axis) {
                    lowest[axis] = std::min(lowest[axis], at[axis]);
                    highest[axis] = std::max(highest[axis], at[axis]);
                }
            }
    body.voxels = static_cast<int32_t>(grid.voxels()) - body.counts[0];
    for (int axis = 0; axis < 3; ++axis)
        body.size[axis] = body.voxels ? highest[axis] - lowest[axis] + 1 : 0;
    const int32_t size[3] = {grid.nx, grid.ny, grid.nz};
    body.masses = count_masses(size, voxels);
    body.springs = count_springs(size, voxels);
    body.hash = body_hash(grid, voxels);
}

lattice checked_lattice(const int32_t size[3], const std::string& what, double bytes_per_voxel) {
    double voxels = 1, sites = 1;
    static const char* const axes[3] = {"x", "y", "z"};
    for (int axis = 0; axis < 3; ++axis) {
        if (size[axis] < 1)
            fail(LIMAX_INVALID_ARGUMENT,
                 format("lattice %s is %d; it must be at least 1 voxel", axes[axis], size[axis]));
        voxels *= size[axis];
        sites *= size[axis] + 1.0;
    }
    const std::string whole =
        what + format(" on a lattice of %dx%dx%d voxels", size[0], size[1], size[2]);
    require_memory(whole, bytes_per_voxel * voxels);
    // 13 springs begin at a site, and they are counted in 32 bits.
    constexpr double most_sites = 2147483647.0 / direction_count;
    if (sites > most_sites)
        fail(LIMAX_INVALID_ARGUMENT,
             whole + format(" has %.4g sites; a body can have %.4g", sites, most_sites));
    return {size[0], size[1], size[2]};
}

}  // namespace limax
