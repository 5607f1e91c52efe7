// build_test.cpp: what only the compiler can tell: every loop of the passes is vectorised, every
// law header stands alone, the header of the ABI is C, and contraction is off. Each case runs the
// compiler that built this program; laws also go through g++, clang++ and nvcc where these are.
#include <doctest/doctest.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "base/portable.h"
#include "laws.h"

namespace {

namespace fs = std::filesystem;

struct command_result {
    int status;
    std::string output;
};

command_result run(const std::string& command) {
    command_result result{-1, ""};
    FILE* pipe = popen((command + " 2>&1").c_str(), "r");
    if (!pipe) return result;
    char buffer[4096];
    for (std::size_t n; (n = fread(buffer, 1, sizeof buffer, pipe)) > 0;)
        result.output.append(buffer, n);
    result.status = pclose(pipe);
    return result;
}

const std::string root = LIMAX_SOURCE_DIR;
const std::string compiler = LIMAX_CXX_COMPILER;
const std::string flags =
    " -std=c++20 -Wall -Wextra -Werror -ffp-contract=off -I" + root + "/engine ";

bool is_gcc() {
    return run(compiler + " --version").output.find("Free Software Foundation") !=
           std::string::npos;
}

// Line numbers (from 1) of a file's lines that follow a LIMAX_LOOP mark: the loops that must
// vectorise.
std::set<int> marked_loops(const std::string& path) {
    std::ifstream file(path);
    std::set<int> lines;
    int number = 0;
    bool marked = false;
    for (std::string line; std::getline(file, line);) {
        ++number;
        if (marked) lines.insert(number);
        marked = line.find("    LIMAX_LOOP") != std::string::npos;
    }
    return lines;
}

}  // namespace

TEST_CASE("every marked loop of the passes is vectorised for v3 and v4" *
          doctest::skip(!is_gcc())) {
    // a report names the file as it was included
    const std::string folder = "backend/cpu/";
    std::set<std::pair<std::string, int>> loops;
    for (const std::string file : {"passes.inl", "xpbd_passes.inl"})
        for (const int line : marked_loops(root + "/engine/" + folder + file))
            loops.insert({folder + file, line});
    REQUIRE(loops.size() >= 15);
    for (const std::string level : {"v3", "v4"}) {
        const command_result report =
            run(compiler + flags + "-O3 -fno-math-errno -fno-trapping-math -march=x86-64-" + level +
                " -fopt-info-vec-optimized -c -o /dev/null " + root +
                "/engine/backend/cpu/passes_" + level + ".cpp");
        REQUIRE(report.status == 0);
        std::set<std::pair<std::string, int>> vectorised;
        std::istringstream lines(report.output);
        for (std::string line; std::getline(lines, line);) {
            const std::size_t at = line.find(folder), end = line.find(".inl:");
            if (at == std::string::npos || end == std::string::npos ||
                line.find("loop vectorized") == std::string::npos)
                continue;
            vectorised.insert({line.substr(at, end + 4 - at), std::atoi(line.c_str() + end + 5)});
        }
        for (const auto& loop : loops) {
            CAPTURE(level);
            CAPTURE(loop.first);
            CAPTURE(loop.second);
            CHECK(vectorised.count(loop) == 1);
        }
    }
}

TEST_CASE("every header of the engine compiles alone") {
    const std::string cuda = LIMAX_CUDA_INCLUDE;
    const std::string with_cuda = cuda.empty() ? "" : "-isystem " + cuda + " ";
    int headers = 0;
    for (const auto& entry : fs::recursive_directory_iterator(root + "/engine")) {
        if (entry.path().extension() != ".h") continue;
        const std::string folder = entry.path().parent_path().string();
        // kernels are not C++ alone, and what carries them needs the toolkit's headers
        if (folder.ends_with("/kernels") || (folder.ends_with("/cuda") && cuda.empty())) continue;
        // the express pass is text for a file that names its instruction set
        const std::string isa =
            entry.path().filename() == "express_pass.h" ? "-DLIMAX_ISA=alone " : "";
        const command_result result = run(compiler + flags + with_cuda + isa +
                                          "-Wno-unused-function -fsyntax-only -x c++ -include " +
                                          entry.path().string() + " /dev/null");
        CAPTURE(entry.path().string());
        CAPTURE(result.output);
        CHECK(result.status == 0);
        ++headers;
    }
    CHECK(headers > 20);
}

TEST_CASE("every law compiles alone with g++ and clang++") {
    for (const std::string name : {"g++", "clang++"}) {
        if (run("command -v " + name).status != 0) {
            MESSAGE("skipped: there is no ", name);
            continue;
        }
        for (const std::string& header : limax::test::law_headers()) {
            const command_result result = run(name + flags + "-fsyntax-only -x c++ -include " +
                                              root + "/engine/" + header + " /dev/null");
            CAPTURE(name);
            CAPTURE(header);
            CAPTURE(result.output);
            CHECK(result.status == 0);
        }
    }
}

TEST_CASE("every law compiles with nvcc, for host and device at once") {
    const std::string nvcc = LIMAX_CUDA_COMPILER;
    if (nvcc.empty()) {
        MESSAGE("skipped: this build found no nvcc");
        return;
    }
    const fs::path folder = fs::temp_directory_path() / ("limax-laws-" + std::to_string(getpid()));
    fs::create_directory(folder);
    const fs::path text = folder / "laws.cu";
    std::ofstream(text)
        << limax::test::including(limax::test::law_headers()) << limax::test::kernel_of_every_law
        << "double on_host(double x) {\n"
           "    return inverse_length(x) + exponential(x) + direction_at(int(x)).x;\n"
           "}\n";
    const command_result result =
        run(nvcc + " -ccbin=" + compiler + " --std=c++20 --fmad=false -Werror all-warnings -arch=" +
            "sm_90 -I " + root + "/engine -c -o /dev/null " + text.string());
    fs::remove_all(folder);
    CAPTURE(result.output);
    CHECK(result.status == 0);
}

TEST_CASE("limax.h is C, and its cdef part holds no preprocessor line") {
    CHECK(run("cc -std=c11 -Wall -Wextra -Werror -pedantic -fsyntax-only -x c " + root +
              "/engine/limax.h")
              .status == 0);
    std::ifstream file(root + "/engine/limax.h");
    bool inside = false;
    int declarations = 0;
    for (std::string line; std::getline(file, line);) {
        if (line.find("---- cdef ends ----") != std::string::npos) inside = false;
        if (inside) CHECK(line.rfind('#', 0) != 0);
        if (inside && line.find("limax_") != std::string::npos) ++declarations;
        if (line.find("---- cdef begins ----") != std::string::npos) inside = true;
    }
    CHECK(declarations > 50);
}

TEST_CASE("laws reach only laws, and no std header but through portable.h") {
    const std::vector<std::string> laws = limax::test::law_headers();
    CHECK(laws.size() >= 15);
    for (const std::string& law : laws) {
        std::ifstream file(root + "/engine/" + law);
        REQUIRE(file.good());
        for (std::string line; std::getline(file, line);) {
            if (line.rfind("#include", 0) != 0) continue;
            CAPTURE(law);
            CAPTURE(line);
            const std::size_t start = line.find('"') + 1;
            const bool of_laws =
                start > 0 && std::binary_search(laws.begin(), laws.end(),
                                                line.substr(start, line.find('"', start) - start));
            CHECK((of_laws || law == "base/portable.h"));
        }
    }
}

TEST_CASE("the effect that engine/README.md shows is a whole one") {
    std::ifstream page(root + "/engine/README.md");
    std::string example;
    bool inside = false;
    for (std::string line; std::getline(page, line);) {
        if (line == "```") inside = false;
        if (inside) example += line + "\n";
        if (line == "```cpp") inside = true;
    }
    REQUIRE(example.find("struct magnet") != std::string::npos);
    const fs::path folder =
        fs::temp_directory_path() / ("limax-effect-" + std::to_string(getpid()));
    fs::create_directory(folder);
    // it attracts with the gradient of its energy, at most as steeply as its bound says
    std::ofstream(folder / "magnet.cpp")
        << "#include \"physics/effects/all.h\"\n"
        << example
        << "using namespace limax::effects;\n"
           "static_assert(hooks_match<magnet>());\n"
           "int main() {\n"
           "    const double values[5] = {1, 2, 3, 0.5, 0.25}, origin[3] = {2, 0, 2};\n"
           "    const auto p = magnet::make<double>(values, origin);\n"
           "    const double most = magnet::bound(p, 0.1).stiffness, step = 1e-6;\n"
           "    double worst = 0, steepest = 0;\n"
           "    for (int i = 0; i < 100; ++i) {\n"
           "        const auto at = [&](double x) {\n"
           "            return node_state<double>{{x, 2.0 + 0.001 * i, 1.1}, {}, 0.1, 10};\n"
           "        };\n"
           "        const auto force = [&](double x) {\n"
           "            vector<double> sum{};\n"
           "            magnet::node(p, at(x), sum);\n"
           "            return sum.x;\n"
           "        };\n"
           "        const double x = -1.3 + 0.01 * i;\n"
           "        const double slope = (magnet::energy(p, at(x + step)) -\n"
           "                              magnet::energy(p, at(x - step))) / (2 * step);\n"
           "        const double gradient = (force(x + step) - force(x - step)) / (2 * step);\n"
           "        if (__builtin_fabs(slope + force(x)) > worst)\n"
           "            worst = __builtin_fabs(slope + force(x));\n"
           "        if (__builtin_fabs(gradient) > steepest) steepest = __builtin_fabs(gradient);\n"
           "    }\n"
           "    return worst < 1e-6 && steepest > 0.1 && steepest <= most ? 0 : 1;\n"
           "}\n";
    const std::string program = (folder / "magnet").string();
    const command_result result = run(compiler + flags + "-o " + program + " " + program + ".cpp");
    const int ended = run(program).status;
    fs::remove_all(folder);
    CAPTURE(result.output);
    REQUIRE(result.status == 0);
    CHECK(ended == 0);
}

TEST_CASE("contraction is off: a product and a sum round twice") {
    volatile float a = 1.0f + 0x1p-12f, b = a,
                   c = -1.0f - 0x1p-11f;  // a b = -c + 2^-24, half a unit in the last place
    const float product = a * b;
    CHECK(a * b + c == product + c);
    CHECK(limax::fma(float(a), float(b), float(c)) != product + c);
}
