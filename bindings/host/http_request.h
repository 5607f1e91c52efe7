// http_request.h: a script's HTTP request, checked. Includes Lua and the standard library only.
// Times in seconds, sizes in bytes.
#pragma once

#include <cstddef>
#include <lua.hpp>
#include <map>
#include <optional>
#include <string>

namespace limax::host {

inline constexpr std::size_t largest_answer = 16u << 20;  // bytes of a body, unpacked
inline constexpr double default_timeout = 60;             // s
inline constexpr double longest_timeout = 86400;          // s
inline constexpr double longest_connect = 30;             // s

struct http_request {
    std::string url;
    std::string method;
    std::map<std::string, std::string> headers;
    std::optional<std::string> body;
    std::string ca_file;  // certificates to trust instead of the system's; empty: the system's
    double timeout = default_timeout;
    double connect_timeout = longest_connect;
    std::size_t largest = largest_answer;
    bool allow_insecure = false;
};

// Reads the table that is a function's first argument. Throws std::runtime_error with the field and
// its legal values.
http_request read_http_request(lua_State* L);

}  // namespace limax::host
