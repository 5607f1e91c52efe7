// files.h: files that survive a kill at any moment. Includes Lua only.
#pragma once

#include <lua.hpp>

namespace limax::host {

// Adds file to the host table on top of the stack.
void open_files(lua_State* L);

}  // namespace limax::host
