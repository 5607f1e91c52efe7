// guard.h: the wall between C++ exceptions and Lua errors, and the texts that cross it. Every
// function that Lua can call is `guarded<body>`. Includes Lua and the standard library only.
#pragma once

#include <cstdio>
#include <exception>
#include <lua.hpp>
#include <stdexcept>
#include <string>
#include <string_view>

namespace limax::host {

// Longest message that crosses the wall, bytes; a longer one is cut.
constexpr std::size_t longest_message = 4096;

// A lua_CFunction whose C++ exceptions become Lua errors at the caller's line. Lua errors pass
// through untouched: LuaJIT unwinds them as foreign exceptions, which run destructors and which
// `catch (...)` would swallow.
template <lua_CFunction body>
int guarded(lua_State* L) {
    char message[longest_message];
    try {
        return body(L);
    } catch (const std::exception& problem) {
        std::snprintf(message, sizeof message, "%s", problem.what());
    }
    // outside the catch block: raised inside, the jump would skip the end of the exception's life
    return luaL_error(L, "%s", message);
}

// Adds `guarded<body>` as field `name` to the table on top of the stack.
template <lua_CFunction body>
void add_function(lua_State* L, const char* name) {
    lua_pushcfunction(L, guarded<body>);
    lua_setfield(L, -2, name);
}

// Pushes what a script can live with: nil and a message. The body returns this count.
inline int push_failure(lua_State* L, const std::string& message) {
    lua_pushnil(L);
    lua_pushlstring(L, message.data(), message.size());
    return 2;
}

// A string argument, which the stack keeps alive.
inline std::string_view text_argument(lua_State* L, int index) {
    std::size_t length = 0;
    const char* const text = luaL_checklstring(L, index, &length);
    return {text, length};
}

// Sets a field of the table on top of the stack.
inline void set_text(lua_State* L, const char* field, std::string_view text) {
    lua_pushlstring(L, text.data(), text.size());
    lua_setfield(L, -2, field);
}

// A string argument that goes to the system: refuses one with a zero byte, which would be cut
// there.
inline const char* path_argument(lua_State* L, int index) {
    std::size_t length = 0;
    const char* path = luaL_checklstring(L, index, &length);
    luaL_argcheck(L, length > 0, index, "a path must not be empty");
    luaL_argcheck(L, std::string::traits_type::length(path) == length, index,
                  "a path must not hold a zero byte");
    return path;
}

}  // namespace limax::host
