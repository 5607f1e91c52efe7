// modules.h: the parts of limax.host. Each function adds its part to the host table on top of the
// stack. Includes Lua only.
#pragma once

#include <lua.hpp>

namespace limax::host {

// file: files that survive a kill at any moment
void open_files(lua_State* L);
// http: one HTTP request at a time
void open_http(lua_State* L);
// line_editor: lines typed at a terminal, edited by libedit; absent where built without libedit
void open_line_editor(lua_State* L);
// terminal, clock, wait, time, environment, opens
void open_machine(lua_State* L);
// within: a call with a limit on time and memory
void open_time_limit(lua_State* L);
// sandbox: a parser of a language model's text in a child process
void open_sandbox(lua_State* L);
// xml: XML as Lua tables, for files of other programs
void open_xml(lua_State* L);
// zip: ZIP archives in memory, for .npz and .3mf
void open_archives(lua_State* L);

// Adds the function `writer` to the table `file` on top of the stack.
void add_writer(lua_State* L);

}  // namespace limax::host
