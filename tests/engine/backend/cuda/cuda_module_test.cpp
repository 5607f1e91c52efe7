// cuda_module_test.cpp: what happens to a binary that the driver (fake/driver.cpp) refuses.
#include <doctest/doctest.h>

#include "backend/cuda/driver/kernel.h"
#include "cuda_compiler.h"
#include "failure.h"
#include "fake/machine.h"

using namespace limax::cuda;
using limax::test::failure;
using limax::test::fake_machine;
using limax::test::has_built_kernels;

namespace {

bool contains(const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
}

// Never the user's cache.
constexpr allowed_origins without_cache{true, false, true};

}  // namespace

TEST_CASE("a binary that is too new for the driver is compiled again") {
    if (!has_built_kernels()) return;
    const kernel_set& set = ahead_of_time_sets().front();
    const fake_machine machine;
    {
        const context gpu(*machine.api, 0);
        kernel_library library(gpu, without_cache);
        if (compiler::get(nullptr)) {
            machine.fail_next("cuModuleLoadDataEx", CUDA_ERROR_UNSUPPORTED_PTX_VERSION);
            CHECK(library.load(set)->binary().origin == kernel_origin::compiled);
        }
        // other errors are not hidden
        kernel_library second(gpu, without_cache);
        machine.fail_next("cuModuleLoadDataEx", CUDA_ERROR_OUT_OF_MEMORY);
        CHECK(contains(failure(LIMAX_OUT_OF_MEMORY, [&] { second.load(set); }),
                       "cuModuleLoadDataEx failed while loading kernel '" + set.title() + "' ("));
        // if no origin works, the driver's reason is reported
        machine.fake->refused_image =
            "\x7f"
            "ELF";
        const std::string text = failure(LIMAX_NO_DEVICE, [&] { second.load(set); });
        CHECK(contains(text, "): the fake driver's log: CUDA_ERROR_222"));
        CHECK(contains(text, "Update the NVIDIA driver"));
        kernel_library only_built(gpu, {true, false, false});
        CHECK(contains(failure(LIMAX_NO_DEVICE, [&] { only_built.load(set); }), "ahead of time"));
        machine.fake->refused_image = nullptr;
        CHECK(only_built.load(set)->binary().origin == kernel_origin::ahead_of_time);
    }
    machine.check_given_back();
}
