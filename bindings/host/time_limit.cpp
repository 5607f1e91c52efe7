// time_limit.cpp: host.within: a protected call that is stopped after so many seconds, or when it
// has added a GB to Lua's memory. Compiled loops check no hook, so the function runs without the
// compiler, and traces are flushed before. A single call into C or the engine is not interrupted.
#include <chrono>
#include <cstdio>
#include <string>

#include "guard.h"
#include "modules.h"
#include "signals.h"

namespace limax::host {
namespace {

using steady = std::chrono::steady_clock;

// Instructions between two checks: half a microsecond.
constexpr int instructions_between = 50;
// kB that it may add to Lua's memory.
constexpr int most_growth = 1 << 20;
constexpr double most_seconds = 1e6;

// The call that is timed; one at a time, on the thread that runs Lua.
struct limit {
    steady::time_point deadline;
    int memory_before = 0;  // kB
    bool out_of_memory = false;
    bool stopped = false;
    char place[256] = "";  // where it was stopped: "FILE:LINE"
};
limit* timed = nullptr;

// Raises in every further instruction, so that no pcall of the function can catch it.
void check(lua_State* L, lua_Debug* frame) {
    if (timed == nullptr) return;
    if (!timed->stopped) {
        timed->out_of_memory = lua_gc(L, LUA_GCCOUNT, 0) - timed->memory_before > most_growth;
        if (!timed->out_of_memory && steady::now() < timed->deadline) return;
        timed->stopped = true;
        if (lua_getinfo(L, "Sl", frame) != 0 && frame->currentline > 0)
            std::snprintf(timed->place, sizeof timed->place, " (at %s:%d)", frame->short_src,
                          frame->currentline);
        set_hook(L, check, LUA_MASKCALL | LUA_MASKRET | LUA_MASKCOUNT, 1);
    }
    luaL_error(L, "stopped");
}

// Calls what is above seconds and handler; returns the number of results: true and the call's own,
// or false and that of the handler.
int protected_results(lua_State* L) {
    const int status = lua_pcall(L, lua_gettop(L) - 3, LUA_MULTRET, 2);
    push(L, status == 0);
    lua_replace(L, 2);
    return lua_gettop(L) - 1;
}

int within(lua_State* L) {
    const double seconds = luaL_checknumber(L, 1);
    luaL_argcheck(L, seconds > 0 && seconds <= most_seconds, 1, "seconds above 0");
    luaL_checktype(L, 2, LUA_TFUNCTION);
    luaL_checkany(L, 3);
    // a nested call keeps the outer limit
    if (timed != nullptr) return protected_results(L);

    limit here;
    here.deadline = steady::now() + std::chrono::duration_cast<steady::duration>(
                                        std::chrono::duration<double>(seconds));
    here.memory_before = lua_gc(L, LUA_GCCOUNT, 0);
    timed = &here;
    luaJIT_setmode(L, 0, LUAJIT_MODE_ENGINE | LUAJIT_MODE_OFF);
    luaJIT_setmode(L, 0, LUAJIT_MODE_ENGINE | LUAJIT_MODE_FLUSH);
    set_hook(L, check, LUA_MASKCOUNT, instructions_between);
    const int results = protected_results(L);
    set_hook(L, nullptr, 0, 0);
    luaJIT_setmode(L, 0, LUAJIT_MODE_ENGINE | LUAJIT_MODE_ON);
    timed = nullptr;

    if (interrupted()) return raise_interrupt(L);
    if (!here.stopped) return results;
    push(L, false);
    if (here.out_of_memory)
        lua_pushfstring(L, "it took more than %d MB%s", most_growth >> 10, here.place);
    else
        lua_pushfstring(L, "it did not come back within %f s%s", seconds, here.place);
    return 2;
}

}  // namespace

void open_time_limit(lua_State* L) { add_function<within>(L, "within"); }

}  // namespace limax::host
