// sandbox.h: runs a parser of a language model's text in a child process. Includes Lua only.
#pragma once

#include <lua.hpp>

namespace limax::host {

// The command line argument that makes this executable a parser's process.
constexpr char parser_process_argument[] = "--parser-process";

// The parser's process: reads a request as JSON from standard input, writes the answer as JSON to
// standard output. Returns the exit status.
int run_parser_process();

// Adds sandbox to the host table on top of the stack.
void open_sandbox(lua_State* L);

}  // namespace limax::host
