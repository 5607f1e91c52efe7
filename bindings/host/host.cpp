// host.cpp: the executable `limax`: a LuaJIT state with the module limax.host, in which start.lua
// runs the command line. It exits with the status that start.lua returns.
#include <dlfcn.h>
#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <filesystem>
#include <string>
#include <system_error>
#include <thread>

#include "guard.h"
#include "json.h"
#include "limax_cdef.inc"
#include "modules.h"
#include "signals.h"

namespace limax::host {
namespace {

namespace fs = std::filesystem;

constexpr int status_failed = 1;

struct command_line {
    int count;
    char** words;
    fs::path executable;
    std::string home;
};

// Opens the standard descriptors that the parent closed on /dev/null. Else the first files that are
// opened would get their numbers, and progress text would be written into them.
void open_standard_descriptors() {
    for (int descriptor = 0; descriptor <= STDERR_FILENO; ++descriptor) {
        if (fcntl(descriptor, F_GETFD) >= 0) continue;
        // the lowest number that is free
        if (open("/dev/null", O_RDWR) != descriptor) _exit(status_failed);
    }
}

// The data folder, absolute: $LIMAX_HOME, else share/limax beside the executable's folder, else the
// source tree. Throws with the places that it searched.
std::string find_home(const fs::path& executable) {
    const auto has_scripts = [](const fs::path& folder) {
        std::error_code problem;
        return fs::is_regular_file(folder / "scripts" / "lib" / "main.lua", problem);
    };
    if (const char* const named = secure_getenv("LIMAX_HOME"); named != nullptr && *named != '\0') {
        if (has_scripts(named)) return fs::canonical(named).string();
        throw std::runtime_error("LIMAX_HOME is " + std::string(named) +
                                 ", which contains no scripts/lib/main.lua");
    }
    const fs::path beside = executable.parent_path().parent_path();
    std::string searched;
    for (const fs::path& place : {beside / "share" / "limax", fs::path(LIMAX_SOURCE_DIR), beside}) {
        if (has_scripts(place)) return fs::canonical(place).string();
        searched += "\n  " + place.string();
    }
    throw std::runtime_error(
        "limax's own scripts were not found; set LIMAX_HOME to the folder that contains scripts/. "
        "Searched:" +
        searched);
}

// Ends the process; with a failure if output was lost.
[[noreturn]] void leave(lua_State* L, int status) {
    release_signals();
    errno = 0;
    const bool lost = std::fflush(stdout) != 0 || std::ferror(stdout) != 0;
    if (lost && errno != EPIPE) {
        const std::string reason = std::generic_category().message(errno);
        std::fprintf(stderr, "limax: cannot write to the standard output: %s\n", reason.c_str());
        if (status == 0) status = status_failed;
    }
    settle_status(status);
    // freeing objects may wait, for a child process for example: not after Ctrl-C
    if (was_interrupted()) {
        std::fflush(nullptr);
        remove_temporaries();
        _exit(status);
    }
    lua_close(L);
    remove_temporaries();
    // NOLINTNEXTLINE(concurrency-mt-unsafe): the other threads only wait
    std::exit(status);
}

int lua_exit(lua_State* L) {
    const int status = luaL_optint(L, 1, 0);
    luaL_argcheck(L, status >= 0 && status <= 255, 1, "an exit status is 0 to 255");
    leave(L, status);
}

// Opens a library that is beside liblimax, for ffi.C.
int lua_open_library(lua_State* L) {
    if (dlopen(luaL_checkstring(L, 1), RTLD_NOW | RTLD_GLOBAL) != nullptr) return push(L, true);
    lua_pushnil(L);
    push(L, dlerror());
    return 2;
}

// Makes the table of `require "limax.host"`, to which start.lua adds the rest.
void open_host(lua_State* L, const command_line& line) {
    lua_getfield(L, LUA_REGISTRYINDEX, "_LOADED");
    lua_newtable(L);
    set(L, "home", line.home);
    set(L, "executable", line.executable.string());
    set(L, "version", LIMAX_VERSION);
    if (*LIMAX_COMMIT != '\0') set(L, "commit", LIMAX_COMMIT);
    set(L, "compiler", LIMAX_COMPILER);
    set(L, "build", LIMAX_BUILD_TYPE);
    set(L, "cuda_compiler", LIMAX_CUDA_COMPILER);
    set(L, "cdef", limax_cdef);
    // those that this process may use
    set(L, "cores", std::thread::hardware_concurrency());
    add_function<lua_exit>(L, "exit");
    add_function<lua_open_library>(L, "open_library");
    open_signals(L);
    open_protect(L, line.home);
    open_json(L);
    open_hashes(L);
    open_http(L);
    open_xml(L);
    open_archives(L);
    open_files(L);
    open_images(L);
    open_line_editor(L);
    open_sandbox(L);
    open_time_limit(L);
    lua_setfield(L, -2, "limax.host");
    lua_pop(L, 1);
}

// Runs inside the outermost protected call: takes a command_line, returns the exit status.
int start(lua_State* L) {
    const command_line& line = *static_cast<const command_line*>(lua_touserdata(L, 1));
    luaL_openlibs(L);
    replace_next(L);
    open_host(L, line);
    const std::string file = line.home + "/bindings/host/start.lua";
    if (luaL_loadfilex(L, file.c_str(), "t") != 0) return lua_error(L);
    luaL_checkstack(L, line.count, "too many arguments");
    for (int i = 1; i < line.count; ++i) lua_pushstring(L, line.words[i]);
    lua_call(L, line.count - 1, 1);
    return 1;
}

[[noreturn]] void run(int count, char** words) {
    // the parent may ignore it, and then a closed pipe would not end this process
    std::signal(SIGPIPE, SIG_DFL);
    // a limit on the size of files is then a failed write, with a message
    std::signal(SIGXFSZ, SIG_IGN);
    command_line line{count, words, fs::read_symlink("/proc/self/exe"), {}};
    line.home = find_home(line.executable);

    lua_State* const L = luaL_newstate();
    if (L == nullptr) throw std::runtime_error("cannot create the Lua state: out of memory");
    install_signals(L);
    lua_pushcfunction(L, guarded<start>);
    lua_pushlightuserdata(L, &line);
    if (protected_call(L, 1)) leave(L, static_cast<int>(lua_tointeger(L, -1)));

    push_interrupt(L);
    if (lua_rawequal(L, -1, -3) != 0) leave(L, interrupt_status());
    std::fprintf(stderr, "limax: %s\n", lua_tostring(L, -2));
    leave(L, status_failed);
}

}  // namespace
}  // namespace limax::host

int main(int count, char** words) {
    limax::host::open_standard_descriptors();
    try {
        if (count == 3 && std::strcmp(words[1], limax::host::parser_process_argument) == 0)
            return limax::host::run_parser_process(std::atof(words[2]));
        limax::host::run(count, words);
    } catch (const std::exception& problem) {
        std::fprintf(stderr, "limax: %s\n", problem.what());
        return limax::host::status_failed;
    }
}
