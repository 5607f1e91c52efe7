// machine.h: what scripts may know of the machine: terminal, clocks, environment. Includes Lua
// only.
#pragma once

#include <lua.hpp>

namespace limax::host {

// Adds terminal, clock, time, environment and opens to the host table on top of the stack.
void open_machine(lua_State* L);

}  // namespace limax::host
