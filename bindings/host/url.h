// url.h: a URL in its parts, as libcurl will read it when it is asked. Includes Lua and the
// standard library only.
#pragma once

#include <lua.hpp>
#include <string>

namespace limax::host {

struct url_parts {
    // empty where the URL has none; an IPv6 host stands in brackets
    std::string scheme, host, port, path, query, fragment;
    bool loopback;     // does it mean this machine?
    bool credentials;  // does a user or a password stand in it?
    // Scheme, host and port: what messages may show of a URL.
    std::string name() const { return scheme + "://" + host + (port.empty() ? "" : ":" + port); }
};

// Throws std::runtime_error where the text is no URL.
url_parts read_url(const std::string& text);

// Adds url to the host table on top of the stack.
void open_url(lua_State* L);

}  // namespace limax::host
