// lattice.cpp: counts of masses and springs by the lattice rule.
#include "body/lattice.h"

namespace limax {

namespace {

int32_t count_owned(const lattice& grid, const uint8_t* voxels, const direction& d) {
    int32_t count = 0;
    for_each_site(grid, [&](int x, int y, int z) {
        bool owned = false;
        for_each_owner(grid, x, y, z, d, [&](int64_t voxel) { owned |= voxels[voxel] != 0; });
        count += owned;
    });
    return count;
}

}  // namespace

int32_t count_masses(const int32_t size[3], const uint8_t* voxels) {
    return count_owned(lattice{size[0], size[1], size[2]}, voxels, direction{0, 0, 0});
}

int32_t count_springs(const int32_t size[3], const uint8_t* voxels) {
    int32_t count = 0;
    for (const direction& d : directions)
        count += count_owned(lattice{size[0], size[1], size[2]}, voxels, d);
    return count;
}

}  // namespace limax
