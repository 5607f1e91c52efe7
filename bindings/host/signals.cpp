// signals.cpp: Ctrl-C. The handler sets the engine's stop flag and a hook that raises an error in
// every further instruction of the interpreter, until the host's protected call handles the
// interrupt: a script's pcall cannot catch it. Compiled traces check no hook, so a watchdog thread
// ends the process if the interrupt is not noticed. Only the main thread handles SIGINT.
#include "signals.h"

#include <poll.h>
#include <pthread.h>
#include <semaphore.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <ctime>
#include <stdexcept>
#include <system_error>
#include <thread>

#include "guard.h"
#include "limax.h"

namespace limax::host {
namespace {

using namespace std::chrono_literals;

// The watchdog ends the process after so many checks without a reaction (2 s), or after so many in
// all (3 s: a compiled loop around a C function may react without ending). It counts checks and not
// time, so that a process that was stopped and continued gets its 2 s too.
constexpr auto check_interval = 50ms;
constexpr int checks_without_reaction = 40;
constexpr int checks_in_all = 60;
// Two signals this close count as one: `timeout -s INT` and some launchers signal a process and
// then its whole group.
constexpr std::int64_t same_press = 100'000'000;  // ns
constexpr int status_interrupted = 130;           // the shell's 128 + SIGINT
// A terminal that accepts no text for so long (a stopped one, say) is not waited for.
constexpr int longest_wait_for_stderr = 200;  // ms
// Room for a command with the longest path, each byte of it quoted for a shell.
constexpr std::size_t longest_message = 20480;

const char interrupt_key = 0;  // its address is the registry key of host.interrupt

std::atomic<lua_State*> state{nullptr};
std::atomic<bool> pressed{false};  // since the last rearm
std::atomic<bool> pending{false};  // and not acknowledged
std::atomic<std::int64_t> pressed_at{0};
std::atomic<unsigned> reactions{0};
std::atomic<int> exit_status{status_interrupted};
static_assert(std::atomic<lua_State*>::is_always_lock_free &&
                  std::atomic<std::int64_t>::is_always_lock_free &&
                  std::atomic<int>::is_always_lock_free,
              "a signal handler may only touch lock-free atomics");
pthread_t main_thread;
sem_t bell;

// The message of a hard stop. There are two, filled in turn: the current one never changes while
// the handler or the watchdog may read it.
struct message {
    char text[longest_message];
    std::size_t length;
};
message messages[2];
int next_message = 0;
std::atomic<const message*> hard_stop_message{nullptr};

void raise_from_hook(lua_State* L, lua_Debug*) {
    if (!pending) return;
    ++reactions;
    raise_interrupt(L);
}

std::int64_t monotonic_nanoseconds() {
    timespec now{};
    clock_gettime(CLOCK_MONOTONIC, &now);
    return std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
}

// Async-signal-safe, like all functions down to the handler.
void write_to_stderr(const char* text, std::size_t length) {
    pollfd gate{STDERR_FILENO, POLLOUT, 0};
    if (poll(&gate, 1, longest_wait_for_stderr) != 1) return;
    [[maybe_unused]] const ssize_t written = write(STDERR_FILENO, text, length);
}

[[noreturn]] void stop_with_message() {
    if (const message* const last = hard_stop_message) write_to_stderr(last->text, last->length);
    _exit(exit_status);
}

// Uses only lock-free atomics, sem_post, and lua_sethook, which LuaJIT allows in handlers.
void on_interrupt(int) {
    const int errno_before = errno;
    if (pthread_equal(pthread_self(), main_thread) == 0) {
        // a thread of a library that did not block the signal
        pthread_kill(main_thread, SIGINT);
        errno = errno_before;
        return;
    }
    lua_State* const L = state;
    const std::int64_t now = monotonic_nanoseconds();
    if (L == nullptr || (pressed && now - pressed_at > same_press)) {
        // a progress bar may be on the line
        if (hard_stop_message != nullptr) write_to_stderr("\n", 1);
        stop_with_message();
    }
    if (!pressed) {
        pressed_at = now;
        pressed = true;
        pending = true;
        limax_interrupt();
        lua_sethook(L, raise_from_hook, LUA_MASKCALL | LUA_MASKRET | LUA_MASKCOUNT, 1);
        sem_post(&bell);
    }
    errno = errno_before;
}

[[noreturn]] void stop_hard() {
    static const char text[] =
        "\nlimax: what runs (a compiled loop?) did not stop within 2 s of Ctrl-C: stopping hard. "
        "Written files are complete.\n";
    write_to_stderr(text, sizeof text - 1);
    stop_with_message();
}

void watch() {
    for (;;) {
        while (sem_wait(&bell) != 0) {
        }
        unsigned seen = reactions;
        int quiet = 0;
        for (int checks = 1; pending; ++checks) {
            std::this_thread::sleep_for(check_interval);
            quiet = reactions == seen ? quiet + 1 : 0;
            seen = reactions;
            if (pending && (quiet == checks_without_reaction || checks == checks_in_all))
                stop_hard();
        }
    }
}

// Blocks SIGINT on this thread for the length of a scope.
class without_interrupts {
public:
    without_interrupts() {
        sigset_t set;
        sigemptyset(&set);
        sigaddset(&set, SIGINT);
        pthread_sigmask(SIG_BLOCK, &set, &before_);
    }
    ~without_interrupts() { pthread_sigmask(SIG_SETMASK, &before_, nullptr); }
    without_interrupts(const without_interrupts&) = delete;
    without_interrupts& operator=(const without_interrupts&) = delete;

private:
    sigset_t before_{};
};

int lua_interrupted(lua_State* L) {
    lua_pushboolean(L, interrupted());
    return 1;
}

int lua_raise_if_interrupted(lua_State* L) { return interrupted() ? raise_interrupt(L) : 0; }

int lua_rearm(lua_State*) {
    acknowledge_interrupt();
    pressed = false;
    return 0;
}

// on_hard_stop(line): the line for standard error if the process ends without Lua; nil: none
int lua_on_hard_stop(lua_State* L) {
    if (lua_isnoneornil(L, 1)) {
        hard_stop_message = nullptr;
        return 0;
    }
    std::size_t length = 0;
    const char* const line = luaL_checklstring(L, 1, &length);
    luaL_argcheck(L, length < longest_message, 1, "the line is too long");
    message& next = messages[next_message];
    next_message = 1 - next_message;
    std::memcpy(next.text, line, length);
    next.text[length] = '\n';
    next.length = length + 1;
    hard_stop_message = &next;
    return 0;
}

int interrupt_text(lua_State* L) {
    lua_pushliteral(L, "interrupted");
    return 1;
}

}  // namespace

void install_signals(lua_State* L) {
    main_thread = pthread_self();
    state = L;
    if (sem_init(&bell, 0, 0) != 0) throw std::runtime_error("cannot create a semaphore");
    {
        // the watchdog inherits this mask
        const without_interrupts blocked;
        std::thread(watch).detach();
    }
    struct sigaction action {};
    action.sa_handler = on_interrupt;
    sigemptyset(&action.sa_mask);
    // no SA_RESTART: a read that waits for input must return to Lua
    action.sa_flags = 0;
    if (sigaction(SIGINT, &action, nullptr) != 0)
        throw std::system_error(errno, std::generic_category(), "cannot handle SIGINT");
}

void release_signals() {
    const without_interrupts blocked;
    if (lua_State* const L = state.exchange(nullptr)) lua_sethook(L, nullptr, 0, 0);
    pending = false;
}

void settle_status(int status) { exit_status = status; }

bool interrupted() {
    if (!pending) return false;
    ++reactions;
    return true;
}

void acknowledge_interrupt() {
    const without_interrupts blocked;
    if (!pending) return;
    ++reactions;
    if (lua_State* const L = state) lua_sethook(L, nullptr, 0, 0);
    limax_interrupt_clear();
    pending = false;
}

bool was_interrupted() { return pressed; }

void set_hook(lua_State* L, lua_Hook hook, int mask, int count) {
    const without_interrupts blocked;
    if (!pending) lua_sethook(L, hook, mask, count);
}

void push_interrupt(lua_State* L) {
    lua_pushlightuserdata(L, const_cast<char*>(&interrupt_key));
    lua_rawget(L, LUA_REGISTRYINDEX);
}

int raise_interrupt(lua_State* L) {
    push_interrupt(L);
    return lua_error(L);
}

void open_signals(lua_State* L) {
    lua_pushlightuserdata(L, const_cast<char*>(&interrupt_key));
    lua_newtable(L);
    lua_newtable(L);
    add_function<interrupt_text>(L, "__tostring");
    lua_setmetatable(L, -2);
    lua_rawset(L, LUA_REGISTRYINDEX);

    push_interrupt(L);
    lua_setfield(L, -2, "interrupt");
    add_function<lua_interrupted>(L, "interrupted");
    add_function<lua_raise_if_interrupted>(L, "raise_if_interrupted");
    lua_newtable(L);
    add_function<lua_rearm>(L, "rearm");
    add_function<lua_on_hard_stop>(L, "on_hard_stop");
    lua_setfield(L, -2, "signal");
}

}  // namespace limax::host
