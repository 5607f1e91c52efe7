// summary.h: a whole trace in one number, sample by sample in ascending order, so that every
// device gives the same bits. Laws; includes portable.h only. SI units.
#pragma once

#include "base/portable.h"

namespace limax {

// One recorded trace from t = 0: data [count][width of its kind], `interval` seconds apart. No
// samples where the kind is not recorded.
struct trace_samples {
    const double* data;
    int64_t count;
    double interval;
};

// Measures of the path of the centre of mass, [sample][3].
struct path_summary {
    double length;  // horizontal, m
    double height;  // most above the first sample, m
};
LIMAX_LAW path_summary summarize_path(const trace_samples& path) {
    path_summary out{0, 0};
    for (int64_t s = 1; s < path.count; ++s) {
        const double* at = path.data + 3 * s;
        const double x = at[0] - at[-3], y = at[1] - at[-2];
        out.length += square_root(x * x + y * y);
        out.height = larger(at[2] - path.data[2], out.height);
    }
    return out;
}

LIMAX_LAW double mean_of_column(const trace_samples& trace, int64_t width, int64_t column) {
    double sum = 0;
    for (int64_t s = 0; s < trace.count; ++s) sum += trace.data[s * width + column];
    return sum / double(trace.count);
}

// Integral of the muscles' positive power, [sample][4] with the power last, by trapezoids, J.
LIMAX_LAW double work_of_muscles(const trace_samples& energy) {
    double work = 0;
    for (int64_t s = 1; s < energy.count; ++s) {
        const double before = larger(energy.data[4 * s - 1], 0.0);
        const double after = larger(energy.data[4 * s + 3], 0.0);
        work += 0.5 * energy.interval * (before + after);
    }
    return work;
}

// Largest strain of any sample, [sample][2] with the largest second.
LIMAX_LAW double largest_strain(const trace_samples& strain) {
    double most = 0;
    for (int64_t s = 0; s < strain.count; ++s) most = larger(strain.data[2 * s + 1], most);
    return most;
}

// Kinds of traces that are summarised, as in limax_trace_kind.
enum summarized_trace { trace_center = 0, trace_contact = 3, trace_energy = 4, trace_strain = 5 };

// The summaries of an outcome; NaN where their trace is not recorded.
struct trace_summary {
    double path_length, height, contact, kinetic, elastic, muscle_work, strain, strain_most;
};
LIMAX_LAW trace_summary summarize_traces(const trace_samples* samples) {
    const double none = bits_as<double>(uint64_t(0x7ff8) << 48);
    trace_summary out{none, none, none, none, none, none, none, none};
    if (samples[trace_center].count) {
        const path_summary path = summarize_path(samples[trace_center]);
        out.path_length = path.length;
        out.height = path.height;
    }
    if (samples[trace_contact].count) out.contact = mean_of_column(samples[trace_contact], 1, 0);
    if (samples[trace_energy].count) {
        out.kinetic = mean_of_column(samples[trace_energy], 4, 0);
        out.elastic = mean_of_column(samples[trace_energy], 4, 1);
        out.muscle_work = work_of_muscles(samples[trace_energy]);
    }
    if (samples[trace_strain].count) {
        out.strain = mean_of_column(samples[trace_strain], 2, 0);
        out.strain_most = largest_strain(samples[trace_strain]);
    }
    return out;
}

}  // namespace limax
