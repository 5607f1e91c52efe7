// json.cpp: host.json: encode, decode, null and the mark of an array.
#include "json.h"

#include "guard.h"

namespace limax::host {
namespace {

// In the registry: the value of null, and the metatable of arrays.
const char* const null_key = "limax.json.null";
const char* const array_key = "limax.json.array";

constexpr int largest_indent = 16;

int null_text(lua_State* L) { return push(L, "null"); }

// encode(value [, { indent = spaces }]) -> text
int encode(lua_State* L) {
    luaL_checkany(L, 1);
    int indent = 0;
    if (!lua_isnoneornil(L, 2)) {
        luaL_checktype(L, 2, LUA_TTABLE);
        lua_getfield(L, 2, "indent");
        indent = luaL_optint(L, -1, 0);
        luaL_argcheck(L, indent >= 0 && indent <= largest_indent, 2, "indent must be 0 to 16");
    }
    return push(L, encode_json(L, 1, indent));
}

// decode(text [, origin])
int decode(lua_State* L) {
    decode_json(L, text_argument(L, 1), luaL_optstring(L, 2, "JSON text"));
    return 1;
}

int array(lua_State* L) {
    luaL_checktype(L, 1, LUA_TTABLE);
    if (lua_getmetatable(L, 1) != 0 && !is_json_array(L, 1))
        return luaL_argerror(L, 1, "a table with a metatable cannot be marked as an array");
    mark_json_array(L, 1);
    lua_settop(L, 1);
    return 1;
}

int is_array(lua_State* L) {
    return push(L, lua_istable(L, 1) && (is_json_array(L, 1) || lua_objlen(L, 1) > 0));
}

}  // namespace

void push_json_null(lua_State* L) { lua_getfield(L, LUA_REGISTRYINDEX, null_key); }

void mark_json_array(lua_State* L, int index) {
    lua_pushvalue(L, index);
    luaL_getmetatable(L, array_key);
    lua_setmetatable(L, -2);
    lua_pop(L, 1);
}

bool is_json_array(lua_State* L, int index) {
    if (lua_getmetatable(L, index) == 0) return false;
    luaL_getmetatable(L, array_key);
    const bool same = lua_rawequal(L, -1, -2) != 0;
    lua_pop(L, 2);
    return same;
}

void open_json(lua_State* L) {
    luaL_newmetatable(L, array_key);
    lua_newuserdata(L, 0);
    lua_newtable(L);
    add_function<null_text>(L, "__tostring");
    lua_setmetatable(L, -2);
    lua_setfield(L, LUA_REGISTRYINDEX, null_key);
    lua_pop(L, 1);

    lua_newtable(L);
    add_function<encode>(L, "encode");
    add_function<decode>(L, "decode");
    add_function<array>(L, "array");
    add_function<is_array>(L, "is_array");
    push_json_null(L);
    lua_setfield(L, -2, "null");
    lua_setfield(L, -2, "json");
}

}  // namespace limax::host
