// parallel.h: the type of a parallel loop over indices, so that genomes and bodies do not depend
// on the thread pool.
#pragma once

#include <functional>

namespace limax {

// Calls the function once for each index 0 .. count - 1, in any order and on any threads, and
// returns when all calls have ended. If calls threw, it throws one of their exceptions on the
// caller's thread.
using parallel_for = std::function<void(int count, const std::function<void(int)>&)>;

}  // namespace limax
