// summary.h: the summaries of traces as an outcome keeps them. SI units.
#pragma once

#include "limax.h"
#include "physics/summary.h"

namespace limax {

void keep_summary(const trace_summary& summary, limax_outcome& outcome);

}  // namespace limax
