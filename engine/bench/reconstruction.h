/* reconstruction.h: the function of liblimax that `limax bench throughput` times beside limax. It
 * is not part of limax.h and may change at any time. */
#pragma once

#include "limax.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Steps every robot of a population `steps` times from the start by a reconstruction of the scheme
 * that the paper sketches: a thread per spring, then a thread per mass. That the sums are
 * shared-memory float atomics is our assumption. Runs on the first GPU of a `cuda` device. The
 * caller guarantees a scene of springs, damping, actuation, gravity, ground and friction,
 * symplectic Euler in single precision with a fixed time step, and valid bodies of one shape. It
 * does not look for divergence, and the order of its sums, and so its last bits, change from run to
 * run. `seconds` is the GPU time of all steps, the least of three runs; `center` gets the first
 * robot's centre of mass at the end, m. */
__attribute__((visibility("default"))) limax_status limax_bench_reconstruction(
    limax_device* device, const limax_population* population, const limax_materials* materials,
    const limax_scene* scene, const limax_simulation_options* options, int64_t steps,
    double* seconds, double center[3]);

#ifdef __cplusplus
}
#endif
