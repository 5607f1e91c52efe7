// body_laws.h: the hash of a body, eight voxels at a time, and which of the voxels around a site
// own the springs that begin there. Laws, so that every device describes a body with the same
// bits; includes only lattice.h and portable.h.
#pragma once

#include "base/portable.h"
#include "body/lattice.h"

namespace limax {

// The finaliser of splitmix64 (G. Steele, D. Lea, C. Flood, "Fast splittable pseudorandom number
// generators", 2014): a bijection in which every bit of the input reaches every bit of the output.
LIMAX_LAW constexpr uint64_t scramble(uint64_t x) {
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9;
    x = (x ^ (x >> 27)) * 0x94d049bb133111eb;
    return x ^ (x >> 31);
}

// The hash of a lattice, with which the hash of every body on it starts.
LIMAX_LAW constexpr uint64_t hash_of_lattice(const lattice& grid) {
    uint64_t hash = 0x6c696d6178000001;  // any start but 0
    hash = scramble(hash ^ uint64_t(grid.nx));
    hash = scramble(hash ^ uint64_t(grid.ny));
    return scramble(hash ^ uint64_t(grid.nz));
}

// The hash with the next eight voxels, the first in the lowest byte. The lattice, hashed first,
// determines how many voxels the last group has.
inline constexpr int voxels_per_turn = 8;
LIMAX_LAW constexpr uint64_t hash_with(uint64_t hash, uint64_t voxels) {
    return scramble((hash + 0x9e3779b97f4a7c15) ^ voxels);
}

// The voxels that touch a site are bits: bit i + 2 j + 4 k is the one from i - 1, j - 1, k - 1 to
// i, j, k voxels beyond it. Those that also touch the far end of the spring along `d` own it: the
// rule of for_each_owner, for all springs of a site at once. The site itself is d = 0.
LIMAX_LAW constexpr int owners_around(const direction& d) {
    int owners = 0;
    for (int bit = 0; bit < 8; ++bit) {
        const bool beyond[3] = {(bit & 1) != 0, (bit & 2) != 0, (bit & 4) != 0};
        const int along[3] = {d.x, d.y, d.z};
        bool owns = true;
        for (int axis = 0; axis < 3; ++axis)
            owns = owns && (along[axis] == 0 || (along[axis] > 0) == beyond[axis]);
        owners |= owns ? 1 << bit : 0;
    }
    return owners;
}

}  // namespace limax
