// protect.cpp: protected calls of the host and their tracebacks: Lua frames only, file and line
// first, without the files that only launch a script.
#include <string>

#include "guard.h"
#include "modules.h"
#include "signals.h"

namespace limax::host {
namespace {

// Most frames of a traceback: those next to the error.
constexpr int most_frames = 24;

std::string home;  // the home folder

// Whether the frame is between the command line and a script.
bool launches(const std::string& source) {
    for (const char* place :
         {"/bindings/host/", "/scripts/lib/main.lua", "/scripts/lib/base/script.lua",
          "/scripts/commands/repl.lua", "/scripts/lib/tools/repl/"})
        if (source.rfind("@" + home + place, 0) == 0) return true;
    return false;
}

std::string describe(const lua_Debug& frame) {
    const char* const file = *frame.source == '@' ? frame.source + 1 : frame.short_src;
    std::string line =
        "\n  " + std::string(file) + ":" + std::to_string(frame.currentline) + ": in ";
    if (*frame.what == 'm') return line + "main chunk";
    if (frame.name != nullptr) return line + "function '" + frame.name + "'";
    return line + "the function of line " + std::to_string(frame.linedefined);
}

// Lines of the Lua frames from `level` outwards, each after a line break.
std::string frames(lua_State* L, int level) {
    std::string text;
    int shown = 0;
    for (lua_Debug frame{}; lua_getstack(L, level, &frame) != 0; ++level) {
        lua_getinfo(L, "Sln", &frame);
        // C frames have no line
        if (*frame.what == 'C' || frame.currentline < 1 || launches(frame.source)) continue;
        if (++shown > most_frames) return text + "\n  ...";
        text += describe(frame);
    }
    return text;
}

// Pushes a printable text for the error at `index`: the string itself, its __tostring, or its type.
// May raise what __tostring raises.
void push_error_text(lua_State* L, int index) {
    if (luaL_callmeta(L, index, "__tostring") != 0) {
        if (lua_isstring(L, -1) != 0) return;
        lua_pop(L, 1);
    }
    if (lua_isstring(L, index) != 0)
        lua_pushvalue(L, index);
    else
        lua_pushfstring(L, "(an error that is a %s)", luaL_typename(L, index));
}

// The message handler: returns the error and its traceback as one table.
int wrap_error(lua_State* L) {
    lua_settop(L, 1);
    push_error_text(L, 1);
    const std::string text = lua_tostring(L, 2) + frames(L, 1);
    lua_createtable(L, 2, 0);
    lua_pushvalue(L, 1);
    lua_rawseti(L, -2, 1);
    push(L, text);
    lua_rawseti(L, -2, 2);
    return 1;
}

int protect(lua_State* L) {
    luaL_checktype(L, 1, LUA_TFUNCTION);
    const bool fine = protected_call(L, lua_gettop(L) - 1);
    lua_pushboolean(L, fine);
    lua_insert(L, 1);
    return lua_gettop(L);
}

}  // namespace

bool protected_call(lua_State* L, int arguments) {
    const int base = lua_gettop(L) - arguments;
    lua_pushcfunction(L, guarded<wrap_error>);
    lua_insert(L, base);
    const int status = lua_pcall(L, arguments, LUA_MULTRET, base);
    lua_remove(L, base);
    // an interrupt is the cause, whatever error or result it led to
    const bool stopped = interrupted();
    if (status == 0 && !stopped) return true;
    // the hook must be gone before any further Lua runs
    if (stopped) acknowledge_interrupt();

    if (status == LUA_ERRRUN && lua_istable(L, base)) {
        lua_rawgeti(L, base, 1);
        lua_rawgeti(L, base, 2);
        lua_remove(L, base);
    } else {
        // the handler did not finish, or there was no error
        if (status == 0) {
            lua_settop(L, base - 1);
            push_interrupt(L);
        }
        push_error_text(L, base);
    }
    if (status == LUA_ERRMEM) lua_gc(L, LUA_GCCOLLECT, 0);
    if (stopped) {
        push_interrupt(L);
        lua_replace(L, base);
    }
    return false;
}

void open_protect(lua_State* L, const std::string& folder) {
    home = folder;
    add_function<protect>(L, "protect");
}

}  // namespace limax::host
