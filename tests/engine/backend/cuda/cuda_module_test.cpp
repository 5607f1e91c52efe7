// cuda_module_test.cpp: binaries on their way to a GPU, with the fake driver (fake/driver.cpp):
// functions, facts, launches, and what happens to a binary that the driver refuses.
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

TEST_CASE("a module has functions and facts, and a launch has the requested shape") {
    const fake_machine machine;
    {
        const context gpu(*machine.api, 0);
        const stream queue(gpu);
        const auto binary = std::make_shared<const kernel_binary>(
            kernel_binary{kernel_set::of_title("step LIMAX_NX=5"), "sm_90", "not an image",
                          kernel_origin::compiled, 0.1, ""});
        const kernel_module module(gpu, binary);
        CHECK(contains(failure(LIMAX_INTERNAL, [&] { module.function("absent"); }),
                       "looking for absent in kernel 'step LIMAX_NX=5'"));
        CHECK(module.facts("present").registers == 100 + CU_FUNC_ATTRIBUTE_NUM_REGS);

        const CUfunction function = module.function("present");
        launch(gpu, function, {30, 256, 5000}, queue, "testing", 2.5);
        CHECK(machine.fake->launches == 1);
        CHECK(machine.fake->blocks == 30);
        CHECK(machine.fake->threads == 256);
        CHECK(machine.fake->shared_bytes == 5000);
        CHECK(machine.fake->cluster == 1);
        CHECK_FALSE(machine.fake->cooperative);
        CHECK(machine.fake->argument == 2.5);
        launch(gpu, function, {32, 128, 0, 16, true}, queue, "testing", -1.0, 7);
        CHECK(machine.fake->cluster == 16);
        CHECK(machine.fake->cooperative);
        CHECK(machine.fake->argument == -1.0);
        launch(gpu, function, {0, 128}, queue, "testing", 0.0);
        CHECK(machine.fake->launches == 2);
        machine.fail_next("cuLaunchKernelEx", CUDA_ERROR_LAUNCH_OUT_OF_RESOURCES);
        CHECK(contains(failure(LIMAX_INTERNAL,
                               [&] {
                                   launch(gpu, function, {1, 2000}, queue, "testing", 0.0);
                               }),
                       "CUDA: cuLaunchKernelEx failed while testing: CUDA_ERROR_701"));
    }
    machine.check_given_back();
}

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
