// pareto.h: non-dominated ranks and crowding distances of points of several objectives.
#pragma once

#include <cstdint>

namespace limax {

inline constexpr int32_t most_objectives = 8;

// As limax_pareto_rank of limax.h. Throws LIMAX_INVALID_ARGUMENT for NaN and sizes out of range.
void pareto_rank(const double* values, int32_t count, int32_t objectives, int32_t* rank,
                 double* crowding);

}  // namespace limax
