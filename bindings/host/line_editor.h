// line_editor.h: lines typed at a terminal, edited by libedit, with history and completion. Without
// libedit there is none, and scripts read plain lines. Includes Lua only.
#pragma once

#include <lua.hpp>

namespace limax::host {

// Adds line_editor to the host table on top of the stack.
void open_line_editor(lua_State* L);

}  // namespace limax::host
