// grid.h: properties of the voxels of one body: components, counts, extent, hash. Voxels are
// material indices [z][y][x]; 0 is empty.
#pragma once

#include <string>
#include <vector>

#include "body/lattice.h"
#include "limax.h"

namespace limax {

// Buffers of a search over a lattice, reused from body to body.
struct component_search {
    std::vector<int32_t> component;  // of each voxel, counted from 1; 0 before it is found
    std::vector<int32_t> open;       // voxels whose neighbours are still to be visited
};

// Empties every voxel outside the largest face-connected component; of equally large ones the one
// with the lowest voxel index stays. Not recursive, so bodies can be of any size.
void keep_largest_component(const lattice& grid, uint8_t* voxels, component_search& search);

// Hash of lattice and voxels. Equal bodies have equal hashes; different ones have equal hashes with
// a probability of 2^-64.
uint64_t body_hash(const lattice& grid, const uint8_t* voxels);

// Sets counts, masses, springs, extent and hash, but not `status`. Indices must be below
// LIMAX_MAX_MATERIALS.
void describe_body(const lattice& grid, const uint8_t* voxels, limax_body& body);

// The lattice of `size` [3]. Throws if an axis is below 1, if this machine lacks the memory that
// `what` (such as "a population of 30 robots") needs, or if there are more sites than indices.
lattice checked_lattice(const int32_t size[3], const std::string& what, double bytes_per_voxel);

}  // namespace limax
