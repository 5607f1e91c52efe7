// grid.h: questions about the voxels of one body: what hangs together, how many, how large, is it
// the same body. Voxels are material indices [z][y][x], 0 is empty.
#pragma once

#include <string>
#include <vector>

#include "body/lattice.h"
#include "limax.h"

namespace limax {

// Memory of a search over a lattice, kept from one body to the next.
struct component_search {
    std::vector<int32_t> component;  // of each voxel, counted from 1; 0 before it is found
    std::vector<int32_t> open;       // voxels whose neighbours are still to be looked at
};

// Empties every voxel outside the largest face-connected component; of equally large ones the one
// that holds the lowest voxel index stays. No recursion, so any size will do.
void keep_largest_component(const lattice& grid, uint8_t* voxels, component_search& search);

// Of lattice and voxels: equal bodies have equal hashes, and different ones differ but for a chance
// of 2^-64.
uint64_t body_hash(const lattice& grid, const uint8_t* voxels);

// Counts, masses, springs, extent and hash; `status` is left alone. Indices must be below
// LIMAX_MAX_MATERIALS.
void describe_body(const lattice& grid, const uint8_t* voxels, limax_body& body);

// The lattice of `size` [3], or a refusal: an axis below 1, memory that `what` (such as "a
// population of 30 robots") would need and this machine lacks, or more sites than have an index.
lattice checked_lattice(const int32_t size[3], const std::string& what, double bytes_per_voxel);

}  // namespace limax
