// summarize.h: one number for each trace of robots that have ended, a thread per
// robot. SI units.
#pragma once

#include "backend/cuda/kernels/records.h"
#include "physics/summary.h"

extern "C" __global__ void __launch_bounds__(limax::cuda::summarize_threads)
    limax_summarize(const __grid_constant__ limax::cuda::summarize_launch launch) {
    using namespace limax;
    using namespace limax::cuda;
    const int index = int(blockIdx.x) * summarize_threads + int(threadIdx.x);
    if (index >= launch.count) return;
    const robot_record& record = launch.records[launch.ended[index]];
    trace_samples samples[sample_kinds] = {};
    for (int kind = 0; kind < sample_kinds; ++kind)
        if (record.taken[kind] > 0)
            samples[kind] = {launch.samples[kind] + record.offset[kind], record.taken[kind],
                             double(record.every[kind]) * record.time_step};
    launch.summaries[index] = summarize_traces(samples);
}
