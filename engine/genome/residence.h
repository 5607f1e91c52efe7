// residence.h: a population's arrays on a device, and what is done with them there. What a device
// implements so that populations can live on it; knows no device.
#pragma once

#include <cstdint>
#include <memory>

#include "limax.h"

namespace limax {

// Bodies on a device that nobody writes to any more while someone holds them.
class resident_bodies {
public:
    virtual ~resident_bodies() = default;
    // All of them: voxels [robot][voxel], weights [robot][3][voxel].
    virtual void fetch(uint8_t* voxels, float* weights) const = 0;
};

// The arrays of one population on one device, none of them set at first. Shapes, and the bits that
// come out, are those of the population; arguments are checked before they come here. Every
// function has ended its work when it returns.
class residence {
public:
    virtual ~residence() = default;

    // Everything 0: what a population is before anyone writes to it.
    virtual void clear_genomes() = 0;
    virtual void clear_bodies() = 0;
    // All robots.
    virtual void send_genomes(const float* genomes) = 0;
    virtual void send_bodies(const uint8_t* voxels, const float* weights) = 0;
    // Robots first .. first + count - 1.
    virtual void fetch_genomes(float* genomes, int32_t first, int32_t count) const = 0;

    virtual void initialize(int32_t first, int32_t count) = 0;
    // From parents that live on the same device. `pairs` [count][2] are those of these children.
    virtual void breed(const residence& parents, const int32_t* pairs,
                       const limax_breeding& breeding, int32_t first, int32_t count) = 0;
    // `bodies` [count] get everything but their status, which becomes unknown.
    virtual void express(int32_t first, int32_t count, limax_body* bodies) = 0;

    // Of the `count` robots listed. [voxel]: the sum over materials of the squared number of robots
    // that have it there.
    virtual void count_same(const int32_t* robots, int32_t count, int64_t* same) const = 0;
    // [gene]: the sum over the robots, in their order, of the squared deviation from their mean.
    virtual void sum_squares(const int32_t* robots, int32_t count, double* squares) const = 0;

    // What the bodies are now; writing to them afterwards leaves these as they are.
    virtual std::shared_ptr<const resident_bodies> bodies() const = 0;
};

}  // namespace limax
