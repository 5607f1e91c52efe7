// url.h: the parts of a URL as libcurl reads it. Includes Lua and the standard library only.
#pragma once

#include <lua.hpp>
#include <string>

namespace limax::host {

struct url_parts {
    // empty where the URL has none; an IPv6 host is in brackets
    std::string scheme, host, port, path, query, fragment;
    bool loopback;     // is the host this machine?
    bool credentials;  // does it contain a user or a password?
    // Scheme, host and port, for messages.
    std::string name() const { return scheme + "://" + host + (port.empty() ? "" : ":" + port); }
};

// Throws std::runtime_error if the text is no URL.
url_parts read_url(const std::string& text);

// Adds url to the host table on top of the stack.
void open_url(lua_State* L);

}  // namespace limax::host
