// sandbox.cpp: host.sandbox: starts a parser's process, sends it a request and waits for the
// answer. The process gets no environment and no descriptor but its socket, and is killed when its
// time is up. parser_process.cpp is the other side.

#include <poll.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <string>
#include <string_view>
#include <system_error>

#include "guard.h"
#include "json.h"
#include "modules.h"
#include "parser_process.h"
#include "signals.h"

namespace limax::host {
namespace {

using steady = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr double most_seconds = 5;

[[noreturn]] void throw_error(int number, const char* what) {
    throw std::system_error(number, std::generic_category(), what);
}

// A child process of this executable with a socket as its standard input and output. It is killed
// with this object.
class parser_process {
public:
    parser_process() {
        int ends[2];
        if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0)
            throw_error(errno, "cannot make a socket");
        socket_ = ends[0];
        posix_spawn_file_actions_t actions;
        posix_spawn_file_actions_init(&actions);
        posix_spawn_file_actions_adddup2(&actions, ends[1], STDIN_FILENO);
        posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
        posix_spawn_file_actions_addclosefrom_np(&actions, STDERR_FILENO + 1);
        char name[] = "limax";
        std::string argument = parser_process_argument;
        char* const words[] = {name, argument.data(), nullptr};
        char* const no_environment[] = {nullptr};
        const int problem =
            posix_spawn(&pid_, "/proc/self/exe", &actions, nullptr, words, no_environment);
        posix_spawn_file_actions_destroy(&actions);
        close(ends[1]);
        if (problem != 0) {
            close(socket_);
            throw_error(problem, "cannot start a parser's process");
        }
    }
    ~parser_process() {
        close(socket_);
        end(true);
    }
    parser_process(const parser_process&) = delete;
    parser_process& operator=(const parser_process&) = delete;

    // Sends the request and appends what comes back to `answer`, until the process ends. False:
    // the deadline passed, or Ctrl-C came.
    bool exchange(std::string_view request, steady::time_point deadline, std::string& answer) {
        while (!interrupted()) {
            const auto left =
                std::chrono::duration_cast<milliseconds>(deadline - steady::now()).count();
            if (left <= 0) return false;
            const int events = POLLIN | (request.empty() ? 0 : POLLOUT);
            pollfd gate{socket_, static_cast<short>(events), 0};
            // a signal ends the wait early
            if (poll(&gate, 1, static_cast<int>(left)) <= 0) continue;
            if ((gate.revents & POLLOUT) != 0) send_some(request);
            if ((gate.revents & (POLLIN | POLLHUP)) != 0 && !receive_some(answer)) return true;
        }
        return false;
    }

    // Waits for the end of the process; returns its status as waitpid gives it.
    int end(bool by_force) {
        if (pid_ == 0) return status_;
        if (by_force) kill(pid_, SIGKILL);
        while (waitpid(pid_, &status_, 0) < 0 && errno == EINTR) {
        }
        pid_ = 0;
        return status_;
    }

private:
    void send_some(std::string_view& request) const {
        const ssize_t count =
            send(socket_, request.data(), request.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
        if (count > 0) request.remove_prefix(static_cast<std::size_t>(count));
        // a process that ended before it read everything
        if (count < 0 && errno != EAGAIN && errno != EINTR) request = {};
        if (request.empty()) shutdown(socket_, SHUT_WR);
    }

    // False at the end.
    bool receive_some(std::string& answer) const {
        char buffer[65536];
        const ssize_t count = recv(socket_, buffer, sizeof buffer, MSG_DONTWAIT);
        if (count > 0) answer.append(buffer, static_cast<std::size_t>(count));
        return count > 0 || (count < 0 && (errno == EAGAIN || errno == EINTR));
    }

    pid_t pid_ = 0;
    int socket_ = -1;
    int status_ = 0;
};

// Runs a request in a parser's process. An empty answer comes with the problem.
std::string run_request(const std::string& request, double seconds, std::string& problem) {
    const auto deadline = steady::now() + std::chrono::duration_cast<steady::duration>(
                                              std::chrono::duration<double>(seconds));
    parser_process child;
    std::string answer;
    const bool ended = child.exchange(request, deadline, answer);
    const int status = child.end(!ended);
    if (ended && WIFEXITED(status) && WEXITSTATUS(status) == 0) return answer;
    char text[80];
    if (!ended || (WIFSIGNALED(status) && WTERMSIG(status) == SIGXCPU))
        std::snprintf(text, sizeof text, "stopped after %.2f s", seconds);
    else
        std::snprintf(text, sizeof text, "its process failed (wait status %d)", status);
    problem = text;
    return {};
}

// sandbox({ source, name, text, limits } [, seconds])
//     -> true, value|nil, message|nil, note|nil   | false, why the parser failed
int sandbox(lua_State* L) {
    luaL_checktype(L, 1, LUA_TTABLE);
    const double seconds = luaL_optnumber(L, 2, most_seconds);
    luaL_argcheck(L, seconds > 0 && seconds <= most_seconds, 2, "above 0 s and at most 5 s");
    lua_settop(L, 1);
    {
        std::string problem;
        const std::string answer = run_request(encode_json(L, 1, 0), seconds, problem);
        if (!interrupted()) {
            lua_pushboolean(L, problem.empty());
            if (problem.empty())
                decode_json(L, answer, "the parser's answer");
            else
                lua_pushlstring(L, problem.data(), problem.size());
        }
    }
    if (interrupted()) return raise_interrupt(L);
    if (lua_isstring(L, 3)) return 2;
    lua_getfield(L, 3, "problem");
    if (!lua_isnil(L, -1)) {
        lua_pushboolean(L, 0);
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
