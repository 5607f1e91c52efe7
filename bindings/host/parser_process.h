// parser_process.h: the process of a parser of a language model's text. modules.h has the other
// side.
#pragma once

namespace limax::host {

// The command line argument that makes this executable a parser's process.
constexpr char parser_process_argument[] = "--parser-process";

// The parser's process: reads a request as JSON from standard input, writes the answer as JSON to
// standard output. Returns the exit status.
int run_parser_process();

}  // namespace limax::host
