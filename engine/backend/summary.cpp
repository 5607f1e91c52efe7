// summary.cpp: from the laws' summary to the interface's.
#include "backend/summary.h"

namespace limax {

static_assert(int(trace_center) == int(LIMAX_TRACE_CENTER_OF_MASS) &&
              int(trace_contact) == int(LIMAX_TRACE_CONTACT) &&
              int(trace_energy) == int(LIMAX_TRACE_ENERGY) &&
              int(trace_strain) == int(LIMAX_TRACE_STRAIN));

void keep_summary(const trace_summary& summary, limax_outcome& outcome) {
    outcome.path_length = summary.path_length;
    outcome.height = summary.height;
    outcome.contact = summary.contact;
    outcome.kinetic = summary.kinetic;
    outcome.elastic = summary.elastic;
    outcome.muscle_work = summary.muscle_work;
    outcome.strain = summary.strain;
    outcome.strain_most = summary.strain_most;
}

}  // namespace limax
