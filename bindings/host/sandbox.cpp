// sandbox.cpp: host.sandbox: starts a parser's process, sends it a request and waits for the
// answer. The process gets no environment and no descriptor but its socket, and ends itself when
// its time is up. parser_process.cpp is the other side.
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>

#include <csignal>
#include <cstdio>
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

}  // namespace

void open_sandbox(lua_State* L) { add_function<sandbox>(L, "sandbox"); }

}  // namespace limax::host
