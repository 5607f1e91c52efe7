// traces.cpp: sizes and summaries.
#include "backend/cpu/traces.h"

#include <algorithm>
#include <cmath>

namespace limax::cpu {

traces::traces(const schedule& plan, int64_t masses) : time_step_(plan.time_step) {
    for (int32_t kind = 0; kind < LIMAX_TRACE_KINDS; ++kind) {
        every_[kind] = plan.every[kind];
        width_[kind] = trace_width(kind, masses);
        data_[kind] = array<double>(plan.samples[kind] * width_[kind]);
    }
}

double traces::mean(int32_t kind, int64_t column) const {
    double sum = 0;
    for (int64_t s = 0; s < taken_[kind]; ++s) sum += data_[kind][s * width_[kind] + column];
    return sum / double(taken_[kind]);
}

void traces::summarize(limax_outcome& outcome) const {
    if (const int64_t samples = taken_[LIMAX_TRACE_CENTER_OF_MASS]) {
        const array<double>& path = data_[LIMAX_TRACE_CENTER_OF_MASS];
        outcome.path_length = outcome.height = 0;
        for (int64_t s = 1; s < samples; ++s) {
            const double x = path[3 * s] - path[3 * s - 3], y = path[3 * s + 1] - path[3 * s - 2];
            outcome.path_length += std::sqrt(x * x + y * y);
            outcome.height = std::max(outcome.height, path[3 * s + 2] - path[2]);
        }
    }
    if (taken_[LIMAX_TRACE_CONTACT]) outcome.contact = mean(LIMAX_TRACE_CONTACT, 0);
    if (const int64_t samples = taken_[LIMAX_TRACE_ENERGY]) {
        const array<double>& energy = data_[LIMAX_TRACE_ENERGY];
        outcome.kinetic = mean(LIMAX_TRACE_ENERGY, 0);
        outcome.elastic = mean(LIMAX_TRACE_ENERGY, 1);
        // trapezoids over the samples
        const double interval = double(every_[LIMAX_TRACE_ENERGY]) * time_step_;
        outcome.muscle_work = 0;
        for (int64_t s = 1; s < samples; ++s) {
            const double before = std::max(0.0, energy[4 * s - 1]);
            const double after = std::max(0.0, energy[4 * s + 3]);
            outcome.muscle_work += 0.5 * interval * (before + after);
        }
    }
    if (const int64_t samples = taken_[LIMAX_TRACE_STRAIN]) {
        outcome.strain = mean(LIMAX_TRACE_STRAIN, 0);
        outcome.strain_most = 0;
        for (int64_t s = 0; s < samples; ++s)
            outcome.strain_most =
                std::max(outcome.strain_most, data_[LIMAX_TRACE_STRAIN][2 * s + 1]);
    }
}

}  // namespace limax::cpu
