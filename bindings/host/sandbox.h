// sandbox.h: a second Lua state for parsers of a language model's text. Includes Lua only.
#pragma once

#include <lua.hpp>

namespace limax::host {

// Adds sandbox to the host table on top of the stack.
void open_sandbox(lua_State* L);

}  // namespace limax::host
