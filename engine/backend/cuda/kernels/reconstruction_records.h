// reconstruction_records.h: what host and device tell each other about the reconstruction
// (kernels/reconstruction.h): plain structs of fixed layout, read by both. Includes laws alone. SI
// units.
#pragma once

#include "backend/cuda/kernels/records.h"

namespace limax::cuda {

// Masses at the two ends of a spring, by their numbers within the robot. Aligned, so that a thread
// reads both at once.
struct alignas(8) spring_ends {
    int32_t near, far;
};

// Floats of shared memory that a mass takes: position, velocity, force, mass, 1 / mass.
inline constexpr int reconstructed_values = 11;

struct reconstructed_robot {
    int64_t first_mass, first_spring;  // in the columns of all robots
    int32_t masses, springs;
    double time_step;      // s
    int64_t settle_steps;  // without actuation
    effects::actuation::clock clock;
};

// Columns of springs hold those of all robots one after the other, `springs` in all; those of
// masses likewise.
struct reconstruction_launch {
    const reconstructed_robot* robots;  // [block]
    const spring_ends* ends;            // [spring]
    const float* parameters;            // L0, k, then c, then A and B as the scene needs them,
                                        // [parameter][spring]
    const float* mass;                  // kg, [mass]
    float* state;                       // positions along x, y, z, then velocities, [6][mass]
    int64_t springs, masses;
    int64_t steps;
    mass_params<float> params;
};

}  // namespace limax::cuda
