// host.cpp: the executable `limax`: a LuaJIT state with the module limax.host, which passes the
// command line to scripts/lib/main.lua and exits with the status that it returns.
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <string>
#include <system_error>

#include "globals.h"
#include "guard.h"
#include "images.h"
#include "json.h"
#include "limax_cdef.inc"
#include "modules.h"
#include "packages.h"
#include "parser_process.h"
#include "protect.h"
#include "sha256.h"
#include "signals.h"
#include "url.h"

namespace limax::host {
namespace {

constexpr int status_failed = 1;
constexpr int status_interrupted = 130;

struct command_line {
    int count;
    char** words;
    std::string executable;
    std::string home;
};

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
        _exit(status);
    }
    lua_close(L);
    // NOLINTNEXTLINE(concurrency-mt-unsafe): the other threads only wait
    std::exit(status);
}

int lua_exit(lua_State* L) {
    const int status = luaL_optint(L, 1, 0);
    luaL_argcheck(L, status >= 0 && status <= 255, 1, "an exit status is 0 to 255");
    leave(L, status);
}

int lua_sha256(lua_State* L) {
    std::size_t length = 0;
    const char* const text = luaL_checklstring(L, 1, &length);
    const std::string hex = sha256({text, length});
    lua_pushlstring(L, hex.data(), hex.size());
    return 1;
}

// Makes the table of `require "limax.host"`.
void open_host(lua_State* L, const command_line& line) {
    lua_getfield(L, LUA_REGISTRYINDEX, "_LOADED");
    lua_newtable(L);
    set_text(L, "home", line.home);
    set_text(L, "executable", line.executable);
    set_text(L, "version", LIMAX_VERSION);
    if (*LIMAX_COMMIT != '\0') set_text(L, "commit", LIMAX_COMMIT);
    set_text(L, "cdef", limax_cdef);
    add_function<lua_exit>(L, "exit");
    add_function<lua_sha256>(L, "sha256");
    open_signals(L);
    open_protect(L, line.home.c_str());
    open_json(L);
    open_http(L);
    open_url(L);
    open_xml(L);
    open_archives(L);
    open_files(L);
    open_images(L);
    open_machine(L);
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
    open_host(L, line);
    install_searchers(L, line.home);
    lock_globals(L);

    lua_getglobal(L, "require");
    lua_pushliteral(L, "limax.main");
    lua_call(L, 1, 1);
    lua_getfield(L, -1, "main");
    lua_createtable(L, line.count, 0);
    for (int i = 1; i < line.count; ++i) {
        lua_pushstring(L, line.words[i]);
        lua_rawseti(L, -2, i);
    }
    lua_call(L, 1, 1);
    return 1;
}

[[noreturn]] void run(int count, char** words) {
    // the parent may ignore it, and then a closed pipe would not end this process
    std::signal(SIGPIPE, SIG_DFL);
    command_line line{count, words, find_executable(), {}};
    line.home = find_home(line.executable);

    lua_State* const L = luaL_newstate();
    if (L == nullptr) throw std::runtime_error("cannot create the Lua state: out of memory");
    install_signals(L);
    lua_pushcfunction(L, guarded<start>);
    lua_pushlightuserdata(L, &line);
    if (protected_call(L, 1)) leave(L, static_cast<int>(lua_tointeger(L, -1)));

    push_interrupt(L);
    if (lua_rawequal(L, -1, -3) != 0) leave(L, status_interrupted);
    std::fprintf(stderr, "limax: %s\n", lua_tostring(L, -2));
    leave(L, status_failed);
}

}  // namespace
}  // namespace limax::host

int main(int count, char** words) {
    try {
        if (count == 2 && std::strcmp(words[1], limax::host::parser_process_argument) == 0)
            return limax::host::run_parser_process();
        limax::host::run(count, words);
    } catch (const std::exception& problem) {
        std::fprintf(stderr, "limax: %s\n", problem.what());
        return limax::host::status_failed;
    }
}
