// globals.h: the global table of scripts. Includes Lua only.
#pragma once

#include <lua.hpp>

namespace limax::host {

// Replaces the standard functions that would make runs irreproducible or skip clean-up, and makes
// reading or writing an undefined global an error. Call after the libraries and the host table are
// loaded.
void lock_globals(lua_State* L);

}  // namespace limax::host
