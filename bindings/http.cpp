// http.cpp: one HTTP request at a time through libcurl's multi interface, in short waits so that
// Ctrl-C ends it. https to anywhere, plain http to this machine only; no redirects; answers are
// capped. No header is ever repeated in a message: it may hold a key.
#include "http.h"

#include <arpa/inet.h>
#include <curl/curl.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>

#include "guard.h"
#include "signals.h"

namespace limax::host {
namespace {

constexpr std::size_t largest_answer = 16u << 20;  // bytes of body and headers together
constexpr int wait_slice = 50;                     // ms between looks at the interrupt
constexpr double default_timeout = 60;             // s
constexpr double longest_timeout = 86400;          // s
constexpr double longest_connect = 30;             // s

struct http_request {
    std::string url;
    std::string method;
    std::map<std::string, std::string> headers;
    std::optional<std::string> body;
    double timeout = default_timeout;
};

struct http_answer {
    bool interrupted = false;
    std::string problem;  // empty when an answer came
    long status = 0;
    std::map<std::string, std::string> headers;  // names in lower case
    std::string body;
    std::size_t received = 0;  // bytes so far
};

struct free_curl {
    void operator()(curl_slist* list) const { curl_slist_free_all(list); }
    void operator()(CURLU* url) const { curl_url_cleanup(url); }
    void operator()(char* text) const { curl_free(text); }
};

// A multi handle with at most one transfer, taken out before either is freed.
class transfer {
public:
    transfer() : multi_(curl_multi_init()), easy_(curl_easy_init()) {
        if (multi_ == nullptr || easy_ == nullptr) {
            end();
            throw std::runtime_error("libcurl cannot start");
        }
    }
    ~transfer() { end(); }
    transfer(const transfer&) = delete;
    transfer& operator=(const transfer&) = delete;

    CURLM* multi() { return multi_; }
    CURL* easy() { return easy_; }

private:
    void end() {
        if (multi_ != nullptr && easy_ != nullptr) curl_multi_remove_handle(multi_, easy_);
        curl_easy_cleanup(easy_);
        curl_multi_cleanup(multi_);
    }

    CURLM* multi_;
    CURL* easy_;
};

// A write to a socket that the other side closed must be an error here, though it ends the process
// elsewhere.
class without_sigpipe {
public:
    without_sigpipe() {
        struct sigaction ignore {};
        ignore.sa_handler = SIG_IGN;
        sigaction(SIGPIPE, &ignore, &before_);
    }
    ~without_sigpipe() { sigaction(SIGPIPE, &before_, nullptr); }
    without_sigpipe(const without_sigpipe&) = delete;
    without_sigpipe& operator=(const without_sigpipe&) = delete;

private:
    struct sigaction before_ {};
};

std::string url_part(CURLU* url, CURLUPart part) {
    char* text = nullptr;
    if (curl_url_get(url, part, &text, 0) != CURLUE_OK) return {};
    const std::unique_ptr<char, free_curl> owner(text);
    return text;
}

bool is_loopback(const std::string& name) {
    in_addr four{};
    if (inet_pton(AF_INET, name.c_str(), &four) == 1) return ntohl(four.s_addr) >> 24 == 127;
    // libcurl itself resolves this name to the loopback addresses, whatever the system says
    return name == "localhost" || name == "[::1]";
}

struct target {
    bool loopback;
    std::string name;  // scheme, host and port: what messages may show of a URL
};

// Throws where the URL is none, or where it may not be asked.
target check_url(const std::string& text) {
    const std::unique_ptr<CURLU, free_curl> url(curl_url());
    if (!url) throw std::runtime_error("libcurl is out of memory");
    const CURLUcode code = curl_url_set(url.get(), CURLUPART_URL, text.c_str(), 0);
    if (code != CURLUE_OK)
        throw std::runtime_error(std::string("not a URL that can be asked: ") +
                                 curl_url_strerror(code));
    const std::string scheme = url_part(url.get(), CURLUPART_SCHEME);
    const std::string host = url_part(url.get(), CURLUPART_HOST);
    const std::string port = url_part(url.get(), CURLUPART_PORT);
    const bool loopback = is_loopback(host);
    if (scheme != "https" && !(scheme == "http" && loopback))
        throw std::runtime_error("only https, or http to this machine, may be asked, not " +
                                 scheme + "://" + host);
    return {loopback, scheme + "://" + host + (port.empty() ? "" : ":" + port)};
}

// libcurl's callbacks: a return value other than the number of bytes ends the transfer. No
// exception may leave them.

bool take(http_answer& answer, std::size_t bytes) noexcept {
    answer.received += bytes;
    return answer.received <= largest_answer;
}

std::size_t take_body(char* bytes, std::size_t size, std::size_t count, void* to) noexcept {
    auto& answer = *static_cast<http_answer*>(to);
    if (!take(answer, size * count)) return 0;
    try {
        answer.body.append(bytes, size * count);
    } catch (const std::exception&) {
        return 0;
    }
    return size * count;
}

std::size_t take_header(char* bytes, std::size_t size, std::size_t count, void* to) noexcept {
    auto& answer = *static_cast<http_answer*>(to);
    if (!take(answer, size * count)) return 0;
    try {
        const std::string line(bytes, size * count);
        const std::size_t colon = line.find(':');
        if (line.compare(0, 5, "HTTP/") == 0) {
            // the headers of an interim answer (100, 103) are not the answer's
            answer.headers.clear();
        } else if (colon != std::string::npos) {
            std::string name = line.substr(0, colon);
            for (char& letter : name)
                if (letter >= 'A' && letter <= 'Z') letter = static_cast<char>(letter - 'A' + 'a');
            const std::size_t from = line.find_first_not_of(" \t", colon + 1);
            const std::size_t to_last = line.find_last_not_of(" \t\r\n");
            const std::string value = from > to_last ? "" : line.substr(from, to_last - from + 1);
            std::string& kept = answer.headers[name];
            kept += (kept.empty() ? "" : ", ") + value;
        }
    } catch (const std::exception&) {
        return 0;
    }
    return size * count;
}

template <typename value>
void set(CURL* easy, CURLoption option, value to) {
    const CURLcode code = curl_easy_setopt(easy, option, to);
    if (code != CURLE_OK)
        throw std::runtime_error(std::string("libcurl: ") + curl_easy_strerror(code));
}

using header_list = std::unique_ptr<curl_slist, free_curl>;

void append(header_list& list, const std::string& line) {
    curl_slist* const longer = curl_slist_append(list.get(), line.c_str());
    if (longer == nullptr) throw std::runtime_error("libcurl is out of memory");
    // it starts with what it was, if that was not empty
    [[maybe_unused]] curl_slist* const before = list.release();
    list.reset(longer);
}

std::string describe_problem(CURLcode code, const http_request& request, const http_answer& answer,
                             const target& where, const char* detail) {
    if (answer.received > largest_answer) return where.name + " answered more than 16 MiB";
    if (code == CURLE_OPERATION_TIMEDOUT) {
        char seconds[32];
        std::snprintf(seconds, sizeof seconds, "%g", request.timeout);
        return where.name + " did not answer within " + seconds + " s";
    }
    return where.name + ": " + (*detail != '\0' ? detail : curl_easy_strerror(code));
}

http_answer perform(const http_request& request, const target& where) {
    static const CURLcode started = curl_global_init(CURL_GLOBAL_DEFAULT);
    if (started != CURLE_OK) throw std::runtime_error("libcurl cannot start");
    const without_sigpipe quiet;
    // declared before the handles that point at them
    http_answer answer;
    char detail[CURL_ERROR_SIZE] = "";
    header_list headers;
    for (const auto& [name, value] : request.headers)
        append(headers, value.empty() ? name + ";" : name + ": " + value);
    // no waiting for permission to send a long body
    append(headers, "Expect:");

    transfer handles;
    CURL* const easy = handles.easy();
    set(easy, CURLOPT_ERRORBUFFER, detail);
    set(easy, CURLOPT_URL, request.url.c_str());
    set(easy, CURLOPT_PROTOCOLS_STR, "http,https");
    set(easy, CURLOPT_FOLLOWLOCATION, 0L);
    set(easy, CURLOPT_NOSIGNAL, 1L);
    // a resolver that still works when Ctrl-C comes is left alone
    set(easy, CURLOPT_QUICK_EXIT, 1L);
    set(easy, CURLOPT_USERAGENT, "limax/" LIMAX_VERSION);
    set(easy, CURLOPT_ACCEPT_ENCODING, "");
    set(easy, CURLOPT_TIMEOUT_MS, static_cast<long>(std::ceil(request.timeout * 1000)));
    set(easy, CURLOPT_CONNECTTIMEOUT_MS,
        static_cast<long>(std::ceil(std::min(request.timeout, longest_connect) * 1000)));
    set(easy, CURLOPT_HTTPHEADER, headers.get());
    set(easy, CURLOPT_WRITEFUNCTION, take_body);
    set(easy, CURLOPT_WRITEDATA, &answer);
    set(easy, CURLOPT_HEADERFUNCTION, take_header);
    set(easy, CURLOPT_HEADERDATA, &answer);
    // this machine is never asked through a proxy, which may stand elsewhere
    if (where.loopback) set(easy, CURLOPT_NOPROXY, "*");
    if (request.body) {
        set(easy, CURLOPT_POSTFIELDSIZE_LARGE, static_cast<curl_off_t>(request.body->size()));
        set(easy, CURLOPT_POSTFIELDS, request.body->data());
    } else if (request.method == "HEAD") {
        set(easy, CURLOPT_NOBODY, 1L);
    }
    set(easy, CURLOPT_CUSTOMREQUEST, request.method.c_str());

    if (curl_multi_add_handle(handles.multi(), easy) != CURLM_OK)
        throw std::runtime_error("libcurl cannot start a transfer");
    for (int running = 1; running != 0;) {
        if (interrupted()) {
            answer.interrupted = true;
            return answer;
        }
        CURLMcode code = curl_multi_perform(handles.multi(), &running);
        if (code == CURLM_OK && running != 0)
            code = curl_multi_poll(handles.multi(), nullptr, 0, wait_slice, nullptr);
        if (code != CURLM_OK)
            throw std::runtime_error(std::string("libcurl: ") + curl_multi_strerror(code));
    }
    int left = 0;
    const CURLMsg* const message = curl_multi_info_read(handles.multi(), &left);
    const CURLcode result = message == nullptr ? CURLE_FAILED_INIT : message->data.result;
    if (result != CURLE_OK)
        answer.problem = describe_problem(result, request, answer, where, detail);
    else
        curl_easy_getinfo(easy, CURLINFO_RESPONSE_CODE, &answer.status);
    return answer;
}

std::string text_field(lua_State* L, const char* name) {
    if (lua_type(L, -1) != LUA_TSTRING)
        throw std::runtime_error(std::string("http: ") + name + " must be a string, not a " +
                                 luaL_typename(L, -1));
    std::size_t length = 0;
    const char* const text = lua_tolstring(L, -1, &length);
    return {text, length};
}

// Refuses what would end a line of the request, and with it start another header.
std::string line_field(lua_State* L, const char* name) {
    std::string text = text_field(L, name);
    if (text.find_first_of(std::string("\r\n\0", 3)) != std::string::npos)
        throw std::runtime_error(std::string("http: ") + name +
                                 " must not hold a line break or a zero byte");
    return text;
}

http_request read_request(lua_State* L) {
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
            request.timeout = lua_type(L, -1) == LUA_TNUMBER ? lua_tonumber(L, -1) : 0;
            if (!(request.timeout > 0 && request.timeout <= longest_timeout))
                throw std::runtime_error(
                    "http: timeout must be a number of seconds above 0, at most 86400");
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
                                     "'; known are: body, headers, method, timeout, url");
        }
    }
    if (request.url.empty()) throw std::runtime_error("http: the field url is missing");
    if (request.method.empty()) request.method = request.body ? "POST" : "GET";
    return request;
}

void push_answer(lua_State* L, const http_answer& answer) {
    lua_createtable(L, 0, 3);
    lua_pushinteger(L, answer.status);
    lua_setfield(L, -2, "status");
    lua_pushlstring(L, answer.body.data(), answer.body.size());
    lua_setfield(L, -2, "body");
    lua_createtable(L, 0, static_cast<int>(answer.headers.size()));
    for (const auto& [name, value] : answer.headers) {
        lua_pushlstring(L, value.data(), value.size());
        lua_setfield(L, -2, name.c_str());
    }
    lua_setfield(L, -2, "headers");
}

// http{ url=, method=, headers=, body=, timeout= } -> { status=, headers=, body= } | nil, message
int http(lua_State* L) {
    bool stopped = false;
    {
        const http_request request = read_request(L);
        http_answer answer;
        try {
            const target where = check_url(request.url);
            answer = perform(request, where);
        } catch (const std::runtime_error& error) {
            answer.problem = error.what();
        }
        stopped = answer.interrupted;
        if (!stopped && !answer.problem.empty()) return push_failure(L, answer.problem);
        if (!stopped) push_answer(L, answer);
    }
    return stopped ? raise_interrupt(L) : 1;
}

}  // namespace

void open_http(lua_State* L) { add_function<http>(L, "http"); }

}  // namespace limax::host
