// globals.cpp: the global table of scripts. A misspelt name raises an error; the process-wide
// random generator and the locale are not available, because results must not depend on them.
#include "globals.h"

#include "guard.h"

namespace limax::host {
namespace {

// The name of a global for messages; a key need not be a string.
const char* name_of(lua_State* L, int index) {
    return lua_type(L, index) == LUA_TSTRING ? lua_tostring(L, index) : luaL_typename(L, index);
}

int read_undefined(lua_State* L) {
    const char* const name = name_of(L, 2);
    return luaL_error(L,
                      "undefined name '%s': write local %s, or require the module that defines it",
                      name, name);
}

int write_undefined(lua_State* L) {
    const char* const name = name_of(L, 2);
    return luaL_error(L, "assignment to the undefined name '%s': write local %s", name, name);
}

int refuse_random(lua_State* L) {
    return luaL_error(L,
                      "math.random would make runs irreproducible: use the `random` argument of "
                      "selection and supervisor functions");
}

int refuse_locale(lua_State* L) {
    if (lua_isnoneornil(L, 1)) {
        lua_pushliteral(L, "C");
        return 1;
    }
    return luaL_error(
        L, "os.setlocale would change how numbers are read and written: the locale stays \"C\"");
}

// os.exit(true | false | status) through host.exit, which is the upvalue: output is flushed,
// objects are freed.
int leave(lua_State* L) {
    int status = 0;
    if (lua_isboolean(L, 1))
        status = lua_toboolean(L, 1) != 0 ? 0 : 1;
    else
        status = luaL_optint(L, 1, 0);
    lua_pushvalue(L, lua_upvalueindex(1));
    lua_pushinteger(L, status);
    lua_call(L, 1, 0);
    return 0;
}

}  // namespace

void lock_globals(lua_State* L) {
    lua_getglobal(L, "math");
    add_function<refuse_random>(L, "random");
    add_function<refuse_random>(L, "randomseed");
    lua_getglobal(L, "os");
    add_function<refuse_locale>(L, "setlocale");
    lua_getfield(L, LUA_REGISTRYINDEX, "_LOADED");
    lua_getfield(L, -1, "limax.host");
    lua_getfield(L, -1, "exit");
    lua_pushcclosure(L, guarded<leave>, 1);
    lua_setfield(L, -4, "exit");
    lua_pop(L, 4);

    lua_newtable(L);
    add_function<read_undefined>(L, "__index");
    add_function<write_undefined>(L, "__newindex");
    lua_setmetatable(L, LUA_GLOBALSINDEX);
}

}  // namespace limax::host
