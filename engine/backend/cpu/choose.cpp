// choose.cpp: which passes this processor runs.
#include <cstring>
#include <span>
#include <string>

#include "backend/cpu/passes.h"
#include "base/error.h"

namespace limax::cpu {

namespace baseline {
extern const pass_table table;
}
#if defined(__x86_64__)
namespace x86_64_v3 {
extern const pass_table table;
}
namespace x86_64_v4 {
extern const pass_table table;
}
#endif

namespace {

struct candidate {
    const pass_table* table;
    bool runs;
};

#if defined(__x86_64__)
// The features that decide; every processor with these has the rest of its level.
bool runs_v3() {
    return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
           __builtin_cpu_supports("bmi") && __builtin_cpu_supports("bmi2");
}
bool runs_v4() {
    return runs_v3() && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
           __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq") &&
           __builtin_cpu_supports("avx512vl");
}
#endif

// Best first.
std::span<const candidate> candidates() {
    static const candidate list[] = {
#if defined(__x86_64__)
        {&x86_64_v4::table, runs_v4()},
        {&x86_64_v3::table, runs_v3()},
#endif
        {&baseline::table, true}
    };
    return list;
}

}  // namespace

const char* available_isas() {
    static const std::string names = [] {
        std::string text;
        for (const auto& [table, runs] : candidates())
            if (runs) text += (text.empty() ? "" : ",") + std::string(table->isa);
        return text;
    }();
    return names.c_str();
}

const pass_table& choose_passes(const char* isa) {
    const bool any = !isa || !*isa;
    for (const auto& [table, runs] : candidates())
        if (runs && (any || std::strcmp(isa, table->isa) == 0)) return *table;
    fail(LIMAX_INVALID_ARGUMENT,
         format("isa is '%s'; this processor runs %s", isa, available_isas()));
}

}  // namespace limax::cpu
