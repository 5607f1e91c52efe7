// overlap.cpp: depths of masses and of blocks' corners in the contacts of a scene, and of blocks in
// each other.
#include "physics/overlap.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "physics/solid_edges.h"

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

std::vector<solid::body> blocks_of(const scene& scene, const double* start) {
    std::vector<solid::body> blocks;
    for (int i = 0; i < scene.instances(index_of<effects::block>); ++i)
        blocks.push_back(solid::placed(i, scene.values(index_of<effects::block>, i), start));
    return blocks;
}

// How far a block must move at least to leave another, m.
double depth_of_pair(const solid::body& a, const solid::body& b) {
    const place &p = a.law.half, &q = b.law.half, away = solid::minus(a.block.place, b.block.place);
    return std::min(
        {p.x + q.x - std::abs(away.x), p.y + q.y - std::abs(away.y), p.z + q.z - std::abs(away.z)});
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
    const std::vector<solid::body> blocks = blocks_of(scene, options.position);
    for_each_site(grid, [&](int x, int y, int z) {
        if (!used[std::size_t(grid.site(x, y, z))]) return;
        const place at{options.position[0] + options.edge * (x - corner[0]),
                       options.position[1] + options.edge * (y - corner[1]),
                       options.position[2] + options.edge * (z - corner[2])};
        add_contacts(at, scene, deepest);
        for (const solid::body& block : blocks) {
            const double depth =
                effects::block::solid(block.law, solid::minus(at, block.block.place)).depth;
            if (depth > deepest.depth)
                deepest = {name_of_instance(index_of<effects::block>, std::size_t(block.number)),
                           depth};
        }
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
    const std::vector<solid::body> blocks = blocks_of(scene, options.position);
    for (std::size_t i = 0; i < blocks.size(); ++i) {
        contact deepest;
        for (int k = 0; k < 8; ++k)
            add_contacts(plus(blocks[i].block.place, 1.0, solid::corner_of(blocks[i].law.half, k)),
                         scene, deepest);
        for (std::size_t other = 0; other < i; ++other) {
            const double depth = depth_of_pair(blocks[i], blocks[other]);
            if (depth > deepest.depth)
                deepest = {name_of_instance(index_of<effects::block>, other), depth};
        }
        if (deepest.depth > least)
            keep(blocks.size() == 1 ? "the block" : name_of_instance(index_of<effects::block>, i),
                 deepest);
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
