// overlap.h: bodies that begin inside what pushes them out, which throws them. SI units.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "body/lattice.h"
#include "limax.h"
#include "physics/scene.h"

namespace limax {

// Contacts at the start that are deeper than this share of an edge count.
inline constexpr double overlap_share = 0.05;

// The deepest contact at the start.
struct overlap {
    std::string subject;   // "robot 3", from 1, or a block; empty if nothing overlaps
    std::string obstacle;  // "scene.boxes[2]", numbered as the scene was made
    double depth = 0;      // m
    int32_t robots = 0;    // that overlap something
};

// Tests the masses of each robot that `mask` includes, unless anchors hold bodies, and the blocks.
// `voxels` returns all bodies, [robot][z][y][x], and is called only if a body that fills the
// lattice would overlap something.
overlap find_overlap(const lattice& grid, const limax_simulation_options& options,
                     const scene& scene, const std::vector<uint8_t>& mask,
                     const std::function<const uint8_t*()>& voxels);

}  // namespace limax
