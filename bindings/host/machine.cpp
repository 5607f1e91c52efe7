// machine.cpp: the terminal, clocks and environment of this machine. None of it may affect results.
#include <dlfcn.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <fstream>
#include <string>
#include <thread>

#include "guard.h"
#include "modules.h"
#include "signals.h"

namespace limax::host {
namespace {

constexpr int usual_columns = 80;
constexpr double longest_wait = 86400;                     // s
constexpr std::chrono::duration<double> wait_slice{0.05};  // between checks for Ctrl-C

void set_truth(lua_State* L, const char* field, bool truth) {
    lua_pushboolean(L, truth);
    lua_setfield(L, -2, field);
}

bool is_set(const char* variable) {
    const char* const value = secure_getenv(variable);
    return value != nullptr && *value != '\0';
}

int columns() {
    for (const int descriptor : {STDOUT_FILENO, STDERR_FILENO}) {
        winsize size{};
        if (ioctl(descriptor, TIOCGWINSZ, &size) == 0 && size.ws_col > 0) return size.ws_col;
    }
    int count = 0;
    if (const char* const text = secure_getenv("COLUMNS"))
        std::from_chars(text, text + std::strlen(text), count);
    return count > 0 ? count : usual_columns;
}

// terminal() -> which streams are a terminal, its width, and whether to use colours
// (https://no-color.org)
int terminal(lua_State* L) {
    const char* const kind = secure_getenv("TERM");
    const bool plain = is_set("NO_COLOR") || kind == nullptr || std::strcmp(kind, "dumb") == 0;
    const bool out = isatty(STDOUT_FILENO) != 0;
    const bool err = isatty(STDERR_FILENO) != 0;
    lua_createtable(L, 0, 6);
    set_truth(L, "stdin", isatty(STDIN_FILENO) != 0);
    set_truth(L, "stdout", out);
    set_truth(L, "stderr", err);
    set_truth(L, "color", out && !plain);
    set_truth(L, "color_stderr", err && !plain);
    lua_pushinteger(L, columns());
    lua_setfield(L, -2, "columns");
    return 1;
}

// clock() -> seconds on a monotonic clock
int clock_seconds(lua_State* L) {
    timespec now{};
    clock_gettime(CLOCK_MONOTONIC, &now);
    lua_pushnumber(L, static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec));
    return 1;
}

// wait(seconds): sleeps; Ctrl-C ends it at once
int wait_seconds(lua_State* L) {
    const lua_Number seconds = luaL_checknumber(L, 1);
    luaL_argcheck(L, seconds >= 0 && seconds <= longest_wait, 1, "expected 0 to 86400 seconds");
    const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
    for (;;) {
        if (interrupted()) return raise_interrupt(L);
        const auto left = end - std::chrono::steady_clock::now();
        if (left.count() <= 0) return 0;
        // a signal may come between the check and the sleep: short sleeps
        std::this_thread::sleep_for(std::min<std::chrono::duration<double>>(left, wait_slice));
    }
}

// time() -> "2026-11-21T10:15:03Z"
int time_text(lua_State* L) {
    const std::time_t now = std::time(nullptr);
    std::tm parts{};
    gmtime_r(&now, &parts);
    char text[32];
    std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &parts);
    lua_pushstring(L, text);
    return 1;
}

// The value of the first line that starts with `key`, after the separator and without quotes; empty
// if there is none.
std::string file_entry(const char* file, const std::string& key, char separator) {
    std::ifstream lines(file);
    for (std::string line; std::getline(lines, line);) {
        if (line.compare(0, key.size(), key) != 0) continue;
        const std::size_t start = line.find_first_not_of(" \t\"", line.find(separator) + 1);
        if (start == std::string::npos) return {};
        return line.substr(start, line.find_last_not_of(" \t\"") - start + 1);
    }
    return {};
}

int usable_cores() {
    cpu_set_t set;
    return sched_getaffinity(0, sizeof set, &set) == 0 ? CPU_COUNT(&set) : 1;
}

// environment() -> { compiler, build, cpu, cores, hostname, system, luajit, cuda, cuda_compiler };
// cuda is the driver's version or nil, cuda_compiler the nvcc found by CMake or nil
int environment(lua_State* L) {
    utsname kernel{};
    uname(&kernel);
    const std::string system = file_entry("/etc/os-release", "PRETTY_NAME", '=');
    const std::string cpu = file_entry("/proc/cpuinfo", "model name", ':');
    const std::string driver = file_entry("/proc/driver/nvidia/version", "NVRM version", ':');
    lua_createtable(L, 0, 9);
    set_text(L, "compiler", LIMAX_COMPILER);
    set_text(L, "build", LIMAX_BUILD_TYPE);
    set_text(L, "cpu", cpu.empty() ? kernel.machine : cpu);
    set_text(L, "hostname", kernel.nodename);
    set_text(L, "system",
             (system.empty() ? "" : system + ", ") + kernel.sysname + " " + kernel.release);
    set_text(L, "luajit", LUAJIT_VERSION);
    if (!driver.empty()) set_text(L, "cuda", driver);
    if (*LIMAX_CUDA_COMPILER != '\0') set_text(L, "cuda_compiler", LIMAX_CUDA_COMPILER);
    lua_pushinteger(L, usable_cores());
    lua_setfield(L, -2, "cores");
    return 1;
}

// opens(library) -> true | nil, message: can this shared library be loaded?
int opens(lua_State* L) {
    void* const library = dlopen(path_argument(L, 1), RTLD_LAZY | RTLD_LOCAL);
    if (library == nullptr) {
        // NOLINTNEXTLINE(concurrency-mt-unsafe): glibc keeps the message per thread
        return push_failure(L, dlerror());
    }
    dlclose(library);
    lua_pushboolean(L, 1);
    return 1;
}

}  // namespace

void open_machine(lua_State* L) {
    add_function<terminal>(L, "terminal");
    add_function<clock_seconds>(L, "clock");
    add_function<wait_seconds>(L, "wait");
    add_function<time_text>(L, "time");
    add_function<environment>(L, "environment");
    add_function<opens>(L, "opens");
}

}  // namespace limax::host
