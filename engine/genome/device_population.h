// device_population.h: the interface that a device implements to store a population's arrays and to
// work on them.
#pragma once

#include <cstdint>
#include <memory>

#include "limax.h"

namespace limax {

// Bodies on a device, unchanged as long as this object exists.
class device_bodies {
public:
    virtual ~device_bodies() = default;
    // All of them: voxels [robot][voxel], weights [robot][3][voxel].
    virtual void fetch(uint8_t* voxels, float* weights) const = 0;
};

// The arrays of one population on one device, not initialised at first. Shapes and resulting bits
// are those of the class population, which checks all arguments beforehand. Every function returns
// when its work is done.
class device_population {
public:
    virtual ~device_population() = default;

    // Sets everything to 0, the initial values of a population.
    virtual void clear_genomes() = 0;
    virtual void clear_bodies() = 0;
    // All robots.
    virtual void send_bodies(const uint8_t* voxels, const float* weights) = 0;
    // Robots first .. first + count - 1.
    virtual void send_genomes(const float* genomes, int32_t first, int32_t count) = 0;
    virtual void fetch_genomes(float* genomes, int32_t first, int32_t count) const = 0;

    // `before` as of limax_population_number.
    virtual void initialize(uint32_t generation, int32_t before, int32_t first, int32_t count) = 0;
    // From parents on the same device. `pairs` [count][2] are those of these children.
    virtual void breed(const device_population& parents, const int32_t* pairs,
                       const limax_breeding& breeding, int32_t before, int32_t first,
                       int32_t count) = 0;
    // Sets `bodies` [count], with an unknown status.
    virtual void express(bool largest_part, int32_t first, int32_t count, limax_body* bodies) = 0;

    // [voxel][LIMAX_MAX_MATERIALS]: the number of robots, of the `count` listed, that have it
    // there.
    virtual void count_materials(const int32_t* robots, int32_t count, int64_t* counts) const = 0;
    // The largest magnitude_bits() of any gene of these robots.
    virtual uint32_t largest_gene(const int32_t* robots, int32_t count) const = 0;
    // [kinds_of_gene_sums][gene]: gene_sums of these robots.
    virtual void sum_genes(const int32_t* robots, int32_t count, double scale,
                           int64_t* sums) const = 0;

    // The bodies as they are now; later writes do not change them.
    virtual std::shared_ptr<const device_bodies> bodies() const = 0;
};

}  // namespace limax
