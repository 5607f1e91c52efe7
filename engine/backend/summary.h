// summary.h: what a whole trace says in one number: the summaries of an outcome, on every device.
// SI units.
#pragma once

#include "limax.h"

namespace limax {

// One recorded trace from t = 0: data [count][width of its kind], `interval` seconds apart. No
// samples where the kind is not recorded.
struct trace_samples {
    const double* data = nullptr;
    int64_t count = 0;
    double interval = 0;
};

// Whether summarize() reads this limax_trace_kind.
bool summarized(int32_t kind);

// Fills the outcome's summaries of the kinds that were recorded; `samples` is [LIMAX_TRACE_KINDS].
void summarize(const trace_samples* samples, limax_outcome& outcome);

}  // namespace limax
