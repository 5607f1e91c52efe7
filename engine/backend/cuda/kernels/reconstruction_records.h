// reconstruction_records.h: the launch arguments of kernels/reconstruction.h, shared by host and
// device. Includes laws only. SI units.
#pragma once

#include "backend/cuda/kernels/records.h"

namespace limax::cuda {

// The effects that the reconstruction computes.
inline constexpr unsigned reconstructed_effects =
    effects::bit<effects::springs> | effects::bit<effects::damping> |
    effects::bit<effects::actuation> | effects::bit<effects::gravity> |
    effects::bit<effects::ground> | effects::bit<effects::friction>;
// Parameters of a spring: L0, k, c, A, B.
inline constexpr int reconstructed_parameters = 5;
// Floats of shared memory for a mass: position, velocity, force, mass, 1 / mass.
inline constexpr int reconstructed_values = 11;

// Masses at the two ends of a spring, by their numbers within the robot. Aligned, so that a thread
// reads both at once.
struct alignas(8) spring_ends {
    int32_t near, far;
};

struct reconstruction_launch {
    const spring_ends* ends;          // [robot][spring]
    const float* parameters;          // [parameter][robot][spring]
    const float* mass;                // kg, [robot][mass]
    float* state;                     // positions along x, y, z, then velocities, [6][robot][mass]
    int32_t robots, masses, springs;  // masses and springs of one robot
    int64_t steps, settle_steps;      // without actuation for the first settle_steps
    double time_step;                 // s
    effects::actuation::clock clock;
    mass_params<float> params;
};

}  // namespace limax::cuda
