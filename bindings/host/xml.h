// xml.h: XML as Lua tables, for files of other programs. Includes Lua only.
#pragma once

#include <lua.hpp>

namespace limax::host {

// Adds xml to the host table on top of the stack.
void open_xml(lua_State* L);

}  // namespace limax::host
