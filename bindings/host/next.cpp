// next.cpp: `next` and `pairs` that LuaJIT does not compile. The compiled form of LuaJIT's own may
// swap two registers by their lower 32 bits (2.1.0-beta3 of 2022, as in Debian 12; function
// ra_destpair of its lj_asm.c): a loop then ends in a segmentation fault, in one process and not in
// the next.
#include "modules.h"

namespace limax::host {
namespace {

int next(lua_State* L) {
    luaL_checktype(L, 1, LUA_TTABLE);
    lua_settop(L, 2);
    if (lua_next(L, 1) != 0) return 2;
    lua_pushnil(L);
    return 1;
}

// Upvalues: LuaJIT's pairs, which calls `__pairs` of cdata only, and the next above.
int pairs(lua_State* L) {
    const bool is_table = lua_istable(L, 1);
    if (is_table && luaL_getmetafield(L, 1, "__pairs") == 0) {
        lua_pushvalue(L, lua_upvalueindex(2));
        lua_pushvalue(L, 1);
        lua_pushnil(L);
        return 3;
    }
    if (!is_table) lua_pushvalue(L, lua_upvalueindex(1));
    lua_pushvalue(L, 1);
    lua_call(L, 1, 3);
    return 3;
}

}  // namespace

void replace_next(lua_State* L) {
    lua_getglobal(L, "pairs");
    lua_pushcfunction(L, next);
    lua_pushvalue(L, -1);
    lua_setglobal(L, "next");
    lua_pushcclosure(L, pairs, 2);
    lua_setglobal(L, "pairs");
}

}  // namespace limax::host
