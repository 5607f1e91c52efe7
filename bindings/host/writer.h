// writer.h: files written behind a script's back, while it computes. Includes Lua only.
#pragma once

#include <lua.hpp>

namespace limax::host {

// Adds the function `writer` to the table on top of the stack.
void add_writer(lua_State* L);

}  // namespace limax::host
