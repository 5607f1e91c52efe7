// overlap.cpp: depths of masses and of the block's corners in the contacts of a scene.
#include "physics/overlap.h"

#include <algorithm>

#include "base/error.h"

namespace limax {

namespace {

using effects::index_of;
using place = effects::vector<double>;

struct contact {
    std::string obstacle;
    double depth = 0;
};

// The deepest contact of a place in the world.
void add_contacts(const place& at, const scene& scene, contact& deepest) {
    const double world[3] = {0, 0, 0};
    effects::for_each([&]<class E>(E) {
        if constexpr (effects::is_contact<E>)
            for (int i = 0; i < scene.instances(index_of<E>); ++i) {
                const double* values = scene.values_as_added(index_of<E>, i);
                const double depth =
                    E::surface(effects::make_params<E, double>(values, world, scene.heights()), at)
                        .depth;
                if (depth > deepest.depth)
                    deepest = {name_of_instance(index_of<E>, std::size_t(i)), depth};
            }
    });
}

// The block where it starts: its centre and half of its edges, m.
struct solid {
    effects::block::params<double> params;
    place center;
};

solid block_of(const scene& scene, const double* start) {
    const double* values = scene.values(index_of<effects::block>);
    const auto params = effects::block::make<double>(values, nullptr);
    const double* from = values + effects::block::at_position;
    return {params,
            {start[0] + from[0] + params.half.x, start[1] + from[1] + params.half.y,
             start[2] + from[2] + params.half.z}};
}

// The deepest contact of a body of voxels; of one that fills the lattice if `voxels` is null.
contact deepest_of_body(const lattice& grid, const uint8_t* voxels,
                        const limax_simulation_options& options, const scene& scene) {
    std::vector<uint8_t> used(std::size_t(grid.sites()), voxels == nullptr);
    int corner[3] = {grid.nx, grid.ny, grid.nz};
    if (!voxels) std::fill_n(corner, 3, 0);
    for_each_site(grid, [&](int x, int y, int z) {
        if (!voxels) return;
        bool touched = false;
        for_each_toucher(grid, x, y, z, [&](int64_t voxel) { touched |= voxels[voxel] != 0; });
        if (!touched) return;
        used[std::size_t(grid.site(x, y, z))] = 1;
        corner[0] = std::min(corner[0], x);
        corner[1] = std::min(corner[1], y);
        corner[2] = std::min(corner[2], z);
    });
    contact deepest;
    const bool has_block = scene.has(index_of<effects::block>);
    const solid block = has_block ? block_of(scene, options.position) : solid{};
    for_each_site(grid, [&](int x, int y, int z) {
        if (!used[std::size_t(grid.site(x, y, z))]) return;
        const place at{options.position[0] + options.edge * (x - corner[0]),
                       options.position[1] + options.edge * (y - corner[1]),
                       options.position[2] + options.edge * (z - corner[2])};
        add_contacts(at, scene, deepest);
        if (!has_block) return;
        const double depth =
            effects::block::solid(block.params, place{at.x - block.center.x, at.y - block.center.y,
                                                      at.z - block.center.z})
                .depth;
        if (depth > deepest.depth) deepest = {"scene.block", depth};
    });
    return deepest;
}

}  // namespace

overlap find_overlap(const lattice& grid, const limax_simulation_options& options,
                     const scene& scene, const std::vector<uint8_t>& mask,
                     const std::function<const uint8_t*()>& voxels) {
    const double least = overlap_share * options.edge;
    overlap found;
    const auto keep = [&](const std::string& subject, const contact& deepest) {
        if (deepest.depth > found.depth)
            found = {subject, deepest.obstacle, deepest.depth, found.robots};
    };
    if (scene.has(index_of<effects::block>)) {
        const solid block = block_of(scene, options.position);
        contact deepest;
        for (int k = 0; k < 8; ++k)
            add_contacts({block.center.x + (k & 1 ? 1 : -1) * block.params.half.x,
                          block.center.y + (k & 2 ? 1 : -1) * block.params.half.y,
                          block.center.z + (k & 4 ? 1 : -1) * block.params.half.z},
                         scene, deepest);
        if (deepest.depth > least) keep("the block", deepest);
    }
    // a body that anchors hold is not thrown
    if (scene.has(index_of<effects::anchors>)) return found;
    // no body reaches beyond the lattice, whose corner is its own lowest corner
    if (deepest_of_body(grid, nullptr, options, scene).depth <= least) return found;
    const uint8_t* bodies = voxels();
    for (std::size_t i = 0; i < mask.size(); ++i) {
        if (!mask[i]) continue;
        const contact deepest =
            deepest_of_body(grid, bodies + int64_t(i) * grid.voxels(), options, scene);
        if (deepest.depth <= least) continue;
        found.robots += 1;
        keep(format("robot %zu", i + 1), deepest);
    }
    return found;
}

}  // namespace limax
