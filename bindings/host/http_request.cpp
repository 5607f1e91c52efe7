// http_request.cpp: reads a script's table as an HTTP request. No message contains a value, which
// may be a key.
#include "http_request.h"

#include <cstdio>
#include <stdexcept>

namespace limax::host {
namespace {

std::string text_field(lua_State* L, const char* name) {
    if (lua_type(L, -1) != LUA_TSTRING)
        throw std::runtime_error(std::string("http: ") + name + " must be a string, not a " +
                                 luaL_typename(L, -1));
    std::size_t length = 0;
    const char* const text = lua_tolstring(L, -1, &length);
    return {text, length};
}

// Refuses line breaks, which would begin another header.
std::string line_field(lua_State* L, const char* name) {
    std::string text = text_field(L, name);
    if (text.find_first_of(std::string("\r\n\0", 3)) != std::string::npos)
        throw std::runtime_error(std::string("http: ") + name +
                                 " must not contain a line break or a zero byte");
    return text;
}

double seconds_field(lua_State* L, const char* name, double most) {
    const double value = lua_type(L, -1) == LUA_TNUMBER ? lua_tonumber(L, -1) : 0;
    if (value > 0 && value <= most) return value;
    char text[96];
    std::snprintf(text, sizeof text, "http: %s must be a number of seconds above 0, at most %.0f",
                  name, most);
    throw std::runtime_error(text);
}

}  // namespace

http_request read_http_request(lua_State* L) {
    luaL_checktype(L, 1, LUA_TTABLE);
    http_request request;
    for (lua_pushnil(L); lua_next(L, 1) != 0; lua_pop(L, 1)) {
        const std::string field =
            lua_type(L, -2) == LUA_TSTRING ? lua_tostring(L, -2) : luaL_typename(L, -2);
        if (field == "url") {
            request.url = line_field(L, "url");
        } else if (field == "method") {
            request.method = line_field(L, "method");
        } else if (field == "body") {
            request.body = text_field(L, "body");
        } else if (field == "timeout") {
            request.timeout = seconds_field(L, "timeout", longest_timeout);
        } else if (field == "connect_timeout") {
            request.connect_timeout = seconds_field(L, "connect_timeout", longest_connect);
        } else if (field == "largest") {
            const double value = lua_type(L, -1) == LUA_TNUMBER ? lua_tonumber(L, -1) : 0;
            if (!(value >= 1 && value <= static_cast<double>(largest_answer)))
                throw std::runtime_error("http: largest must be a number of bytes, 1 to 16777216");
            request.largest = static_cast<std::size_t>(value);
        } else if (field == "allow_insecure") {
            if (!lua_isboolean(L, -1))
                throw std::runtime_error("http: allow_insecure must be true or false");
            request.allow_insecure = lua_toboolean(L, -1) != 0;
        } else if (field == "ca_file") {
            request.ca_file = line_field(L, "ca_file");
        } else if (field == "headers") {
            if (!lua_istable(L, -1)) throw std::runtime_error("http: headers must be a table");
            for (lua_pushnil(L); lua_next(L, -2) != 0; lua_pop(L, 1)) {
                lua_pushvalue(L, -2);
                const std::string name = line_field(L, "the name of a header");
                lua_pop(L, 1);
                request.headers[name] = line_field(L, "a header's value");
            }
        } else {
            throw std::runtime_error("http: unknown field '" + field +
                                     "'; known are: allow_insecure, body, ca_file, "
                                     "connect_timeout, headers, largest, method, timeout, url");
        }
    }
    if (request.url.empty()) throw std::runtime_error("http: the field url is missing");
    if (request.method.empty()) request.method = request.body ? "POST" : "GET";
    return request;
}

}  // namespace limax::host
