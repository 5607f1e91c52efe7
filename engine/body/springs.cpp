// springs.cpp: voxels to masses and springs, once per body.
#include "body/springs.h"

#include <algorithm>
#include <cmath>

#include "base/math.h"

namespace limax {

namespace {

// What one voxel brings to each of its springs.
struct voxel_share {
    double stiffness;      // N/m
    double damping_ratio;  // 1
    double sine, cosine;   // s a cos(phi) and s a sin(phi): relative change of rest length
};

voxel_share share_of(const body_description& body, int64_t voxel) {
    const limax_material& material = body.materials[body.voxels[voxel]];
    const int64_t count = body.grid.voxels();
    const double weight = std::max(double(body.weights[voxel]), material.stiffness_floor);
    voxel_share share{material.stiffness * weight, material.damping_ratio, 0.0, 0.0};
    if (material.kind == LIMAX_EXPANDING || material.kind == LIMAX_CONTRACTING) {
        const double sign = material.kind == LIMAX_EXPANDING ? 1.0 : -1.0;
        const double amplitude = sign * material.amplitude * body.weights[count + voxel];
        const double phase = material.phase * body.weights[2 * count + voxel];  // rad
        double sine, cosine;
        sine_cosine_turns(phase / radians_per_turn, sine, cosine);
        share.sine = amplitude * cosine;
        share.cosine = amplitude * sine;
    }
    return share;
}

void fill_masses(spring_body& out, const body_description& body) {
    const lattice& grid = body.grid;
    int corner[3] = {grid.nx, grid.ny, grid.nz};
    for_each_site(grid, [&](int x, int y, int z) {
        double sum = 0;
        int touching = 0;
        for_each_toucher(grid, x, y, z, [&](int64_t voxel) {
            if (body.voxels[voxel] == 0) return;
            sum += body.materials[body.voxels[voxel]].mass_per_site;
            ++touching;
        });
        if (touching == 0) return;
        const int64_t site = grid.site(x, y, z);
        out.mass[site] = static_cast<float>(sum / touching);
        out.total_mass += out.mass[site];
        out.sites[out.masses++] = static_cast<int32_t>(site);
        corner[0] = std::min(corner[0], x);
        corner[1] = std::min(corner[1], y);
        corner[2] = std::min(corner[2], z);
    });
    std::copy(corner, corner + 3, out.corner);
}

void fill_springs(spring_body& out, const body_description& body, int index,
                  const array<voxel_share>& shares) {
    const lattice& grid = body.grid;
    const direction& d = directions[index];
    const double rest = out.rest[index];
    for_each_site(grid, [&](int x, int y, int z) {
        voxel_share sum{0, 0, 0, 0};
        int owners = 0;
        for_each_owner(grid, x, y, z, d, [&](int64_t voxel) {
            if (body.voxels[voxel] == 0) return;
            sum.stiffness += shares[voxel].stiffness;
            sum.damping_ratio += shares[voxel].damping_ratio;
            sum.sine += shares[voxel].sine;
            sum.cosine += shares[voxel].cosine;
            ++owners;
        });
        if (owners == 0) return;
        const int64_t near = grid.site(x, y, z), far = near + grid.step(d),
                      slot = index * out.count + near;
        const double stiffness =
            body.sharing == LIMAX_SHARING_SUM ? sum.stiffness : sum.stiffness / owners;
        const double m = out.mass[near], n = out.mass[far];
        const double reduced_mass = m * n / (m + n);
        out.stiffness[slot] = static_cast<float>(stiffness);
        if (body.with_damping)
            out.damping[slot] = static_cast<float>(2.0 * (sum.damping_ratio / owners) *
                                                   std::sqrt(stiffness * reduced_mass));
        if (body.with_actuation) {
            out.sine[slot] = static_cast<float>(rest * (sum.sine / owners));
            out.cosine[slot] = static_cast<float>(rest * (sum.cosine / owners));
        }
        ++out.springs;
    });
}

}  // namespace

spring_body::spring_body(const body_description& body)
    : grid(body.grid),
      count(padded(body.grid.sites())),
      mass(count),
      stiffness(direction_count * count),
      damping(body.with_damping ? direction_count * count : 0),
      sine(body.with_actuation ? direction_count * count : 0),
      cosine(body.with_actuation ? direction_count * count : 0),
      sites(body.grid.sites()) {
    array<voxel_share> shares(grid.voxels());
    for (int64_t voxel = 0; voxel < grid.voxels(); ++voxel)
        if (body.voxels[voxel] != 0) shares[voxel] = share_of(body, voxel);
    fill_masses(*this, body);
    for (int index = 0; index < direction_count; ++index) {
        rest[index] = body.edge * std::sqrt(double(directions[index].squared()));
        fill_springs(*this, body, index, shares);
    }
}

}  // namespace limax
