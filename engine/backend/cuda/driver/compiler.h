// compiler.h: NVRTC, the compiler for kernels, opened at run time. Includes std only.
#pragma once

#include <memory>
#include <string>
#include <vector>

namespace limax::cuda {

// A text that kernels may include, by the name that they include it by: "physics/effects/all.h".
struct header {
    const char* name;
    const char* text;
};

// The options of every kernel, at run time and ahead of time: CMake gives nvcc the same list. They
// keep every rounding as the text writes it.
const std::vector<std::string>& kernel_options();

class compiler {
public:
    // NVRTC of this machine, opened and tried at the first call and kept: the newest that the
    // driver understands. Null where there is none that works, with the reason, one sentence
    // without a full stop, in `why` (may be null). From any thread.
    static const compiler* get(std::string* why);

    const std::string& version() const { return version_; }  // "13.0"
    // Compute capabilities that it makes binaries for, ascending: 75 for 7.5.
    const std::vector<int>& capabilities() const { return capabilities_; }
    // For a GPU of this capability: "sm_90" where its own binary, or one of the same major version,
    // can be made, else "compute_90", the newest PTX that it can run, else empty.
    std::string architecture_for(int capability) const;

    // Compiles `text`: a binary for "sm_90", PTX for "compute_90". `log`, which may be null, gets
    // the warnings. A text that does not compile raises LIMAX_INTERNAL with the log.
    std::string compile(const std::string& text, const std::vector<header>& headers,
                        const std::string& architecture, const std::vector<std::string>& options,
                        std::string* log) const;

    ~compiler();

private:
    struct functions;

    compiler();
    static std::unique_ptr<const compiler> open(const char* name, std::string* why);

    std::unique_ptr<functions> nvrtc_;
    std::string version_;
    std::vector<int> capabilities_;
};

}  // namespace limax::cuda
