// traces.h: what a robot's simulation records: memory for every sample that its schedule will take,
// and the summaries of whole traces. SI units.
#pragma once

#include "backend/backend.h"
#include "base/array.h"
#include "physics/time_step.h"

namespace limax::cpu {

class traces {
public:
    traces(const schedule& plan, const spring_body& body, const scene& scene)
        : time_step_(plan.time_step) {
        for (int32_t kind = 0; kind < LIMAX_TRACE_KINDS; ++kind) {
            every_[kind] = plan.every[kind];
            width_[kind] = trace_width(kind, body.masses, body.grid.voxels(), scene);
            data_[kind] = array<double>(plan.samples[kind] * width_[kind]);
        }
    }

    // Is a sample of this kind due `step` steps after t = 0?
    bool due(int32_t kind, int64_t step) const { return every_[kind] && step % every_[kind] == 0; }
    // Where the next sample of this kind goes, [width].
    double* next(int32_t kind) { return data_[kind].data() + taken_[kind]++ * width_[kind]; }

    int64_t width(int32_t kind) const { return width_[kind]; }             // values per sample
    const double* data(int32_t kind) const { return data_[kind].data(); }  // [sample][width]
    int64_t taken(int32_t kind) const { return taken_[kind]; }             // samples so far

    // Fills the outcome's summaries of the kinds that were recorded.
    void summarize(limax_outcome& outcome) const {
        trace_samples samples[LIMAX_TRACE_KINDS] = {};
        for (int32_t kind = 0; kind < LIMAX_TRACE_KINDS; ++kind)
            samples[kind] = {data(kind), taken_[kind], double(every_[kind]) * time_step_};
        keep_summary(summarize_traces(samples), outcome);
    }

private:
    array<double> data_[LIMAX_TRACE_KINDS];
    int64_t width_[LIMAX_TRACE_KINDS] = {};
    int64_t every_[LIMAX_TRACE_KINDS] = {};  // steps between samples; 0 where nothing is recorded
    int64_t taken_[LIMAX_TRACE_KINDS] = {};
    double time_step_;  // s
};

}  // namespace limax::cpu
