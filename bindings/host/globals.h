// globals.h: what scripts find in the global table, and what they may not do with it. Includes Lua
// only.
#pragma once

#include <lua.hpp>

namespace limax::host {

// Replaces the standard functions that would make runs irrepeatable or skip clean-up, then locks
// the global table: reading or writing an undefined global raises. Call after the libraries are
// open and the host table is loaded.
void lock_globals(lua_State* L);

}  // namespace limax::host
