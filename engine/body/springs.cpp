// springs.cpp: voxels to masses and springs, once per body.
#include "body/springs.h"

#include <algorithm>
#include <vector>

namespace limax {

material_law law_of(const limax_material& material) {
    const double sign = material.kind == LIMAX_EXPANDING     ? 1.0
                        : material.kind == LIMAX_CONTRACTING ? -1.0
                                                             : 0.0;
    return {material.stiffness,        material.mass_per_site, material.damping_ratio,
            sign * material.amplitude, material.phase,         material.stiffness_floor};
}

namespace {

void fill_masses(spring_body& out, const voxel_body& body) {
    const lattice& grid = body.grid;
    int corner[3] = {grid.nx, grid.ny, grid.nz};
    for_each_site(grid, [&](int x, int y, int z) {
        const float mass = site_mass(body, x, y, z);
        if (!(mass > 0)) return;
        const int64_t site = grid.site(x, y, z);
        out.mass[site] = mass;
        out.total_mass += mass;
        out.sites[out.masses++] = static_cast<int32_t>(site);
        corner[0] = std::min(corner[0], x);
        corner[1] = std::min(corner[1], y);
        corner[2] = std::min(corner[2], z);
    });
    std::copy(corner, corner + 3, out.corner);
}

void fill_springs(spring_body& out, const voxel_body& body, int index,
                  const array<voxel_share>& shares) {
    const lattice& grid = body.grid;
    const direction& d = directions[index];
    for_each_site(grid, [&](int x, int y, int z) {
        const int64_t near = grid.site(x, y, z), far = near + grid.step(d);
        // the far end may be past the last site: then there is no spring
        const float far_mass = far < grid.sites() ? out.mass[far] : 0.0f;
        const spring_parameters spring =
            spring_between(body, x, y, z, d, out.mass[near], far_mass,
                           [&](int64_t voxel) { return shares[voxel]; });
        if (!spring.owned) return;
        const int64_t slot = index * out.count + near;
        out.stiffness[slot] = spring.stiffness;
        if (out.damping.size() != 0) out.damping[slot] = spring.damping;
        if (out.sine.size() != 0) {
            out.sine[slot] = spring.sine;
            out.cosine[slot] = spring.cosine;
        }
        ++out.springs;
    });
}

void fill_faces(spring_body& out, const voxel_body& body) {
    const lattice& grid = body.grid;
    for_each_face(grid, [&](int axis, int x, int y, int z) {
        if (!is_exposed(body.grid, body.voxels, axis, x, y, z)) return;
        const int64_t site = grid.site(x, y, z), a = grid.step(unit(axis + 1)),
                      b = grid.step(unit(axis + 2));
        out.faces[axis * out.count + site] = std::min(
            {out.mass[site], out.mass[site + a], out.mass[site + b], out.mass[site + a + b]});
    });
}

}  // namespace

spring_body::spring_body(const body_description& description)
    : grid(description.grid),
      count(padded(grid.sites())),
      mass(count),
      stiffness(direction_count * count),
      damping(description.with_damping ? direction_count * count : 0),
      sine(description.with_actuation ? direction_count * count : 0),
      cosine(description.with_actuation ? direction_count * count : 0),
      faces(description.with_faces ? 3 * count : 0),
      sites(grid.sites()) {
    const uint8_t* const voxels = description.voxels;
    // of the materials that occur
    std::vector<material_law> materials;
    const int highest = *std::max_element(voxels, voxels + grid.voxels());
    for (int index = 0; index <= highest; ++index)
        materials.push_back(law_of(description.materials[index]));
    const voxel_body body{grid,
                          voxels,
                          description.weights,
                          materials.data(),
                          description.edge,
                          description.sharing == LIMAX_SHARING_SUM,
                          description.controlled};
    array<voxel_share> shares(grid.voxels());
    for (int64_t voxel = 0; voxel < grid.voxels(); ++voxel)
        if (voxels[voxel] != 0) shares[voxel] = share_of(body, voxel);
    fill_masses(*this, body);
    for (int index = 0; index < direction_count; ++index) {
        rest[index] = rest_length(body.edge, directions[index]);
        fill_springs(*this, body, index, shares);
    }
    if (description.with_faces) fill_faces(*this, body);
}

}  // namespace limax
