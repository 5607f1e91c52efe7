// summary.cpp: sums over samples in ascending order.
#include "backend/summary.h"

#include <algorithm>
#include <cmath>

namespace limax {

namespace {

double mean(const trace_samples& trace, int64_t width, int64_t column) {
    double sum = 0;
    for (int64_t s = 0; s < trace.count; ++s) sum += trace.data[s * width + column];
    return sum / double(trace.count);
}

}  // namespace

bool summarized(int32_t kind) {
    return kind != LIMAX_TRACE_POSITION && kind != LIMAX_TRACE_VELOCITY;
}

void summarize(const trace_samples* samples, limax_outcome& outcome) {
    if (const trace_samples& path = samples[LIMAX_TRACE_CENTER_OF_MASS]; path.count) {
        outcome.path_length = outcome.height = 0;
        for (int64_t s = 1; s < path.count; ++s) {
            const double* at = path.data + 3 * s;
            const double x = at[0] - at[-3], y = at[1] - at[-2];
            outcome.path_length += std::sqrt(x * x + y * y);
            outcome.height = std::max(outcome.height, at[2] - path.data[2]);
        }
    }
    if (const trace_samples& contact = samples[LIMAX_TRACE_CONTACT]; contact.count)
        outcome.contact = mean(contact, 1, 0);
    if (const trace_samples& energy = samples[LIMAX_TRACE_ENERGY]; energy.count) {
        outcome.kinetic = mean(energy, 4, 0);
        outcome.elastic = mean(energy, 4, 1);
        // trapezoids over the samples
        outcome.muscle_work = 0;
        for (int64_t s = 1; s < energy.count; ++s) {
            const double before = std::max(0.0, energy.data[4 * s - 1]);
            const double after = std::max(0.0, energy.data[4 * s + 3]);
            outcome.muscle_work += 0.5 * energy.interval * (before + after);
        }
    }
    if (const trace_samples& strain = samples[LIMAX_TRACE_STRAIN]; strain.count) {
        outcome.strain = mean(strain, 2, 0);
        outcome.strain_most = 0;
        for (int64_t s = 0; s < strain.count; ++s)
            outcome.strain_most = std::max(outcome.strain_most, strain.data[2 * s + 1]);
    }
}

}  // namespace limax
