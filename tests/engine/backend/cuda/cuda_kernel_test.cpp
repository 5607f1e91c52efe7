// cuda_kernel_test.cpp: kernels on their way from text to binary: compiled, cached, built with
// limax, and loaded by a fake driver (fake/driver.cpp). No GPU is needed.
#include <doctest/doctest.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <sstream>
#include <thread>

#include "backend/cuda/driver/kernel.h"
#include "cuda_compiler.h"
#include "environment.h"
#include "failure.h"
#include "fake/machine.h"
#include "scratch_folder.h"

namespace fs = std::filesystem;
using namespace limax::cuda;
using limax::test::contains;
using limax::test::failure;
using limax::test::fake_machine;
using limax::test::found_compiler;
using limax::test::has_built_kernels;
using limax::test::scratch_folder;

namespace {

// A kernel whose rounding shows whether options are passed on.
const std::string products_and_sums =
    "extern \"C\" __global__ void large(float* x) {\n"
    "    float y = x[threadIdx.x];\n"
    "#pragma unroll\n"
    "    for (int i = 0; i < 100; ++i) y = y * y + x[i];\n"
    "    x[threadIdx.x] = y;\n"
    "}\n";

// A set of the tree's that needs no define and holds no kernel.
const kernel_set plain_set{"cells", {}};

// How often `part` comes in a text.
int count(const std::string& text, const std::string& part) {
    int found = 0;
    for (std::size_t at = 0; (at = text.find(part, at)) != std::string::npos; at += part.size())
        ++found;
    return found;
}

}  // namespace

TEST_CASE("every embedded text equals its file") {
    std::set<std::string> names;
    for (const header& h : kernel_headers()) {
        CAPTURE(h.name);
        CHECK(names.insert(h.name).second);
        std::ifstream file(std::string(LIMAX_SOURCE_DIR "/engine/") + h.name);
        const bool same = std::string(std::istreambuf_iterator<char>(file), {}) == h.text;
        CHECK(same);
    }
}

TEST_CASE("PTX is text, without fused products and sums") {
    const compiler* nvrtc = found_compiler();
    if (!nvrtc) return;
    const auto compiled = [&](const char* architecture, const std::vector<std::string>& options) {
        return nvrtc->compile(products_and_sums, {}, architecture, options, nullptr);
    };
    const std::string ptx = compiled("compute_90", kernel_options());
    CHECK(contains(ptx, ".target sm_90"));
    CHECK(ptx.find('\0') == std::string::npos);
    CHECK(count(ptx, "fma.rn.f32") == 0);
    CHECK(count(ptx, "mul.rn.f32") == 100);
    CHECK(count(ptx, "add.rn.f32") == 100);
    CHECK(instruction_count(ptx, "large") == 0);
    CHECK(instruction_count(compiled("sm_90", kernel_options()), "large") > 300);
    // without the options the compiler contracts, which the count above detects
    CHECK(count(compiled("compute_90", {}), "fma.rn.f32") == 100);
}

TEST_CASE("the architecture for a GPU is its own, its major version's, or PTX") {
    const compiler* nvrtc = found_compiler();
    if (!nvrtc) return;
    const std::vector<int>& known = nvrtc->capabilities();
    REQUIRE(std::count(known.begin(), known.end(), 90) == 1);
    CHECK(std::is_sorted(known.begin(), known.end()));
    CHECK(nvrtc->architecture_for(75) == "sm_75");
    CHECK(nvrtc->architecture_for(90) == "sm_90");
    CHECK(nvrtc->architecture_for(94) == "sm_90");
    CHECK(nvrtc->architecture_for(9990) == limax::format("compute_%d", known.back()));
    CHECK(nvrtc->architecture_for(20) == "");
}

TEST_CASE("a kernel is compiled once, then cached") {
    if (!found_compiler()) return;
    const scratch_folder scratch;
    std::size_t notes = 0;
    const auto make = [&](const allowed_origins& allowed, int capability = 90) {
        kernel_cache cache(scratch.path.string());
        auto binary = make_binary(plain_set, capability, allowed, cache);
        CHECK(binary->set == plain_set);
        CHECK(binary->bytes.size() > 100);
        CHECK(binary->seconds > 0);
        notes = cache.take_notes().size();
        return binary;
    };
    const auto files = [&] { return std::distance(fs::directory_iterator(scratch.path), {}); };
    CHECK(failure(LIMAX_NO_DEVICE, [&] {
              make({true, true, false});
          }).find("and LIMAX_KERNELS forbids to compile it") != std::string::npos);
    const auto first = make({false, false, true});
    CHECK(first->origin == kernel_origin::compiled);
    CHECK(first->architecture == "sm_90");
    CHECK(files() == 0);
    CHECK(make({})->origin == kernel_origin::compiled);
    CHECK(files() == 1);
    const auto second = make({true, true, false});
    CHECK(second->origin == kernel_origin::cached);
    CHECK(second->bytes == first->bytes);
    // another GPU is another kernel
    CHECK(make({}, 80)->architecture == "sm_80");
    CHECK(files() == 2);
    CHECK(notes == 0);
}

TEST_CASE("a process compiles a kernel once, also from several threads") {
    if (!found_compiler()) return;
    std::vector<std::shared_ptr<const kernel_binary>> made(4);
    std::vector<std::thread> threads;
    threads.reserve(made.size());
    for (auto& slot : made)
        threads.emplace_back([&] { slot = binary_of(plain_set, 90, {false, false, true}); });
    for (std::thread& thread : threads) thread.join();
    REQUIRE(made[0]);
    for (const auto& other : made) CHECK(other == made[0]);
    CHECK(binary_of(plain_set, 80, {false, false, true}) != made[0]);
    // what failed is tried again
    for (int i = 0; i < 2; ++i)
        CHECK(failure(LIMAX_INTERNAL, [&] {
                  binary_of({"no_such_entry", {}}, 90, {false, false, true});
              }).find("no_such_entry") != std::string::npos);
}

TEST_CASE("embedded kernels are found for every GPU that they run on") {
    scratch_folder scratch;
    kernel_cache cache(scratch.path.string());
    if (!has_built_kernels()) return;
    for (const kernel_set& set : ahead_of_time_sets()) {
        CAPTURE(set.title());
        int machine_code = 0, ptx = 0;
        for (const embedded_binary& b : embedded_binaries()) {
            if (!(kernel_set::of_title(b.set) == set)) continue;
            CAPTURE(b.architecture);
            const bool is_ptx = std::string(b.architecture).rfind("compute_", 0) == 0;
            ++(is_ptx ? ptx : machine_code);
            const int capability = std::atoi(std::strchr(b.architecture, '_') + 1);
            const auto found =
                make_binary(set, is_ptx ? 9990 : capability, {true, false, false}, cache);
            CHECK(found->origin == kernel_origin::ahead_of_time);
            CHECK(found->architecture == b.architecture);
            CHECK(found->bytes == b.bytes);
            CHECK(b.bytes.substr(0, 4) == (is_ptx ? "//\n/"
                                                  : "\x7f"
                                                    "ELF"));
        }
        CHECK(machine_code >= 1);
        CHECK(ptx == 1);
        CHECK(failure(LIMAX_NO_DEVICE, [&] {
                  make_binary(set, 70, {true, false, false}, cache);
              }).find("no kernel for compute capability 7.0") != std::string::npos);
    }
    CHECK(fs::is_empty(scratch.path));
}

TEST_CASE("nvcc and NVRTC compile the same text") {
    const auto lines = [](const std::string& text) {
        std::istringstream in(text);
        std::multiset<std::string> all;
        for (std::string line; std::getline(in, line);) all.insert(line);
        return all;
    };
    std::multiset<std::multiset<std::string>> sources, sets;
    for (const auto& entry : fs::directory_iterator(LIMAX_KERNEL_FOLDER)) {
        if (entry.path().extension() != ".cu" || entry.path().stem() == "trial") continue;
        std::ifstream file(entry.path());
        sources.insert(lines({std::istreambuf_iterator<char>(file), {}}));
    }
    for (const kernel_set& set : ahead_of_time_sets()) sets.insert(lines(set.text()));
    for (const auto& set : sets) CHECK(sources.count(set) >= 1);
}

TEST_CASE("LIMAX_KERNELS selects the origins of kernels") {
    const limax::test::environment_variable variable("LIMAX_KERNELS");
    const auto origins = [&](const char* list) {
        variable.set(list);
        const allowed_origins found = origins_of_environment();
        return 100 * found.ahead_of_time + 10 * found.cached + found.compiled;
    };
    CHECK(origins("") == 111);
    CHECK(origins("compiled") == 1);
    CHECK(origins("cached,compiled") == 11);
    CHECK(origins("ahead-of-time") == 100);
    CHECK(failure(LIMAX_INVALID_ARGUMENT, [&] { origins("compiled,nvcc"); }) ==
          "LIMAX_KERNELS names 'nvcc'; it is a list of ahead-of-time, cached and compiled, with "
          "commas between");
}

TEST_CASE("a binary that the driver refuses as too new is compiled again") {
    if (!has_built_kernels()) return;
    // never the user's cache
    constexpr allowed_origins without_cache{true, false, true};
    const kernel_set& set = ahead_of_time_sets().front();
    const fake_machine machine;
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
