// http.cpp: host.http: one HTTP request through libcurl, which Ctrl-C ends; and host.url. https to
// any host, with verified certificates; plain http to this machine, and elsewhere only where the
// request allows it; no redirects; the size of an answer is limited. No message contains a header
// or a field's value, which may be a key.
#include <arpa/inet.h>
#include <curl/curl.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>

#include "guard.h"
#include "modules.h"
#include "signals.h"

namespace limax::host {
namespace {

// bytes of all headers, interim answers included
constexpr std::size_t largest_headers = std::size_t{64} << 10;
constexpr std::size_t largest_answer = std::size_t{16} << 20;  // bytes of a body, unpacked

struct free_curl {
    void operator()(CURL* easy) const { curl_easy_cleanup(easy); }
    void operator()(curl_slist* list) const { curl_slist_free_all(list); }
    void operator()(CURLU* url) const { curl_url_cleanup(url); }
};

// ---- URLs ----

struct url_parts {
    std::map<std::string, std::string> parts;  // those that the URL has
    bool loopback;                             // is the host this machine?
    bool credentials;                          // does it contain a user or a password?
    // Scheme, host and port, for messages.
    std::string name() const {
        const auto port = parts.find("port");
        return parts.at("scheme") + "://" + parts.at("host") +
               (port == parts.end() ? "" : ":" + port->second);
    }
};

bool is_loopback(const std::string& name) {
    in_addr four{};
    if (inet_pton(AF_INET, name.c_str(), &four) == 1) return ntohl(four.s_addr) >> 24 == 127;
    // libcurl always resolves this name to the loopback addresses
    return name == "localhost" || name == "[::1]";
}

// The parts by libcurl's parser, so that the checked URL is the requested one.
url_parts read_url(const std::string& text) {
    const std::unique_ptr<CURLU, free_curl> url(curl_url());
    const CURLUcode code = curl_url_set(url.get(), CURLUPART_URL, text.c_str(), 0);
    if (code != CURLUE_OK)
        throw failure(std::string("not a valid URL: ") + curl_url_strerror(code));
    const std::pair<const char*, CURLUPart> names[] = {
        {"scheme", CURLUPART_SCHEME}, {"host", CURLUPART_HOST},
        {"port", CURLUPART_PORT},     {"path", CURLUPART_PATH},
        {"query", CURLUPART_QUERY},   {"fragment", CURLUPART_FRAGMENT},
        {"user", CURLUPART_USER},     {"password", CURLUPART_PASSWORD}};
    url_parts result;
    for (const auto& [name, part] : names) {
        char* value = nullptr;
        if (curl_url_get(url.get(), part, &value, 0) != CURLUE_OK) continue;
        if (*value != '\0') result.parts[name] = value;
        curl_free(value);
    }
    result.loopback = is_loopback(result.parts["host"]);
    result.credentials = result.parts.erase("user") + result.parts.erase("password") > 0;
    return result;
}

int url(lua_State* L) {
    const std::string_view text = text_argument(L, 1);
    if (text.find('\0') != text.npos) throw failure("a URL must not contain a zero byte");
    const url_parts url = read_url(text.data());
    lua_createtable(L, 0, 8);
    for (const auto& [name, value] : url.parts) set(L, name.c_str(), value);
    set(L, "loopback", url.loopback);
    set(L, "credentials", url.credentials);
    return 1;
}

// ---- a script's table as a request ----

struct http_request {
    std::string url;
    std::map<std::string, std::string> headers;
    std::optional<std::string> body;
    std::string ca_file;  // certificates to trust instead of the system's; empty: the system's
    double timeout, connect_timeout;  // s
    double largest;                   // bytes
    bool allow_insecure = false;
};

[[noreturn]] void refuse(const std::string& what) { throw std::runtime_error("http: " + what); }

// The string at `index`. A line break, which would begin another header, is refused.
std::string line_at(lua_State* L, int index, const std::string& name) {
    if (lua_type(L, index) != LUA_TSTRING)
        refuse(name + " must be a string, not a " + luaL_typename(L, index));
    const std::string_view text = text_at(L, index);
    if (text.find_first_of(std::string_view("\r\n\0", 3)) != text.npos)
        refuse(name + " must not contain a line break or a zero byte");
    return std::string(text);
}

// A field of the table at index 1, above 0.
double number_field(lua_State* L, const char* name, int most, int usual) {
    lua_getfield(L, 1, name);
    const double value = lua_isnil(L, -1) ? usual : lua_tonumber(L, -1);
    if (!(value > 0 && value <= most))
        refuse(std::string(name) + " must be a number above 0, at most " + std::to_string(most));
    return value;
}

http_request read_request(lua_State* L) {
    luaL_checktype(L, 1, LUA_TTABLE);
    http_request request;
    request.timeout = number_field(L, "timeout", 86400, 60);
    request.connect_timeout = number_field(L, "connect_timeout", 30, 30);
    request.largest = number_field(L, "largest", largest_answer, largest_answer);
    lua_getfield(L, 1, "allow_insecure");
    request.allow_insecure = lua_toboolean(L, -1) != 0;
    lua_getfield(L, 1, "url");
    request.url = line_at(L, -1, "url");
    lua_getfield(L, 1, "ca_file");
    if (!lua_isnil(L, -1)) request.ca_file = line_at(L, -1, "ca_file");
    lua_getfield(L, 1, "body");
    if (lua_type(L, -1) == LUA_TSTRING) request.body = text_at(L, -1);
    lua_getfield(L, 1, "headers");
    if (lua_isnil(L, -1)) return request;
    if (!lua_istable(L, -1)) refuse("headers must be a table");
    for (lua_pushnil(L); lua_next(L, -2) != 0; lua_pop(L, 1))
        request.headers[line_at(L, -2, "the name of a header")] =
            line_at(L, -1, "a header's value");
    return request;
}

// ---- the exchange ----

struct http_answer {
    std::string problem;       // empty if a whole answer came
    const char* kind = "url";  // of the problem: a value of `kind_of`, or a refused URL
    std::string curl;          // libcurl's message
    long status = 0;
    std::map<std::string, std::string> headers;  // names in lower case
    std::string body;
    std::size_t header_bytes = 0;  // so far
    std::size_t largest = largest_answer;
    bool over_size = false;
};

// Throws if requests to the URL are not allowed.
url_parts check_url(const http_request& request) {
    url_parts url = read_url(request.url);
    const std::string& scheme = url.parts["scheme"];
    const bool plain = scheme == "http" && (url.loopback || request.allow_insecure);
    if (scheme != "https" && !plain)
        throw failure("only https, or http to this machine, is allowed, not " + scheme + "://" +
                      url.parts["host"]);
    if (url.credentials) throw failure("a URL with credentials is not allowed: " + url.name());
    return url;
}

// libcurl's callbacks: a return value other than the number of bytes ends the transfer. No
// exception may leave them.

std::size_t take_body(char* bytes, std::size_t size, std::size_t count, void* to) noexcept {
    auto& answer = *static_cast<http_answer*>(to);
    try {
        // the part that fits is kept for the transcript
        const std::size_t room = answer.largest - answer.body.size();
        answer.over_size = size * count > room;
        answer.body.append(bytes, std::min(size * count, room));
    } catch (const std::exception&) {
        return 0;
    }
    return answer.over_size ? 0 : size * count;
}

std::size_t count_header(char*, std::size_t size, std::size_t count, void* to) noexcept {
    auto& answer = *static_cast<http_answer*>(to);
    answer.header_bytes += size * count;
    return answer.header_bytes > largest_headers ? 0 : size * count;
}

int stop_if_interrupted(void*, curl_off_t, curl_off_t, curl_off_t, curl_off_t) {
    return interrupted() ? 1 : 0;
}

template <typename value>
void set_option(CURL* easy, CURLoption option, value to) {
    const CURLcode code = curl_easy_setopt(easy, option, to);
    if (code != CURLE_OK)
        throw std::runtime_error(std::string("libcurl: ") + curl_easy_strerror(code));
}

// The kind of failure, as one word by which scripts decide about a retry. `begun`: was the
// connection established?
const char* kind_of(CURLcode code, const http_answer& answer, bool begun) {
    if (answer.over_size) return "size";
    if (answer.header_bytes > largest_headers) return "headers";
    if (code == CURLE_OPERATION_TIMEDOUT) return begun ? "timeout" : "connect_timeout";
    static const std::map<CURLcode, const char*> kinds = {
        {CURLE_COULDNT_RESOLVE_HOST, "resolve"},
        {CURLE_COULDNT_RESOLVE_PROXY, "resolve"},
        {CURLE_COULDNT_CONNECT, "connect"},
        {CURLE_PARTIAL_FILE, "partial"},
        {CURLE_SEND_ERROR, "reset"},
        {CURLE_RECV_ERROR, "reset"},
        {CURLE_GOT_NOTHING, "reset"},
        {CURLE_HTTP2, "reset"},
        {CURLE_HTTP2_STREAM, "reset"},
        {CURLE_SSL_CONNECT_ERROR, "tls"},
        {CURLE_PEER_FAILED_VERIFICATION, "certificate"},
        {CURLE_SSL_ISSUER_ERROR, "certificate"},
        {CURLE_SSL_CACERT_BADFILE, "certificate"},
        {CURLE_BAD_CONTENT_ENCODING, "encoding"}};
    const auto found = kinds.find(code);
    return found == kinds.end() ? "protocol" : found->second;
}

void describe_problem(http_answer& answer, CURLcode code, const http_request& request,
                      const url_parts& where, const char* detail, bool begun) {
    answer.kind = kind_of(code, answer, begun);
    answer.curl = *detail != '\0' ? detail : curl_easy_strerror(code);
    const std::string_view kind = answer.kind;
    const double to_connect = std::min(request.timeout, request.connect_timeout);
    char text[64] = " answered more than 64 KiB of headers";
    if (kind == "size")
        std::snprintf(text, sizeof text, " answered more than %g MiB", request.largest / 1048576);
    else if (kind == "timeout")
        std::snprintf(text, sizeof text, " did not answer within %.3g s", request.timeout);
    else if (kind == "connect_timeout")
        std::snprintf(text, sizeof text, " was not reached within %.3g s", to_connect);
    else if (kind != "headers")
        text[0] = '\0';
    answer.problem = where.name() + (text[0] != '\0' ? text : ": " + answer.curl);
}

long milliseconds(double seconds) { return static_cast<long>(std::ceil(seconds * 1000)); }

void set_request(CURL* easy, const http_request& request, const url_parts& where) {
    set_option(easy, CURLOPT_URL, request.url.c_str());
    set_option(easy, CURLOPT_PROTOCOLS_STR, "http,https");
    set_option(easy, CURLOPT_FOLLOWLOCATION, 0L);
    // on Ctrl-C, do not wait for a resolver's thread
    set_option(easy, CURLOPT_QUICK_EXIT, 1L);
    set_option(easy, CURLOPT_USERAGENT, "limax/" LIMAX_VERSION);
    set_option(easy, CURLOPT_ACCEPT_ENCODING, "");
    set_option(easy, CURLOPT_SSL_VERIFYPEER, 1L);
    set_option(easy, CURLOPT_SSL_VERIFYHOST, 2L);
    if (!request.ca_file.empty()) set_option(easy, CURLOPT_CAINFO, request.ca_file.c_str());
    set_option(easy, CURLOPT_TIMEOUT_MS, milliseconds(request.timeout));
    set_option(easy, CURLOPT_CONNECTTIMEOUT_MS,
               milliseconds(std::min(request.timeout, request.connect_timeout)));
    // a proxy may be another machine
    if (where.loopback) set_option(easy, CURLOPT_NOPROXY, "*");
    if (request.body) {
        set_option(easy, CURLOPT_POSTFIELDSIZE_LARGE,
                   static_cast<curl_off_t>(request.body->size()));
        set_option(easy, CURLOPT_POSTFIELDS, request.body->data());
    }
}

http_answer perform(const http_request& request, const url_parts& where) {
    static const CURLcode started = curl_global_init(CURL_GLOBAL_DEFAULT);
    const std::unique_ptr<CURL, free_curl> handle(curl_easy_init());
    if (started != CURLE_OK || !handle) throw std::runtime_error("libcurl cannot start");
    CURL* const easy = handle.get();
    http_answer answer;
    answer.largest = static_cast<std::size_t>(request.largest);
    char detail[CURL_ERROR_SIZE] = "";
    // send a long body without waiting for permission
    curl_slist* list = curl_slist_append(nullptr, "Expect:");
    const std::unique_ptr<curl_slist, free_curl> headers(list);  // lines are added behind the first
    for (const auto& [name, value] : request.headers)
        curl_slist_append(list, (value.empty() ? name + ";" : name + ": " + value).c_str());

    set_request(easy, request, where);
    set_option(easy, CURLOPT_ERRORBUFFER, detail);
    set_option(easy, CURLOPT_HTTPHEADER, list);
    set_option(easy, CURLOPT_WRITEFUNCTION, take_body);
    set_option(easy, CURLOPT_WRITEDATA, &answer);
    set_option(easy, CURLOPT_HEADERFUNCTION, count_header);
    set_option(easy, CURLOPT_HEADERDATA, &answer);
    set_option(easy, CURLOPT_NOPROGRESS, 0L);
    set_option(easy, CURLOPT_XFERINFOFUNCTION, stop_if_interrupted);

    const CURLcode result = curl_easy_perform(easy);
    curl_easy_getinfo(easy, CURLINFO_RESPONSE_CODE, &answer.status);
    for (curl_header* header = nullptr;
         (header = curl_easy_nextheader(easy, CURLH_HEADER, -1, header)) != nullptr;) {
        std::string name = header->name;
        for (char& letter : name)
            if (letter >= 'A' && letter <= 'Z') letter = static_cast<char>(letter | 0x20);
        std::string& kept = answer.headers[name];
        kept += (kept.empty() ? "" : ", ") + std::string(header->value);
    }
    if (result != CURLE_OK) {
        curl_off_t begun = 0;  // microseconds until the request could be sent; 0: never
        curl_easy_getinfo(easy, CURLINFO_PRETRANSFER_TIME_T, &begun);
        describe_problem(answer, result, request, where, detail, begun != 0);
    }
    return answer;
}

int http(lua_State* L) {
    const http_request request = read_request(L);
    http_answer answer;
    try {
        answer = perform(request, check_url(request));
    } catch (const failure& refused) {
        answer.problem = answer.curl = refused.what();
    }
    if (interrupted()) return raise_interrupt(L);
    if (!answer.problem.empty()) {
        lua_pushnil(L);
        push(L, answer.problem);
    }
    lua_createtable(L, 0, 5);
    set(L, "status", answer.status);  // 0 if no line of an answer came
    set(L, "body", answer.body);
    lua_createtable(L, 0, static_cast<int>(answer.headers.size()));
    for (const auto& [name, value] : answer.headers) set(L, name.c_str(), value);
    lua_setfield(L, -2, "headers");
    if (answer.problem.empty()) return 1;
    set(L, "kind", answer.kind);
    set(L, "curl", answer.curl);
    return 3;
}

}  // namespace

void open_http(lua_State* L) {
    add_function<http>(L, "http");
    add_function<url>(L, "url");
}

}  // namespace limax::host
