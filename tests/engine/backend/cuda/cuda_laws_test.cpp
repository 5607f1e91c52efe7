// cuda_laws_test.cpp: the laws as device code, through the compiler that runs where limax runs. No
// GPU is needed.
#include <doctest/doctest.h>

#include "backend/cuda/driver/kernel.h"
#include "cuda_compiler.h"
#include "laws.h"

using namespace limax::cuda;
using limax::test::found_compiler;
using limax::test::including;
using limax::test::law_headers;

namespace {

// What limax itself would compile `text` to, with its options and the texts that it carries; the
// warnings go to `log`.
std::string compiled(const compiler& nvrtc, const std::string& text, std::string& log) {
    // any will do: the newest is the strictest about what it no longer knows
    const std::string architecture = "sm_" + std::to_string(nvrtc.capabilities().back());
    return nvrtc.compile(text, kernel_headers(), architecture, kernel_options(), &log);
}

}  // namespace

TEST_CASE("every law compiles on its own with NVRTC") {
    const compiler* nvrtc = found_compiler();
    if (!nvrtc) return;
    for (const std::string& law : law_headers()) {
        CAPTURE(law);
        std::string log;
        CHECK_NOTHROW(compiled(*nvrtc, including({law}), log));
        CHECK(log == "");
    }
}

TEST_CASE("every law becomes device code with NVRTC") {
    const compiler* nvrtc = found_compiler();
    if (!nvrtc) return;
    std::string log;
    const std::string bytes =
        compiled(*nvrtc, including(law_headers()) + limax::test::kernel_of_every_law, log);
    CHECK(log == "");
    CHECK(bytes.find("every_law") != std::string::npos);
    // laws are inlined: a kernel calls nothing, so that it holds what its scene needs and no more
    CHECK(bytes.find(".text.every_law") != std::string::npos);
    CHECK(bytes.find(".text._Z") == std::string::npos);
}
