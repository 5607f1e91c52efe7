// json.h: JSON text to Lua tables and back. Includes Lua and the standard library only.
#pragma once

#include <lua.hpp>
#include <string>
#include <string_view>

namespace limax::host {

// Deepest nesting that is read or written.
constexpr int json_nesting = 200;
// All whole numbers up to this one are doubles.
constexpr double json_largest_integer = 9007199254740992;  // 2^53

// Pushes host.json.null, the value of null.
void push_json_null(lua_State* L);
// Marks the table at `index` as an array, so that it is written as [] when it is empty.
void mark_json_array(lua_State* L, int index);
bool is_json_array(lua_State* L, int index);

// Offset of the first byte that is not UTF-8; npos if there is none.
std::size_t find_invalid_utf8(std::string_view text);

// Text of the value at `index`, keys sorted by bytes. `indent` 0 writes one line. Throws with the
// place in the value.
std::string encode_json(lua_State* L, int index, int indent);
// Pushes the value of `text`, or throws with origin, line and column and leaves the stack
// unchanged.
void decode_json(lua_State* L, std::string_view text, const std::string& origin);

// Adds json to the host table on top of the stack.
void open_json(lua_State* L);

}  // namespace limax::host
