// parallel.h: the shape of "do this for every index", so that genomes and bodies know no thread
// pool.
#pragma once

#include <functional>

namespace limax {

// Calls the function once for each index 0 .. count - 1, in any order and on any threads, and
// returns when all calls have ended. If calls threw, it throws one of their exceptions on the
// caller's thread.
using parallel_for = std::function<void(int count, const std::function<void(int)>&)>;

}  // namespace limax
