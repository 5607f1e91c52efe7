// population.h: genomes and bodies of many robots on one lattice, and what happens to them between
// two simulations. All work is over ranges of robots and gives the same bits however it is cut and
// on however many threads.
#pragma once

#include <memory>
#include <vector>

#include "base/array.h"
#include "base/parallel.h"
#include "body/grid.h"
#include "body/material.h"
#include "genome/encoding.h"
#include "genome/network.h"
#include "limax.h"

namespace limax {

// Indices count from 0; texts of errors count robots, parents and voxel coordinates from 1, as Lua
// shows them, and give material indices as they are stored. A function that throws on its arguments
// has changed nothing.
class population {
public:
    // Without an encoding the robots have no genomes. Throws LIMAX_OUT_OF_MEMORY with what would be
    // needed.
    population(const int32_t size[3], int32_t count, std::shared_ptr<const encoding> code);

    int32_t count() const { return count_; }
    const lattice& grid() const { return grid_; }
    int32_t genes() const { return code_ ? code_->genes() : 0; }
    float* genomes() { return code_ ? genomes_.data() : nullptr; }  // [robot][gene]
    uint8_t* voxels() { return voxels_.data(); }                    // [robot][z][y][x]
    float* weights() { return weights_.data(); }  // [robot][3][z][y][x], each 0 to 1
    const float* genomes() const { return code_ ? genomes_.data() : nullptr; }
    const uint8_t* voxels() const { return voxels_.data(); }
    const float* weights() const { return weights_.data(); }
    const limax_body* bodies() const { return bodies_.data(); }  // [robot]

    // Initial genomes. Bodies of these robots become unknown.
    void initialize(int32_t first, int32_t count, const parallel_for& each);

    // Genomes to bodies. A genome that holds no number gives an empty body, never a weight outside
    // 0 to 1.
    void express(const material_table& materials, bool require_muscle, express_pass pass,
                 const parallel_for& each, int32_t first, int32_t count);

    // Describes bodies written by hand; removes nothing.
    void check(const material_table& materials, bool require_muscle, int32_t first, int32_t count);

    // Children first .. first + count - 1 from `pairs` [child][2], indices into `parents`, which is
    // another population with as many genes. Bodies of these children become unknown.
    void breed(const population& parents, const int32_t* pairs, const limax_breeding& breeding,
               const parallel_for& each, int32_t first, int32_t count);

    // Of the `count` robots listed, whose bodies must be known. Linear in the set.
    limax_diversity diversity(const int32_t* robots, int32_t count) const;

private:
    void require_robots(int32_t first, int32_t count) const;
    void require_genomes() const;
    void describe(const material_table& materials, bool require_muscle, int32_t robot);
    void forget(int32_t first, int32_t count);
    double hamming(const int32_t* robots, int32_t count) const;
    double genotype(const int32_t* robots, int32_t count) const;

    lattice grid_;
    int32_t count_;
    std::shared_ptr<const encoding> code_;
    array<float> genomes_;
    array<uint8_t> voxels_;
    array<float> weights_;
    array<limax_body> bodies_;
};

}  // namespace limax
