// generation.h: what host and device exchange about the work between two simulations:
// genomes, their bodies, how much they differ. Plain structs of fixed layout, read by both.
// Includes laws only. Pointers to robots are to the first one of a launch.
#pragma once

#include "body/lattice.h"
#include "genome/breeding.h"
#include "genome/gene_sums.h"
#include "genome/network.h"

namespace limax::cuda {

inline constexpr int gene_threads = 256, set_voxels = 32, set_warps = 16, genotype_threads = 32;
inline constexpr int most_materials = 16;

// First genomes.
struct initialize_launch {
    network_shape shape;
    double deviation[most_hidden_layers + 3];  // initial_deviations()
    random_key key;                            // but for the individual
    float* genomes;                            // [robot][gene]
    int32_t first, count;                      // robots
    int32_t genes;
};

struct breed_launch {
    breeding_rates rates;
    breeding_rates control_rates;  // of the last control_genes genes
    random_key key;                // but for the individual
    const float* parents;          // [parent][gene]
    const int32_t* pairs;          // [child][2]
    float* genomes;                // [child][gene]
    int32_t first, count;          // children
    int32_t genes, control_genes;
    int32_t elites;  // children below are copies of their first parent
};

// Genomes to materials and weights, a tile of as many voxels as a block has threads at a time.
struct express_launch {
    network_shape shape;
    const float* features;  // [feature][voxel]
    const float* genomes;   // [robot][gene]
    uint8_t* voxels;        // [robot][voxel]
    float* weights;         // [robot][3][voxel]
    float* scratch;         // [block][2][units][thread]; null where a block has room for it
    int64_t tiles;          // of all robots
    int32_t tiles_of_robot;
    int32_t voxel_count;  // of a robot
    int32_t genes;
    int32_t units;  // of the widest layer after the first
};

// limax_body.
struct body_record {
    int32_t status;
    int32_t voxels;
    int32_t counts[most_materials];
    int32_t masses, springs;
    int32_t size[3];
    int32_t reserved;
    uint64_t hash;
};

// Voxels to bodies: only the largest component stays if that is asked for; then all is described.
struct describe_launch {
    lattice grid;
    uint8_t* voxels;      // [robot][voxel]
    body_record* bodies;  // [robot]; status stays 0
    int32_t* scratch;     // [block][2][voxel]; null where a block has room for it
    int32_t count;        // robots
    int32_t largest_part;
};

// A set of robots against each other.
struct diversity_launch {
    const int32_t* robots;  // [member], indices into what follows
    int32_t members;
    const float* genomes;  // [robot][gene]
    int32_t genes;
    double scale;           // steps per unit of a gene; 0 asks for the largest magnitude instead
    int64_t* of_genes;      // [kind][gene]: gene_sums, or [gene]: magnitude_bits()
    const uint8_t* voxels;  // [robot][voxel]
    int64_t* counts;        // [voxel][most_materials]: number of members
    int32_t voxel_count;
};

}  // namespace limax::cuda
