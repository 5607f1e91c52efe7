// population.h: genomes and bodies of many robots on one lattice, and what happens to them between
// two simulations, on the host or on a device where they live. All work is over ranges of robots
// and gives the same bits however it is cut, on however many threads, and wherever it is done.
#pragma once

#include <memory>
#include <vector>

#include "base/array.h"
#include "base/parallel.h"
#include "body/grid.h"
#include "body/material.h"
#include "genome/encoding.h"
#include "genome/network.h"
#include "genome/residence.h"
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
    const std::shared_ptr<const encoding>& code() const { return code_; }
    int32_t genes() const { return code_ ? code_->genes() : 0; }
    const limax_body* bodies() const { return bodies_.data(); }  // [robot]

    // Arrays on the host, brought there at the first need. Those of the constant population are as
    // they are until the next call that writes. The others may be written through: they count, and
    // a device is sent them again at every need, until a device writes the array, from when on only
    // a new pointer has what counts.
    float* genomes();   // [robot][gene]; null without an encoding
    uint8_t* voxels();  // [robot][z][y][x]
    float* weights();   // [robot][3][z][y][x], each 0 to 1
    const float* genomes() const;
    const uint8_t* voxels() const;
    const float* weights() const;
    // A copy of the genomes of these robots, [count][gene], from wherever they are.
    void read_genomes(int32_t first, int32_t count, float* out) const;

    // Where it lives from now on; null for the host. Where it lives is no part of its value.
    void move_to(std::shared_ptr<residence> home) const;
    const residence* home() const { return home_.get(); }
    // Its bodies there; null where only the host's count.
    std::shared_ptr<const resident_bodies> bodies_at_home() const;

    // What follows is done where the population lives; `each` and `pass` are for the host.

    // The voxels of one robot: a letter for each, from `letters` [LIMAX_MAX_MATERIALS], lines along
    // x, an empty line between layers; ends in a zero. `out` holds (nx + 1) ny nz + nz characters.
    void write_text(int32_t robot, const char* letters, char* out) const;

    // Initial genomes. Bodies of these robots become unknown.
    void initialize(int32_t first, int32_t count, const parallel_for& each);

    // Genomes to bodies. A genome that holds no number gives an empty body, never a weight outside
    // 0 to 1.
    void express(const material_table& materials, bool require_muscle, express_pass pass,
                 const parallel_for& each, int32_t first, int32_t count);

    // Describes bodies written by hand; removes nothing.
    void check(const material_table& materials, bool require_muscle, int32_t first, int32_t count);

    // Children first .. first + count - 1 from `pairs` [child][2], indices into `parents`, which is
    // another population with as many genes. Bodies of these children become unknown. Done on a
    // device only where both live on it: callers see to it that two homes are of one device.
    void breed(const population& parents, const int32_t* pairs, const limax_breeding& breeding,
               const parallel_for& each, int32_t first, int32_t count);

    // Of the `count` robots listed, whose bodies must be known. Linear in the set.
    limax_diversity diversity(const int32_t* robots, int32_t count) const;

private:
    // Where an array has its present values; everything is 0 where nobody has.
    struct presence {
        bool host = false, device = false;
        bool lent = false;  // someone may be writing to the host's
    };

    void require_robots(int32_t first, int32_t count) const;
    void require_genomes() const;
    void judge(const material_table& materials, bool require_muscle, int32_t robot);
    void describe(const material_table& materials, bool require_muscle, int32_t robot);
    void forget(int32_t first, int32_t count);
    double hamming(const int32_t* robots, int32_t count) const;
    double genotype(const int32_t* robots, int32_t count) const;

    void genomes_to_host() const;
    void bodies_to_host() const;
    void genomes_to_device() const;
    void bodies_to_device() const;
    bool whole(int32_t first, int32_t count) const { return first == 0 && count == count_; }

    lattice grid_;
    int32_t count_;
    std::shared_ptr<const encoding> code_;
    array<limax_body> bodies_;

    mutable array<float> genomes_;  // empty until the first need, as are the next two
    mutable array<uint8_t> voxels_;
    mutable array<float> weights_;
    mutable std::shared_ptr<residence> home_;
    mutable presence genomes_at_, bodies_at_;
};

}  // namespace limax
