// packages.h: where limax's own files are and how `require` finds them. Includes Lua and the
// standard library only.
#pragma once

#include <lua.hpp>
#include <string>

namespace limax::host {

// Path of the running executable.
std::string find_executable();
// The data folder, absolute: $LIMAX_HOME, else share/limax beside the executable's folder, else the
// source tree. Throws with the places that it searched.
std::string find_home(const std::string& executable);

// Makes `require` look for limax's modules under `home` and for Lua files along package.path, which
// is empty at first; compiled modules are not searched for.
void install_searchers(lua_State* L, const std::string& home);

}  // namespace limax::host
