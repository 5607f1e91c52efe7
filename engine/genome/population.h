// population.h: genomes and bodies of many robots on one lattice, and the operations on them
// between simulations, on the host or on the device that stores them. All operations work on ranges
// of robots and give the same bits for any ranges, any number of threads and any device.
#pragma once

#include <memory>

#include "base/array.h"
#include "base/parallel.h"
#include "body/grid.h"
#include "body/material.h"
#include "genome/device_population.h"
#include "genome/encoding.h"
#include "genome/network.h"
#include "limax.h"

namespace limax {

// The rules of a valid body.
struct body_rules {
    bool require_muscle = false;
    bool largest_part = false;  // only its largest face-connected part is kept
};

// The genomes and bodies of robots 0 .. count - 1. Messages count robots, parents and voxel
// coordinates from 1, as Lua does, and materials from 0. A function that throws because of its
// arguments has changed nothing.
class population {
public:
    // Without an encoding the robots have no genomes. Throws LIMAX_OUT_OF_MEMORY with what would be
    // needed.
    population(const int32_t size[3], int32_t count, std::shared_ptr<const encoding> code);

    int32_t count() const { return count_; }
    // As limax_population_number.
    void number(int32_t before);
    const lattice& grid() const { return grid_; }
    const std::shared_ptr<const encoding>& code() const { return code_; }
    int32_t genes() const { return code_ ? code_->genes() : 0; }
    int32_t control_genes() const { return code_ ? code_->control_genes() : 0; }
    const limax_body* bodies() const { return bodies_.data(); }  // [robot]

    // Arrays on the host, copied from the device when first needed. The const ones are valid until
    // the next call that writes. The caller may write through the others at any time: the array of
    // the host is then the current one and is sent to a device before every use there, until an
    // operation on the device writes the array; then the caller must ask for the pointer again.
    float* genomes();   // [robot][gene]; null without an encoding
    uint8_t* voxels();  // [robot][z][y][x]
    float* weights();   // [robot][3][z][y][x], each 0 to 1
    const float* genomes() const;
    const uint8_t* voxels() const;
    const float* weights() const;
    // A copy of the genomes of these robots, [count][gene], from host or device.
    void read_genomes(int32_t first, int32_t count, float* out) const;
    // Sets the genomes of these robots where the arrays are stored. Their bodies become unknown.
    void write_genomes(int32_t first, int32_t count, const float* in);

    // Stores the arrays on a device from now on; null for the host. Values do not change.
    void move_to(std::shared_ptr<device_population> stored) const;
    const device_population* on_device() const { return on_device_.get(); }
    // The bodies on the device; null if only the host has the current ones.
    std::shared_ptr<const device_bodies> bodies_on_device() const;

    // The functions below run where the arrays are stored; `each` and `pass` are for the host.

    // As limax_population_text.
    void write_text(int32_t first, int32_t count, const char* letters, char* out) const;

    // Random genomes, new ones for each generation. Bodies of these robots become unknown.
    void initialize(uint32_t generation, int32_t first, int32_t count, const parallel_for& each);

    // Genomes to bodies. A genome with NaN gives a body without voxels and with weights from 0 to
    // 1, as every other genome does.
    void express(const material_table& materials, body_rules rules, express_pass pass,
                 const parallel_for& each, int32_t first, int32_t count);

    // Describes bodies written by hand.
    void check(const material_table& materials, body_rules rules, int32_t first, int32_t count);

    // The bodies of these robots become unknown.
    void forget(int32_t first, int32_t count);

    // Children first .. first + count - 1 from `pairs` [child][2], indices into `parents`, which is
    // another population with as many genes. Bodies of these children become unknown. Runs on a
    // device if both populations are stored on one; the caller must ensure that it is the same.
    void breed(const population& parents, const int32_t* pairs, const limax_breeding& breeding,
               const parallel_for& each, int32_t first, int32_t count);

    // The diversity of the `count` robots listed, whose bodies must be known. Linear in `count`.
    limax_diversity diversity(const int32_t* robots, int32_t count) const;
    // The same in parts, as limax_population_largest_gene, limax_population_sums and
    // limax_population_diversity_of.
    float largest_gene(const int32_t* robots, int32_t count) const;
    int64_t sums_size() const;
    void sums(const int32_t* robots, int32_t count, float largest, int64_t* out) const;
    limax_diversity diversity_of(const int64_t* sums, float largest, int32_t different,
                                 int32_t count) const;

private:
    // Where the current values of an array are; they are all 0 if neither has them.
    struct presence {
        bool host = false, device = false;
        bool lent = false;  // a caller may write to the host's
    };

    void require_robots(int32_t first, int32_t count) const;
    void require_genomes() const;
    void judge(const material_table& materials, bool require_muscle, int32_t robot);
    void describe(const material_table& materials, bool require_muscle, int32_t robot);
    void require_set(const int32_t* robots, int32_t count) const;
    void count_materials(const int32_t* robots, int32_t count, int64_t* counts) const;
    void sum_genes(const int32_t* robots, int32_t count, double scale, int64_t* out) const;

    void genomes_to_host() const;
    void bodies_to_host() const;
    void genomes_to_device() const;
    void bodies_to_device() const;
    bool whole(int32_t first, int32_t count) const { return first == 0 && count == count_; }

    lattice grid_;
    int32_t count_;
    int32_t before_ = 0;
    std::shared_ptr<const encoding> code_;
    array<limax_body> bodies_;

    mutable array<float> genomes_;  // allocated when first needed, as the next two
    mutable array<uint8_t> voxels_;
    mutable array<float> weights_;
    mutable std::shared_ptr<device_population> on_device_;
    mutable presence genomes_at_, bodies_at_;
};

// As limax_distinct of limax.h.
int32_t distinct(const uint64_t* hashes, int32_t count);

}  // namespace limax
