// reconstruction.h: runs a population on one GPU by a reconstruction of the scheme that the paper
// sketches, to compare with: a thread per spring, then a thread per mass; shared-memory float
// atomics are our assumption. SI units.
#pragma once

#include <vector>

#include "backend/backend.h"
#include "backend/cuda/kernels/reconstruction_records.h"

namespace limax::cuda {

// All robots of a setup as plain lists, column by column, as the kernel reads them.
struct listed_population {
    std::vector<reconstructed_robot> robots;
    std::vector<spring_ends> ends;  // [spring]
    std::vector<float> parameters;  // [parameter][spring]
    std::vector<float> mass;        // kg, [mass]
    std::vector<float> state;       // at the start, [6][mass]: see reconstruction_launch
    double position[3];             // where each robot's box starts, and its state counts from, m
    mass_params<float> params;

    // The kernel's arguments, for lists that lie at these addresses.
    reconstruction_launch arguments(const reconstructed_robot* robots_at,
                                    const spring_ends* ends_at, const float* parameters_at,
                                    const float* mass_at, float* state_at, int64_t steps) const;
    // Centre of mass of each robot in a state, [robot][3], m.
    std::vector<double> centers(const std::vector<float>& of_state) const;
};

// Refuses (LIMAX_INVALID_ARGUMENT) options that are not symplectic Euler in single precision, and
// robots that are masked out or not valid. `each` shares out the work.
listed_population list_population(const simulation_setup& setup, const parallel_for& each);

struct reconstructed_run {
    double seconds;              // that the GPU took for all steps, the least of three runs
    std::vector<double> center;  // centre of mass at the end, [robot][3], m
};

// `steps` steps of every robot of `setup` on the first GPU, each from the start. Refuses what
// list_population() does, and bodies that do not fit a block's shared memory.
reconstructed_run run_reconstruction(const simulation_setup& setup, const parallel_for& each,
                                     int64_t steps);

}  // namespace limax::cuda
