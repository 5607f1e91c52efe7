// memory.h: how much memory this process may use, so that a request that cannot fit is refused
// before anything is allocated. Bytes.
#pragma once

#include <unistd.h>

#include <cstdio>

#include "base/array.h"
#include "base/error.h"

namespace limax {

// Physical memory, or the limit of this process's control group (cgroup v2, then v1) where that is
// smaller.
inline double machine_memory() {
    double least = double(sysconf(_SC_PHYS_PAGES)) * double(sysconf(_SC_PAGESIZE));
    for (const char* path :
         {"/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes"}) {
        std::FILE* file = std::fopen(path, "r");
        if (!file) continue;
        unsigned long long limit = 0;  // the file contains "max" where there is none
        if (std::fscanf(file, "%llu", &limit) == 1 && double(limit) < least) least = double(limit);
        std::fclose(file);
    }
    return least;
}

// Throws LIMAX_OUT_OF_MEMORY, "WHAT needs ... GB; this machine has ... GB", if the bytes do not fit
// in addition to those that the arrays hold.
inline void require_memory(const std::string& what, double bytes) {
    const double held = double(bytes_held().load()), machine = machine_memory();
    if (bytes + held <= machine) return;
    std::string text =
        what + format(" needs %.3g GB; this machine has %.3g GB", bytes / 1e9, machine / 1e9);
    if (held > 0.01 * machine) text += format(", of which %.3g GB are in use", held / 1e9);
    fail(LIMAX_OUT_OF_MEMORY, text);
}

}  // namespace limax
