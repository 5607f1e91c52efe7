// springs.h: a body's masses and springs as columns in memory, by the laws of spring_laws.h:
// rounded once to fp32, so that every precision simulates the same body, except for L0, which has
// the precision of the forces. SI units.
#pragma once

#include "base/array.h"
#include "body/lattice.h"
#include "body/spring_laws.h"
#include "limax.h"

namespace limax {

// Columns of sites in memory are padded to whole vectors of this many elements, with springs of no
// stiffness.
inline constexpr int site_block = 16;

constexpr int64_t padded(int64_t sites) {
    return (sites + site_block - 1) / site_block * site_block;
}

// The properties of a material of the table that the laws use.
material_law law_of(const limax_material& material);

// The body whose masses and springs are made.
struct body_description {
    lattice grid;
    const uint8_t* voxels;            // material indices, [voxel]
    const float* weights;             // stiffness, amplitude, phase, [3][voxel]
    const limax_material* materials;  // [material]
    double edge;                      // h, m
    limax_sharing sharing;            // of a spring between its owners
    bool with_damping;                // whether the scene needs each spring's damping
    bool with_actuation;              // its sine and cosine
    bool with_faces = false;          // the exposed faces
    bool controlled = false;          // as in voxel_body
};

// Masses and springs by lattice rule. Site columns have `count` = padded(sites) elements; springs
// are [direction][count], and one without owners has no stiffness.
struct spring_body {
    lattice grid;
    int64_t count = 0;
    int32_t masses = 0;
    int32_t springs = 0;
    double rest[direction_count];  // L0 of each direction, m
    double total_mass = 0;         // kg
    int corner[3] = {0, 0, 0};     // lowest site of the bounding box along x, y, z
    array<float> mass;             // kg, [count]; 0 where the site is not in use
    array<float> stiffness;        // k, N/m
    array<float> damping;          // c, N s/m; empty without damping
    array<float>
        sine;  // A, m: amplitude of sin(2 pi f t) in the rest length; empty without actuation
    array<float> cosine;  // B, m; likewise
    // mass of the lightest corner of each exposed face, kg, [axis][count]; 0 where no face is
    // exposed; empty without faces
    array<float> faces;
    array<int32_t> sites;  // site of each mass, [mass]

    spring_body() = default;
    explicit spring_body(const body_description& description);
};

}  // namespace limax
