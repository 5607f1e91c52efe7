// http.h: one HTTP request at a time, for language models. Includes Lua only.
#pragma once

#include <lua.hpp>

namespace limax::host {

// Adds http to the host table on top of the stack.
void open_http(lua_State* L);

}  // namespace limax::host
