// http.cpp: one HTTP request at a time through libcurl's multi interface, with short waits so that
// Ctrl-C ends it. https to any host, with verified certificates; plain http to this machine, and
// elsewhere only where the request allows it; no redirects; the size of an answer is limited. No
// message contains a header, which may be a key.
#include <curl/curl.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>

#include "guard.h"
#include "http_request.h"
#include "modules.h"
#include "signals.h"
#include "url.h"

namespace limax::host {
namespace {

// bytes of all headers, interim answers included
constexpr std::size_t largest_headers = std::size_t{64} << 10;
constexpr int wait_slice = 50;  // ms between checks for Ctrl-C

struct http_answer {
    bool interrupted = false;
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

struct free_curl {
    void operator()(curl_slist* list) const { curl_slist_free_all(list); }
};

// A multi handle with at most one transfer, which is removed before either is freed.
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

// A write to a socket that the other side closed is an error here; elsewhere SIGPIPE ends the
// process.
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

// Throws if requests to the URL are not allowed.
url_parts check_url(const http_request& request) {
    url_parts parts = read_url(request.url);
    const bool plain = parts.scheme == "http" && (parts.loopback || request.allow_insecure);
    if (parts.scheme != "https" && !plain)
        throw std::runtime_error("only https, or http to this machine, is allowed, not " +
                                 parts.scheme + "://" + parts.host);
    if (parts.credentials)
        throw std::runtime_error("a URL with credentials is not allowed: " + parts.name());
    return parts;
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

std::size_t take_header(char* bytes, std::size_t size, std::size_t count, void* to) noexcept {
    auto& answer = *static_cast<http_answer*>(to);
    answer.header_bytes += size * count;
    if (answer.header_bytes > largest_headers) return 0;
    try {
        const std::string line(bytes, size * count);
        const std::size_t colon = line.find(':');
        if (line.compare(0, 5, "HTTP/") == 0) {
            // headers of an interim answer (100, 103) do not count
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
    // it begins with the list before, unless that was empty
    [[maybe_unused]] curl_slist* const before = list.release();
    list.reset(longer);
}

// What failed, as one word by which scripts decide about a retry. `begun`: was the connection
// established?
const char* kind_of(CURLcode code, const http_answer& answer, bool begun) {
    if (answer.over_size || code == CURLE_FILESIZE_EXCEEDED) return "size";
    if (answer.header_bytes > largest_headers) return "headers";
    switch (code) {
        case CURLE_COULDNT_RESOLVE_HOST:
        case CURLE_COULDNT_RESOLVE_PROXY: return "resolve";
        case CURLE_COULDNT_CONNECT: return "connect";
        case CURLE_OPERATION_TIMEDOUT: return begun ? "timeout" : "connect_timeout";
        case CURLE_PARTIAL_FILE: return "partial";
        case CURLE_SEND_ERROR:
        case CURLE_RECV_ERROR:
        case CURLE_GOT_NOTHING:
        case CURLE_HTTP2:
        case CURLE_HTTP2_STREAM: return "reset";
        case CURLE_SSL_CONNECT_ERROR: return "tls";
        case CURLE_PEER_FAILED_VERIFICATION:
        case CURLE_SSL_ISSUER_ERROR:
        case CURLE_SSL_CACERT_BADFILE: return "certificate";
        case CURLE_BAD_CONTENT_ENCODING: return "encoding";
        default: return "protocol";
    }
}

void describe_problem(http_answer& answer, CURLcode code, const http_request& request,
                      const url_parts& where, const char* detail, bool begun) {
    answer.kind = kind_of(code, answer, begun);
    answer.curl = *detail != '\0' ? detail : curl_easy_strerror(code);
    const std::string kind = answer.kind;
    char amount[32];
    answer.problem = where.name();
    if (kind == "size") {
        std::snprintf(amount, sizeof amount, "%g", static_cast<double>(request.largest) / 1048576);
        answer.problem += std::string(" answered more than ") + amount + " MiB";
    } else if (kind == "headers") {
        answer.problem += " answered more than 64 KiB of headers";
    } else if (kind == "timeout") {
        std::snprintf(amount, sizeof amount, "%.3g", request.timeout);
        answer.problem += std::string(" did not answer within ") + amount + " s";
    } else if (kind == "connect_timeout") {
        std::snprintf(amount, sizeof amount, "%.3g",
                      std::min(request.timeout, request.connect_timeout));
        answer.problem += std::string(" was not reached within ") + amount + " s";
    } else {
        answer.problem += ": " + answer.curl;
    }
}

long milliseconds(double seconds) { return static_cast<long>(std::ceil(seconds * 1000)); }

void set_request(CURL* easy, const http_request& request, const url_parts& where) {
    set(easy, CURLOPT_URL, request.url.c_str());
    set(easy, CURLOPT_PROTOCOLS_STR, "http,https");
    set(easy, CURLOPT_FOLLOWLOCATION, 0L);
    set(easy, CURLOPT_NOSIGNAL, 1L);
    // on Ctrl-C, do not wait for a resolver's thread
    set(easy, CURLOPT_QUICK_EXIT, 1L);
    set(easy, CURLOPT_USERAGENT, "limax/" LIMAX_VERSION);
    set(easy, CURLOPT_ACCEPT_ENCODING, "");
    set(easy, CURLOPT_SSL_VERIFYPEER, 1L);
    set(easy, CURLOPT_SSL_VERIFYHOST, 2L);
    if (!request.ca_file.empty()) set(easy, CURLOPT_CAINFO, request.ca_file.c_str());
    set(easy, CURLOPT_TIMEOUT_MS, milliseconds(request.timeout));
    set(easy, CURLOPT_CONNECTTIMEOUT_MS,
        milliseconds(std::min(request.timeout, request.connect_timeout)));
    set(easy, CURLOPT_MAXFILESIZE_LARGE, static_cast<curl_off_t>(request.largest));
    // a proxy may be another machine
    if (where.loopback) set(easy, CURLOPT_NOPROXY, "*");
    if (request.body) {
        set(easy, CURLOPT_POSTFIELDSIZE_LARGE, static_cast<curl_off_t>(request.body->size()));
        set(easy, CURLOPT_POSTFIELDS, request.body->data());
    } else if (request.method == "HEAD") {
        set(easy, CURLOPT_NOBODY, 1L);
    }
    set(easy, CURLOPT_CUSTOMREQUEST, request.method.c_str());
}

http_answer perform(const http_request& request, const url_parts& where) {
    static const CURLcode started = curl_global_init(CURL_GLOBAL_DEFAULT);
    if (started != CURLE_OK) throw std::runtime_error("libcurl cannot start");
    const without_sigpipe quiet;
    // declared before the handles that point at them
    http_answer answer;
    answer.largest = request.largest;
    char detail[CURL_ERROR_SIZE] = "";
    header_list headers;
    for (const auto& [name, value] : request.headers)
        append(headers, value.empty() ? name + ";" : name + ": " + value);
    // send a long body without waiting for permission
    append(headers, "Expect:");

    transfer handles;
    CURL* const easy = handles.easy();
    set_request(easy, request, where);
    set(easy, CURLOPT_ERRORBUFFER, detail);
    set(easy, CURLOPT_HTTPHEADER, headers.get());
    set(easy, CURLOPT_WRITEFUNCTION, take_body);
    set(easy, CURLOPT_WRITEDATA, &answer);
    set(easy, CURLOPT_HEADERFUNCTION, take_header);
    set(easy, CURLOPT_HEADERDATA, &answer);

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
    curl_easy_getinfo(easy, CURLINFO_RESPONSE_CODE, &answer.status);
    if (result != CURLE_OK) {
        curl_off_t begun = 0;  // microseconds until the request could be sent; 0: never
        curl_easy_getinfo(easy, CURLINFO_PRETRANSFER_TIME_T, &begun);
        describe_problem(answer, result, request, where, detail, begun != 0);
    }
    return answer;
}

// Pushes { status, body, headers }; status is 0 if no line of an answer came.
void push_answer(lua_State* L, const http_answer& answer) {
    lua_createtable(L, 0, 5);
    lua_pushinteger(L, answer.status);
    lua_setfield(L, -2, "status");
    set_text(L, "body", answer.body);
    lua_createtable(L, 0, static_cast<int>(answer.headers.size()));
    for (const auto& [name, value] : answer.headers) set_text(L, name.c_str(), value);
    lua_setfield(L, -2, "headers");
}

// http(request) -> { status=, headers=, body= } | nil, message, { kind=, curl=, status=, headers=,
// body= } with the part that came
int http(lua_State* L) {
    bool stopped = false;
    int results = 1;
    {
        const http_request request = read_http_request(L);
        http_answer answer;
        try {
            answer = perform(request, check_url(request));
        } catch (const std::runtime_error& error) {
            answer.problem = answer.curl = error.what();
        }
        stopped = answer.interrupted;
        if (!stopped && !answer.problem.empty()) results += push_failure(L, answer.problem);
        if (!stopped) push_answer(L, answer);
        if (results > 1) {
            set_text(L, "kind", answer.kind);
            set_text(L, "curl", answer.curl);
        }
    }
    return stopped ? raise_interrupt(L) : results;
}

}  // namespace

void open_http(lua_State* L) { add_function<http>(L, "http"); }

}  // namespace limax::host
