// protect.h: protected calls of the host and their tracebacks. Includes Lua only.
#pragma once

#include <lua.hpp>

namespace limax::host {

// Calls the function below its `arguments`, as lua_pcall does, keeping all results.
// On failure (false) leaves two values: the error, and its text with the traceback.
// An interrupt ends here: the error is then the interrupt value, and hook and flags are cleared.
bool protected_call(lua_State* L, int arguments);

// Pushes a printable text for the error at `index`: the string itself, its __tostring, or its type.
// May raise what __tostring raises.
void push_error_text(lua_State* L, int index);

// Adds protect to the host table on top of the stack. Tracebacks leave out files below `home` that
// only launch a script.
void open_protect(lua_State* L, const char* home);

}  // namespace limax::host
