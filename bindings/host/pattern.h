// pattern.h: Lua's patterns with a clock: find, match, gmatch and gsub that a limit can stop.
// Includes Lua only.
#pragma once

#include <lua.hpp>

namespace limax::host {

// Called every few thousand steps of a search; raises a Lua error to stop it.
using pattern_clock = void (*)(lua_State* L);

// Replaces find, match, gmatch and gsub of the string library on top of the stack.
void open_patterns(lua_State* L, pattern_clock clock);

}  // namespace limax::host
