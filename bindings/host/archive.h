// archive.h: ZIP archives in memory, for .npz and .3mf. Includes Lua only.
#pragma once

#include <lua.hpp>

namespace limax::host {

// Adds zip to the host table on top of the stack.
void open_archives(lua_State* L);

}  // namespace limax::host
