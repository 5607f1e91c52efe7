// traces.cpp: sizes.
#include "backend/cpu/traces.h"

#include "backend/backend.h"

namespace limax::cpu {

traces::traces(const schedule& plan, int64_t masses) : time_step_(plan.time_step) {
    for (int32_t kind = 0; kind < LIMAX_TRACE_KINDS; ++kind) {
        every_[kind] = plan.every[kind];
        width_[kind] = trace_width(kind, masses);
        data_[kind] = array<double>(plan.samples[kind] * width_[kind]);
    }
}

void traces::summarize(limax_outcome& outcome) const {
    trace_samples samples[LIMAX_TRACE_KINDS] = {};
    for (int32_t kind = 0; kind < LIMAX_TRACE_KINDS; ++kind)
        samples[kind] = {data_[kind].data(), taken_[kind], double(every_[kind]) * time_step_};
    keep_summary(summarize_traces(samples), outcome);
}

}  // namespace limax::cpu
