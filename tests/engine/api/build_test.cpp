// build_test.cpp: what only the compiler or the text of the sources can show.
#include <doctest/doctest.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "scratch_folder.h"

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

// The rooms of the C++ code, and which others each may include. Everyone may include limax.h.
const std::map<std::string, std::set<std::string>> rooms = {
    {"base", {}},
    {"body", {"base"}},
    {"genome", {"base", "body"}},
    {"physics", {"base", "body"}},
    {"backend", {"base", "body", "genome", "physics", "backend/cpu", "backend/cuda/run"}},
    {"backend/cpu", {"base", "body", "genome", "physics", "backend"}},
    {"backend/cuda/kernels", {"base", "body", "genome", "physics"}},
    {"backend/cuda/driver", {"base"}},
    {"backend/cuda/plan",
     {"base", "body", "genome", "physics", "backend", "backend/cuda/kernels",
      "backend/cuda/driver"}},
    {"backend/cuda/run",
     {"base", "body", "genome", "physics", "backend", "backend/cuda/kernels", "backend/cuda/driver",
      "backend/cuda/plan"}},
    {"api", {"base", "body", "genome", "physics", "backend"}},
    {"bench",
     {"base", "body", "genome", "physics", "backend", "api", "backend/cuda/kernels",
      "backend/cuda/driver"}},
    {"bindings/host", {}}};

// A file as #include names it: below engine/, or in the folder of the file that includes it.
std::string name_of(const std::string& path, const std::string& includer = "engine/") {
    if (path.rfind("engine/", 0) == 0) return path.substr(7);
    const bool in_host = includer.rfind("bindings/", 0) == 0 && path != "limax.h";
    return in_host ? "bindings/host/" + path : path;
}
// The room of a file; empty for limax.h and generated files.
std::string room_of(const std::string& name) {
    std::string folder = fs::path(name).parent_path().string();
    while (!folder.empty() && rooms.count(folder) == 0)
        folder = fs::path(folder).parent_path().string();
    return folder;
}

struct include_line {
    std::string place;  // FILE:LINE: text
    std::string name;   // as written between the quotes or brackets
};
std::vector<include_line> includes_of(const std::string& path) {
    std::vector<include_line> found;
    std::ifstream file(root + "/" + path);
    int number = 0;
    for (std::string line; std::getline(file, line);) {
        ++number;
        const std::size_t begin = line.find_first_of("\"<");
        if (line.rfind("#include", 0) != 0 || begin == std::string::npos) continue;
        found.push_back({path + ":" + std::to_string(number) + ": " + line,
                         line.substr(begin + 1, line.find_first_of("\">", begin + 1) - begin - 1)});
    }
    return found;
}

}  // namespace

TEST_CASE("every marked loop of the passes is vectorised for v3 and v4" *
          doctest::skip(!is_gcc())) {
    // a report names the file as it was included
    const std::string folder = "backend/cpu/";
    std::set<std::pair<std::string, int>> loops;
    for (const std::string file : {"passes.inl", "runge_kutta_passes.inl"})
        for (const int line : marked_loops(root + "/engine/" + folder + file))
            loops.insert({folder + file, line});
    REQUIRE(loops.size() >= 14);
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

TEST_CASE("limax.h is C") {
    CHECK(run("cc -std=c11 -Wall -Wextra -Werror -pedantic -fsyntax-only -x c " + root +
              "/engine/limax.h")
              .status == 0);
}

TEST_CASE("no CUDA library is linked") {
    const command_result needs = run("readelf -d " + fs::read_symlink("/proc/self/exe").string());
    CHECK(needs.output.find("[libc.so.6]") != std::string::npos);
    for (const char* library : {"libcuda", "libnvrtc", "libcudart"})
        CHECK(needs.output.find(library) == std::string::npos);
}

TEST_CASE("includes follow the order of the rooms and form no cycle") {
    const std::set<std::string> sources = {".h", ".cpp", ".inl"};
    std::map<std::string, std::vector<include_line>> includes;  // of each file, by its name
    for (const std::string folder : {"engine", "bindings/host"})
        for (const auto& entry : fs::recursive_directory_iterator(root + "/" + folder))
            if (sources.count(entry.path().extension().string()) == 1) {
                const std::string path = fs::relative(entry.path(), root).string();
                includes[name_of(path)] = includes_of(path);
            }
    REQUIRE(includes.size() > 100);
    for (const auto& [name, lines] : includes)
        for (const include_line& line : lines) {
            const std::string from = room_of(name), to = room_of(name_of(line.name, name));
            CAPTURE(line.place);
            CHECK((from == to || to.empty() || rooms.at(from).count(to) == 1));
        }
    std::set<std::string> finished, open;
    const std::function<void(const std::string&)> visit = [&](const std::string& name) {
        open.insert(name);
        for (const include_line& line : includes[name]) {
            const std::string next = name_of(line.name, name);
            CAPTURE(line.place);
            CHECK(open.count(next) == 0);
            if (open.count(next) + finished.count(next) == 0) visit(next);
        }
        open.erase(name);
        finished.insert(name);
    };
    for (const auto& [name, lines] : std::map(includes))
        if (finished.count(name) == 0) visit(name);
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
    const limax::test::scratch_folder folder;
    const std::string header = (folder.path / "magnet.h").string();
    std::ofstream(header)
        << example << "#include \"physics/effects/all.h\"\n"
        << "static_assert(limax::effects::hooks_match<limax::effects::magnet>());\n";
    const command_result result =
        run(compiler + flags + "-fsyntax-only -x c++ -include " + header + " /dev/null");
    CAPTURE(result.output);
    CHECK(result.status == 0);
}
