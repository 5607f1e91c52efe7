// lattice.cpp: counts of masses and springs by the lattice rule.
#include "body/lattice.h"

#include <algorithm>
#include <array>
#include <vector>

#include "body/body_laws.h"

namespace limax {

namespace {

// For each site the voxels around it that are there, as the bits of owners_around().
std::vector<uint8_t> voxels_around_sites(const int32_t size[3], const uint8_t* voxels) {
    const lattice grid{size[0], size[1], size[2]};
    std::vector<uint8_t> around(std::size_t(grid.sites()));
    for (int z = 0; z < grid.nz; ++z)
        for (int y = 0; y < grid.ny; ++y)
            for (int x = 0; x < grid.nx; ++x) {
                if (*voxels++ == 0) continue;
                for (int bit = 0; bit < 8; ++bit)
                    around[std::size_t(grid.site(x + 1 - (bit & 1), y + 1 - (bit >> 1 & 1),
                                                 z + 1 - (bit >> 2)))] |= uint8_t(1 << bit);
            }
    return around;
}

// Springs that begin at a site, by the voxels around it.
constexpr auto springs_of_site = [] {
    std::array<int32_t, 256> springs{};
    for (int around = 0; around < 256; ++around)
        for (const direction& d : directions)
            springs[std::size_t(around)] += (around & owners_around(d)) != 0;
    return springs;
}();

}  // namespace

int32_t count_masses(const int32_t size[3], const uint8_t* voxels) {
    const auto around = voxels_around_sites(size, voxels);
    return int32_t(std::count_if(around.begin(), around.end(), [](uint8_t of) { return of != 0; }));
}

int32_t count_springs(const int32_t size[3], const uint8_t* voxels) {
    int32_t count = 0;
    for (const uint8_t around : voxels_around_sites(size, voxels)) count += springs_of_site[around];
    return count;
}

}  // namespace limax
