// url.cpp: the parts of a URL, by libcurl's parser, so that the checked URL is the requested one.
#include "url.h"

#include <arpa/inet.h>
#include <curl/curl.h>

#include <memory>
#include <stdexcept>
#include <utility>

#include "guard.h"

namespace limax::host {
namespace {

struct free_url {
    void operator()(CURLU* url) const { curl_url_cleanup(url); }
    void operator()(char* text) const { curl_free(text); }
};

std::string url_part(CURLU* url, CURLUPart part) {
    char* text = nullptr;
    if (curl_url_get(url, part, &text, 0) != CURLUE_OK) return {};
    const std::unique_ptr<char, free_url> owner(text);
    return text;
}

bool is_loopback(const std::string& name) {
    in_addr four{};
    if (inet_pton(AF_INET, name.c_str(), &four) == 1) return ntohl(four.s_addr) >> 24 == 127;
    // libcurl always resolves this name to the loopback addresses
    return name == "localhost" || name == "[::1]";
}

// url(text) -> { scheme, host, port, path, query, fragment, loopback, credentials } | nil, message;
// missing parts are absent
int url(lua_State* L) {
    std::size_t length = 0;
    const char* const text = luaL_checklstring(L, 1, &length);
    std::string problem;
    if (std::string::traits_type::length(text) != length)
        problem = "a URL must not contain a zero byte";
    if (problem.empty()) {
        try {
            const url_parts parts = read_url(text);
            lua_createtable(L, 0, 8);
            const std::pair<const char*, const std::string*> fields[] = {
                {"scheme", &parts.scheme}, {"host", &parts.host},   {"port", &parts.port},
                {"path", &parts.path},     {"query", &parts.query}, {"fragment", &parts.fragment}};
            for (const auto& [name, value] : fields) {
                if (!value->empty()) {
                    lua_pushlstring(L, value->data(), value->size());
                    lua_setfield(L, -2, name);
                }
            }
            lua_pushboolean(L, parts.loopback);
            lua_setfield(L, -2, "loopback");
            lua_pushboolean(L, parts.credentials);
            lua_setfield(L, -2, "credentials");
            return 1;
        } catch (const std::runtime_error& error) {
            problem = error.what();
        }
    }
    return push_failure(L, problem);
}

}  // namespace

url_parts read_url(const std::string& text) {
    const std::unique_ptr<CURLU, free_url> url(curl_url());
    if (!url) throw std::runtime_error("libcurl is out of memory");
    const CURLUcode code = curl_url_set(url.get(), CURLUPART_URL, text.c_str(), 0);
    if (code != CURLUE_OK)
        throw std::runtime_error(std::string("not a valid URL: ") + curl_url_strerror(code));
    url_parts parts;
    parts.scheme = url_part(url.get(), CURLUPART_SCHEME);
    parts.host = url_part(url.get(), CURLUPART_HOST);
    parts.port = url_part(url.get(), CURLUPART_PORT);
    parts.path = url_part(url.get(), CURLUPART_PATH);
    parts.query = url_part(url.get(), CURLUPART_QUERY);
    parts.fragment = url_part(url.get(), CURLUPART_FRAGMENT);
    parts.loopback = is_loopback(parts.host);
    parts.credentials = !url_part(url.get(), CURLUPART_USER).empty() ||
                        !url_part(url.get(), CURLUPART_PASSWORD).empty();
    return parts;
}

void open_url(lua_State* L) { add_function<url>(L, "url"); }

}  // namespace limax::host
