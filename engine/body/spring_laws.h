// spring_laws.h: the mass of a site and the parameters of a spring, from voxels, weights and
// materials: the laws of one site and of one spring, so that any device may compute each of them
// independently. In double, owners in ascending voxel index, rounded once to fp32. Includes only
// laws. SI units.
#pragma once

#include "base/math.h"
#include "body/lattice.h"

namespace limax {

// The properties of a material that the laws use.
struct material_law {
    double stiffness;        // N/m
    double mass_per_site;    // kg
    double damping_ratio;    // 1
    double amplitude;        // s a: above 0 for a muscle that expands, below for one that contracts
    double phase;            // largest phase, rad
    double stiffness_floor;  // smallest stiffness weight, 1
};

// A body as voxels. Material 0 is empty.
struct voxel_body {
    lattice grid;
    const uint8_t* voxels;          // material indices, [voxel]
    const float* weights;           // stiffness, amplitude, phase, [3][voxel]
    const material_law* materials;  // [material]
    double edge;                    // h, m
    bool summed;                    // a spring's stiffness is the sum over its owners, not the mean
    bool controlled;                // A is L0 over the number of owners (drive.h), B 0
};

// The share of one voxel in each of its springs.
struct voxel_share {
    double stiffness;      // N/m
    double damping_ratio;  // 1
    double sine, cosine;   // s a cos(phi) and s a sin(phi): relative change of rest length
};

// The share of a voxel that is not empty.
LIMAX_LAW voxel_share share_of(const voxel_body& body, int64_t voxel) {
    const material_law& material = body.materials[body.voxels[voxel]];
    const int64_t count = body.grid.voxels();
    const double weight = larger(double(body.weights[voxel]), material.stiffness_floor);
    voxel_share share{material.stiffness * weight, material.damping_ratio, 0.0, 0.0};
    if (material.amplitude != 0.0) {
        const double amplitude = material.amplitude * double(body.weights[count + voxel]);
        const double phase = material.phase * double(body.weights[2 * count + voxel]);  // rad
        double sine, cosine;
        sine_cosine_turns(phase / radians_per_turn, sine, cosine);
        share.sine = amplitude * cosine;
        share.cosine = amplitude * sine;
    }
    return share;
}

// Mass of the site (x, y, z): the mean over the voxels that touch it, kg; 0 where none does.
LIMAX_LAW float site_mass(const voxel_body& body, int x, int y, int z) {
    double sum = 0;
    int touching = 0;
    for_each_toucher(body.grid, x, y, z, [&](int64_t voxel) {
        if (body.voxels[voxel] == 0) return;
        sum += body.materials[body.voxels[voxel]].mass_per_site;
        ++touching;
    });
    return touching == 0 ? 0.0f : float(sum / touching);
}

// L0 of every spring along d, m.
LIMAX_LAW double rest_length(double edge, const direction& d) {
    return edge * square_root(double(d.squared()));
}

struct spring_parameters {
    bool owned;          // false where no voxel touches both ends: then all else is 0
    float stiffness;     // k, N/m
    float damping;       // c = 2 zeta sqrt(k m_r), N s/m
    float sine, cosine;  // A and B, m: the rest length changes by A sin(2 pi f t) + B cos(2 pi f t)
};

// The spring from the site (x, y, z) along d, between masses of `near` and `far` kg. `share(voxel)`
// is share_of(body, voxel) or what it gave before.
template <class Share>
LIMAX_LAW spring_parameters spring_between(const voxel_body& body, int x, int y, int z,
                                           const direction& d, double near, double far,
                                           const Share& share) {
    voxel_share sum{0, 0, 0, 0};
    int owners = 0;
    for_each_owner(body.grid, x, y, z, d, [&](int64_t voxel) {
        if (body.voxels[voxel] == 0) return;
        const voxel_share own = share(voxel);
        sum.stiffness += own.stiffness;
        sum.damping_ratio += own.damping_ratio;
        sum.sine += own.sine;
        sum.cosine += own.cosine;
        ++owners;
    });
    if (owners == 0) return {false, 0, 0, 0, 0};
    const double stiffness = body.summed ? sum.stiffness : sum.stiffness / owners;
    const double reduced_mass = near * far / (near + far);
    const double rest = rest_length(body.edge, d);
    return {true, float(stiffness),
            float(2.0 * (sum.damping_ratio / owners) * square_root(stiffness * reduced_mass)),
            body.controlled ? float(rest / owners) : float(rest * (sum.sine / owners)),
            body.controlled ? 0.0f : float(rest * (sum.cosine / owners))};
}

}  // namespace limax
