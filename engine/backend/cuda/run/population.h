// population.h: populations stored on a GPU: their genomes, bodies and descriptions, and the
// kernels that make them. With several GPUs the first one stores them.
#pragma once

#include <memory>

#include "backend/cuda/run/device.h"
#include "genome/device_population.h"
#include "genome/encoding.h"

namespace limax::cuda {

// An encoding on a GPU; the populations that use it share it.
struct device_encoding {
    std::shared_ptr<const encoding> code;
    device_memory<float> features;  // [feature][voxel]
};

// The bodies of a population on a GPU, unchanged as long as a simulation holds them.
class gpu_bodies final : public device_bodies {
public:
    gpu_bodies(std::shared_ptr<gpu_team> team, gpu_place& place, int64_t voxels, int32_t count);

    const gpu_place& place() const { return place_; }
    // As kernels of that GPU read them.
    const uint8_t* voxels() const { return voxels_.data(); }  // [robot][voxel]
    const float* weights() const { return weights_.data(); }  // [robot][3][voxel]
    void fetch(uint8_t* voxels, float* weights) const override;

private:
    friend class gpu_population;

    const std::shared_ptr<gpu_team> team_;  // outlives the memory
    gpu_place& place_;
    device_memory<uint8_t> voxels_;
    device_memory<float> weights_;
};

// Null where the GPU has no memory left for it.
std::shared_ptr<device_population> make_population(std::shared_ptr<gpu_team> team,
                                                   const std::shared_ptr<const encoding>& code,
                                                   int32_t count);

// Whether it is on a GPU of this team.
bool stored_on(const device_population& population, const gpu_team& team);

}  // namespace limax::cuda
