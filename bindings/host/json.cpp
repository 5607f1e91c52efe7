// json.cpp: host.json: encode, decode, null and the mark of an array.
#include "json.h"

#include "guard.h"

namespace limax::host {
namespace {

// Their addresses are keys of the registry.
const char null_key = 0;
const char array_key = 0;

constexpr int largest_indent = 16;

int null_text(lua_State* L) {
    lua_pushliteral(L, "null");
    return 1;
}

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
    const std::string text = encode_json(L, 1, indent);
    lua_pushlstring(L, text.data(), text.size());
    return 1;
}

// decode(text [, origin]) -> value | nil, message
int decode(lua_State* L) {
    std::size_t length = 0;
    const char* const text = luaL_checklstring(L, 1, &length);
    const char* const origin = luaL_optstring(L, 2, "JSON text");
    std::string problem;
    try {
        decode_json(L, {text, length}, origin);
        return 1;
    } catch (const std::runtime_error& error) {
        problem = error.what();
    }
    return push_failure(L, problem);
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
    lua_pushboolean(L, lua_istable(L, 1) && (is_json_array(L, 1) || lua_objlen(L, 1) > 0));
    return 1;
}

}  // namespace

void push_json_null(lua_State* L) {
    lua_pushlightuserdata(L, const_cast<char*>(&null_key));
    lua_rawget(L, LUA_REGISTRYINDEX);
}

void mark_json_array(lua_State* L, int index) {
    if (index < 0) index += lua_gettop(L) + 1;
    lua_pushlightuserdata(L, const_cast<char*>(&array_key));
    lua_rawget(L, LUA_REGISTRYINDEX);
    lua_setmetatable(L, index);
}

bool is_json_array(lua_State* L, int index) {
    if (lua_getmetatable(L, index) == 0) return false;
    lua_pushlightuserdata(L, const_cast<char*>(&array_key));
    lua_rawget(L, LUA_REGISTRYINDEX);
    const bool same = lua_rawequal(L, -1, -2) != 0;
    lua_pop(L, 2);
    return same;
}

void open_json(lua_State* L) {
    lua_pushlightuserdata(L, const_cast<char*>(&null_key));
    lua_newuserdata(L, 0);
    lua_newtable(L);
    add_function<null_text>(L, "__tostring");
    lua_setmetatable(L, -2);
    lua_rawset(L, LUA_REGISTRYINDEX);
    lua_pushlightuserdata(L, const_cast<char*>(&array_key));
    lua_newtable(L);
    lua_rawset(L, LUA_REGISTRYINDEX);

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
