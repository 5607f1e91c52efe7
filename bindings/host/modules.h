// modules.h: the parts of limax.host. Each open_ function adds its part to the host table on top of
// the stack; host.lua describes what they add. Includes Lua and the standard library only.
#pragma once

#include <lua.hpp>
#include <string>
#include <string_view>

namespace limax::host {

void open_archives(lua_State* L);
void open_files(lua_State* L);
void open_hashes(lua_State* L);
void open_http(lua_State* L);
void open_images(lua_State* L);
void open_line_editor(lua_State* L);
// Tracebacks leave out files below `home` that only launch a script.
void open_protect(lua_State* L, const std::string& home);
void open_sandbox(lua_State* L);
void open_time_limit(lua_State* L);
void open_xml(lua_State* L);

// A hash of 64 bits as 16 hexadecimal digits.
std::string hash_digits(std::uint64_t hash);

// The XXH3 hash of a text.
std::string xxh3(std::string_view text);

// A hash of an array that its parts add up to, whoever hashes them: the sum of the hashes of its
// rows, each seeded with the number of rows that follow it. What is before the rows counts as more
// of them, the first one shorter. `following`: rows after these.
std::uint64_t xxh3_sum(std::string_view text, std::size_t row, std::uint64_t following);

// Replaces the globals `next` and `pairs`.
void replace_next(lua_State* L);

// Removes the temporary folders of this process, at its end.
void remove_temporaries() noexcept;

// Adds the function `writer` to the table `file` on top of the stack.
void add_writer(lua_State* L);

// Calls the function below its `arguments`, as lua_pcall does, keeping all results.
// On failure (false) leaves two values: the error, and its text with the traceback.
// An interrupt ends here: the error is then the interrupt value, and hook and flags are cleared.
bool protected_call(lua_State* L, int arguments);

// The command line argument that makes this executable a parser's process, before its seconds.
constexpr char parser_process_argument[] = "--parser-process";
// The parser's process: reads a request as JSON from standard input, writes the answer as JSON to
// standard output. It is killed after so many seconds. Returns the exit status.
int run_parser_process(double seconds);

}  // namespace limax::host
