// sandbox.cpp: host.sandbox: runs a parser of a language model's text in a child process, with a
// socket as its standard input and output. The process gets no environment and no other descriptor.
// Before it reads anything it gives up the right to open files and limits its memory and time. The
// parser finds string, table, math, json and little more.
#include <spawn.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmath>
#include <csignal>
#include <cstddef>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <iterator>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <system_error>

#include "durable.h"
#include "guard.h"
#include "json.h"
#include "modules.h"
#include "signals.h"

namespace limax::host {
namespace {

// ---- the caller's side ----

constexpr double most_seconds = 5;

void check(int problem, const char* what) {
    if (problem != 0) throw std::system_error(problem, std::generic_category(), what);
}

// Starts this executable with a socket as its standard input and output.
pid_t start_process(int socket, double seconds) {
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, socket, STDIN_FILENO);
    posix_spawn_file_actions_adddup2(&actions, socket, STDOUT_FILENO);
    posix_spawn_file_actions_addclosefrom_np(&actions, STDERR_FILENO + 1);
    std::string name = "limax", argument = parser_process_argument, limit = std::to_string(seconds);
    char* const words[] = {name.data(), argument.data(), limit.data(), nullptr};
    char* const no_environment[] = {nullptr};
    pid_t process = 0;
    const int problem =
        posix_spawn(&process, "/proc/self/exe", &actions, nullptr, words, no_environment);
    posix_spawn_file_actions_destroy(&actions);
    check(problem, "cannot start a parser's process");
    return process;
}

// Repeats a system call on a socket that another signal than Ctrl-C interrupted.
template <typename call>
ssize_t unless_interrupted(call&& try_once) {
    ssize_t count = -1;
    while (!interrupted() && (count = try_once()) < 0 && errno == EINTR) {
    }
    return count;
}

// Sends the request and returns all that comes back until the process ends or Ctrl-C comes. A
// process that ended before it read everything has closed its socket.
std::string exchange(int socket, std::string_view request) {
    ssize_t count = 0;
    while (!request.empty() && (count = unless_interrupted([&] {
                                    return send(socket, request.data(), request.size(),
                                                MSG_NOSIGNAL);
                                })) > 0)
        request.remove_prefix(static_cast<std::size_t>(count));
    shutdown(socket, SHUT_WR);
    std::string answer;
    char buffer[65536];
    while ((count = unless_interrupted([&] { return recv(socket, buffer, sizeof buffer, 0); })) > 0)
        answer.append(buffer, static_cast<std::size_t>(count));
    return answer;
}

// Runs a request in a parser's process. An empty answer comes with the problem.
std::string run_request(const std::string& request, double seconds, std::string& problem) {
    int ends[2];
    check(socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) == 0 ? 0 : errno,
          "cannot make a socket");
    const descriptor ours(ends[0]);
    pid_t process = 0;
    {
        const descriptor theirs(ends[1]);
        process = start_process(theirs.get(), seconds);
    }
    std::string answer = exchange(ours.get(), request);
    if (interrupted()) kill(process, SIGKILL);
    int status = 0;
    persist([&] { return waitpid(process, &status, 0); });
    if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return answer;
    char text[80];
    if (WIFSIGNALED(status) && (WTERMSIG(status) == SIGALRM || WTERMSIG(status) == SIGXCPU))
        std::snprintf(text, sizeof text, "stopped after %.2f s", seconds);
    else
        std::snprintf(text, sizeof text, "its process failed (wait status %d)", status);
    problem = text;
    return {};
}

int sandbox(lua_State* L) {
    luaL_checktype(L, 1, LUA_TTABLE);
    const double seconds = luaL_optnumber(L, 2, most_seconds);
    luaL_argcheck(L, seconds > 0 && seconds <= most_seconds, 2, "above 0 s and at most 5 s");
    lua_settop(L, 1);
    std::string problem;
    const std::string answer = run_request(encode_json(L, 1, 0), seconds, problem);
    if (interrupted()) return raise_interrupt(L);
    push(L, problem.empty());
    if (!problem.empty()) return 1 + push(L, problem);
    decode_json(L, answer, "the parser's answer");
    lua_getfield(L, 3, "problem");
    if (!lua_isnil(L, -1)) {
        push(L, false);
        lua_insert(L, -2);
        return 2;
    }
    lua_pop(L, 1);
    for (const char* name : {"value", "message", "note"}) lua_getfield(L, 3, name);
    lua_remove(L, 3);
    return 4;
}

// ---- the side of the parser ----

// Limits of a parser, beyond the executable itself. A good one takes about a thousandth.
constexpr rlim_t most_bytes = rlim_t{64} << 20;
constexpr rlim_t most_cpu_seconds = 6;
constexpr std::size_t longest_error = 300;  // bytes of a parser's own message
constexpr char out_of_memory[] = R"({"problem":"it needs more than 64 MB"})";

bool confine(double seconds) {
    rlim_t pages = 0;  // of this process's address space
    if (!(std::ifstream("/proc/self/statm") >> pages)) return false;
    const struct {
        __rlimit_resource_t resource;
        rlim_t most;
    } limits[] = {{RLIMIT_AS, pages * static_cast<rlim_t>(sysconf(_SC_PAGESIZE)) + most_bytes},
                  {RLIMIT_CPU, most_cpu_seconds},
                  {RLIMIT_NOFILE, 0},
                  {RLIMIT_FSIZE, 0},
                  {RLIMIT_NPROC, 0},
                  {RLIMIT_CORE, 0}};
    for (const auto& each : limits) {
        const rlimit limit{each.most, each.most};
        if (setrlimit(each.resource, &limit) != 0) return false;
    }
    // its signal ends the process
    const double whole = std::floor(seconds);
    const itimerval timer{{0, 0},
                          {static_cast<time_t>(whole), std::lround(1e6 * (seconds - whole))}};
    return setitimer(ITIMER_REAL, &timer, nullptr) == 0;
}

// The libraries of a parser.
void open_libraries(lua_State* L) {
    static const char* const kept[] = {"assert",       "error",        "ipairs",       "next",
                                       "pairs",        "pcall",        "select",       "tonumber",
                                       "type",         "tostring",     "_VERSION",     "unpack",
                                       LUA_STRLIBNAME, LUA_TABLIBNAME, LUA_MATHLIBNAME};
    luaL_openlibs(L);
    replace_next(L);
    lua_newtable(L);
    for (const char* name : kept) {
        lua_getglobal(L, name);
        lua_setfield(L, -2, name);
    }
    open_json(L);
    lua_replace(L, LUA_GLOBALSINDEX);
}

// Takes the request's text as light userdata; replaces it by the answer's.
int parse(lua_State* L) {
    std::string& exchanged = *static_cast<std::string*>(lua_touserdata(L, 1));
    open_libraries(L);
    decode_json(L, exchanged, "the request");
    for (const char* name : {"source", "name", "text", "limits"}) lua_getfield(L, 2, name);
    const std::string_view source = text_argument(L, 3);
    // "t": text, no bytecode, which could do anything
    if (luaL_loadbufferx(L, source.data(), source.size(), luaL_checkstring(L, 4), "t") != 0)
        return lua_error(L);
    lua_call(L, 0, 1);
    if (!lua_isfunction(L, -1))
        return luaL_error(L, "expected a file that returns a function, got %s",
                          luaL_typename(L, -1));
    lua_pushvalue(L, 5);
    lua_pushvalue(L, 6);
    lua_call(L, 2, 3);
    lua_newtable(L);
    const char* const names[] = {"value", "message", "note"};
    for (int i = 0; i < 3; ++i) {
        // only texts are a message or a note
        if (i > 0 && lua_type(L, 7 + i) != LUA_TSTRING) continue;
        lua_pushvalue(L, 7 + i);
        lua_setfield(L, -2, names[i]);
    }
    exchanged = encode_json(L, -1, 0);
    return 0;
}

std::string answer_to(std::string request) {
    const std::unique_ptr<lua_State, decltype(&lua_close)> state(luaL_newstate(), lua_close);
    lua_State* const L = state.get();
    if (L == nullptr) return out_of_memory;
    luaJIT_setmode(L, 0, LUAJIT_MODE_ENGINE | LUAJIT_MODE_OFF);
    const int status = lua_cpcall(L, guarded<parse>, &request);
    if (status == 0) return request;
    const std::string_view text = lua_type(L, -1) == LUA_TSTRING ? text_at(L, -1) : "";
    if (status == LUA_ERRMEM || text == "std::bad_alloc" || text == "not enough memory")
        return out_of_memory;
    std::string problem(text.substr(0, longest_error));
    if (lua_type(L, -1) != LUA_TSTRING)
        problem = std::string("an error that is a ") + luaL_typename(L, -1);
    else if (find_invalid_utf8(problem) != problem.npos)
        problem = "its error is not a text in UTF-8";
    return nlohmann::json{{"problem", problem}}.dump();
}

}  // namespace

void open_sandbox(lua_State* L) { add_function<sandbox>(L, "sandbox"); }

int run_parser_process(double seconds) {
    if (!confine(seconds)) return 1;
    std::cout << answer_to({std::istreambuf_iterator<char>(std::cin), {}}) << std::flush;
    return std::cout ? 0 : 1;
}

}  // namespace limax::host
