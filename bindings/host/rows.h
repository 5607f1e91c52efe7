// rows.h: a NumPy array of records as lines of JSON. Includes Lua and the standard library only.
#pragma once

#include <lua.hpp>
#include <string>
#include <string_view>

namespace limax::host {

// The lines of JSON that an array of records in a .npy file stands for: an object for each row, a
// field `a.b` as field `b` of the object `a`, and `a[1].b` as field `b` of the first entry of the
// list `a`. A field without a value is left out: NaN, -1 of a whole number, an empty text, and of
// a list the entries at its end that have none. Throws a `failure` for any other file. Any thread
// may call this function.
std::string lines_of_rows(std::string_view npy);

// Adds rows to the host table on top of the stack.
void open_rows(lua_State* L);

}  // namespace limax::host
