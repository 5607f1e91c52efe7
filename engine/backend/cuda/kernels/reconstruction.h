// reconstruction.h: a reconstruction of the scheme that the paper sketches, for benchmarks only: a
// thread per spring, then a thread per mass. That sums are shared-memory float atomics is our
// assumption. One block per robot, symplectic Euler, the laws of scene.h. The order of its sums is
// not fixed, so its bits are not repeatable; it does not look for divergence.
//   LIMAX_EFFECTS, LIMAX_PRECISION, LIMAX_LEAPFROG  as in scene.h: reconstructed_effects, 0, 0
//   LIMAX_THREADS                                   threads of a block
// SI units.
#pragma once

#include "backend/cuda/kernels/reconstruction_records.h"
#include "backend/cuda/kernels/scene.h"

namespace limax::cuda {

static_assert(LIMAX_EFFECTS == reconstructed_effects && LIMAX_PRECISION == single && !leapfrog);

// Columns of all masses of a robot in shared memory.
struct reconstructed_masses {
    float *position[3], *velocity[3], *force[3], *mass, *inverse_mass;

    __device__ reconstructed_masses(float* memory, int masses) {
        for (int axis = 0; axis < 3; ++axis) {
            position[axis] = memory + axis * masses;
            velocity[axis] = memory + (3 + axis) * masses;
            force[axis] = memory + (6 + axis) * masses;
        }
        mass = memory + 9 * masses;
        inverse_mass = memory + 10 * masses;
    }
    __device__ corner corner_at(int i) const {
        return {position[0][i], position[1][i], position[2][i],
                velocity[0][i], velocity[1][i], velocity[2][i]};
    }
    __device__ void add_force(int i, const limax::cuda::force& f) const {
        atomicAdd(force[0] + i, f.x);
        atomicAdd(force[1] + i, f.y);
        atomicAdd(force[2] + i, f.z);
    }
};

// `i` counts over all robots.
__device__ inline effects::spring_state<float> reconstructed_spring(
    const reconstruction_launch& launch, int64_t i) {
    const int64_t stride = int64_t(launch.robots) * launch.springs;
    const float* const column = launch.parameters + i;
    effects::spring_state<float> spring{};
    spring.rest = column[0];
    spring.stiffness = column[stride];
    spring.damping = column[2 * stride];
    spring.sine = column[3 * stride];
    spring.cosine = column[4 * stride];
    return spring;
}

// Steps one mass, and sets its force to 0.
__device__ inline void step_reconstructed_mass(const reconstructed_masses& masses, int i,
                                               const scene_params& params, float dt) {
    mass_state m{};
    for (int axis = 0; axis < 3; ++axis) {
        m.position[axis] = masses.position[axis][i];
        m.velocity[axis] = m.predicted[axis] = masses.velocity[axis][i];
    }
    m.mass = masses.mass[i];
    m.inverse_mass = masses.inverse_mass[i];
    float next_velocity[3];
    begin_mass(m, {masses.force[0][i], masses.force[1][i], masses.force[2][i]}, {}, params, {}, dt,
               next_velocity);
    finish_mass(m, next_velocity, dt, 1.0f);
    for (int axis = 0; axis < 3; ++axis) {
        masses.position[axis][i] = m.position[axis];
        masses.velocity[axis][i] = m.velocity[axis];
        masses.force[axis][i] = 0.0f;
    }
}

}  // namespace limax::cuda

extern "C" __global__ void __launch_bounds__(LIMAX_THREADS)
    limax_reconstruct(const __grid_constant__ limax::cuda::reconstruction_launch launch) {
    using namespace limax;
    using namespace limax::cuda;
    using effects::actuation;
    extern __shared__ float memory[];
    __shared__ actuation::moment<float> now;
    const reconstructed_masses masses(memory, launch.masses);
    const int thread = threadIdx.x;
    const float dt = float(launch.time_step);
    const scene_params params(launch.params);
    const int64_t first_mass = int64_t(blockIdx.x) * launch.masses,
                  first_spring = int64_t(blockIdx.x) * launch.springs,
                  stride = int64_t(launch.robots) * launch.masses;

    for (int i = thread; i < launch.masses; i += LIMAX_THREADS) {
        const int64_t at = first_mass + i;
        for (int axis = 0; axis < 3; ++axis) {
            masses.position[axis][i] = launch.state[axis * stride + at];
            masses.velocity[axis][i] = launch.state[(3 + axis) * stride + at];
            masses.force[axis][i] = 0.0f;
        }
        masses.mass[i] = launch.mass[at];
        masses.inverse_mass[i] = 1.0f / launch.mass[at];
    }
    // the last thread has the fewest masses
    const auto set_moment = [&](int64_t step) {
        if (thread != LIMAX_THREADS - 1) return;
        now =
            step < launch.settle_steps
                ? actuation::moment<float>{0.0f, 0.0f}
                : actuation::at<float>(launch.clock, step - launch.settle_steps, launch.time_step);
    };
    set_moment(0);
    __syncthreads();

    for (int64_t step = 0; step < launch.steps; ++step) {
        for (int i = thread; i < launch.springs; i += LIMAX_THREADS) {
            const spring_ends ends = launch.ends[first_spring + i];
            force on_near{}, on_far{};
            add_spring(masses.corner_at(ends.near), masses.corner_at(ends.far),
                       reconstructed_spring(launch, first_spring + i), now, on_near, on_far);
            masses.add_force(ends.near, on_near);
            masses.add_force(ends.far, on_far);
        }
        __syncthreads();
        for (int i = thread; i < launch.masses; i += LIMAX_THREADS)
            step_reconstructed_mass(masses, i, params, dt);
        set_moment(step + 1);
        __syncthreads();
    }

    for (int i = thread; i < launch.masses; i += LIMAX_THREADS)
        for (int axis = 0; axis < 3; ++axis) {
            launch.state[axis * stride + first_mass + i] = masses.position[axis][i];
            launch.state[(3 + axis) * stride + first_mass + i] = masses.velocity[axis][i];
        }
}
