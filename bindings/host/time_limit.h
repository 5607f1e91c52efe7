// time_limit.h: calls of Lua functions that must come back. Includes Lua only.
#pragma once

#include <lua.hpp>

namespace limax::host {

// Adds within to the host table on top of the stack.
void open_time_limit(lua_State* L);

}  // namespace limax::host
