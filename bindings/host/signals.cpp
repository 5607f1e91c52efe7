// signals.cpp: Ctrl-C, and SIGTERM, which does the same. The handler sets the engine's stop flag
// and a hook that raises an error in every further instruction of the interpreter, until the host's
// protected call handles the interrupt: a script's pcall cannot catch it. Compiled traces check no
// hook, so an alarm ends the process if the interrupt is not handled within 2 s of processor time,
// or 10 s. Only the main thread handles these signals. The same alarm reports a user's function
// that runs for 5 s.
#include "signals.h"

#include <poll.h>
#include <pthread.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <ctime>
#include <deque>
#include <set>
#include <string>
#include <string_view>

#include "guard.h"
#include "limax.h"

namespace limax::host {
namespace {

// An interrupt is to be handled within 2 s of processor time, since a busy machine may hold the
// process up, and 10 s of wall time, if a call of the system neither works nor returns.
constexpr std::int64_t time_to_react = 2'000'000'000;    // ns
constexpr std::int64_t time_to_return = 10'000'000'000;  // ns
constexpr std::int64_t time_to_report = 5'000'000'000;   // ns
// Ctrl-C names a function that has run for so long.
constexpr std::int64_t long_call = 1'000'000'000;  // ns
// Two signals this close count as one: `timeout -s INT` and some launchers signal a process and
// then its whole group.
constexpr std::int64_t same_press = 100'000'000;  // ns
constexpr int status_of_signal = 128;             // of the shell; more by its number
// A terminal that accepts no text for so long (a stopped one, say) is not waited for.
constexpr int longest_wait_for_stderr = 200;  // ms

const char* const interrupt_key = "limax.interrupt";  // of host.interrupt, in the registry

std::atomic<lua_State*> state{nullptr};
std::atomic<bool> pressed{false};            // since the last rearm
std::atomic<bool> pending{false};            // and not acknowledged
std::atomic<std::int64_t> pressed_at{0};     // ns
std::atomic<std::int64_t> worked_before{0};  // ns of processor time of the main thread
std::atomic<int> pressed_signal{SIGINT};
std::atomic<int> exit_status{-1};  // once all work is done
static_assert(std::atomic<lua_State*>::is_always_lock_free &&
                  std::atomic<std::int64_t>::is_always_lock_free &&
                  std::atomic<int>::is_always_lock_free,
              "a signal handler may only touch lock-free atomics");
pthread_t main_thread;
std::atomic<const std::string*> hard_stop_message{nullptr};
std::atomic<const std::string*> watched{nullptr};   // the user's function that runs
std::atomic<const std::string*> reported{nullptr};  // the last one that took 5 s
std::atomic<std::int64_t> watched_since{0};         // ns
std::atomic<bool> armed{false};  // an alarm is set that will look at the watched function

void raise_from_hook(lua_State* L, lua_Debug*) {
    if (pending) raise_interrupt(L);
}

std::int64_t nanoseconds(clockid_t clock) {
    timespec now{};
    clock_gettime(clock, &now);
    return std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
}

std::int64_t monotonic_nanoseconds() { return nanoseconds(CLOCK_MONOTONIC); }

std::int64_t worked_nanoseconds() { return nanoseconds(CLOCK_THREAD_CPUTIME_ID); }

// Async-signal-safe, like all functions down to the handler.
void write_to_stderr(const char* text, std::size_t length) {
    pollfd gate{STDERR_FILENO, POLLOUT, 0};
    if (poll(&gate, 1, longest_wait_for_stderr) != 1) return;
    [[maybe_unused]] const ssize_t written = write(STDERR_FILENO, text, length);
}

// Names the user's function that runs.
void write_watched(std::string_view before, std::string_view after) {
    const std::string* const name = watched;
    if (name == nullptr) return;
    write_to_stderr(before.data(), before.size());
    write_to_stderr(name->data(), name->size());
    write_to_stderr(after.data(), after.size());
}

[[noreturn]] void stop_with_message() {
    if (const std::string* const last = hard_stop_message)
        write_to_stderr(last->data(), last->size());
    _exit(exit_status >= 0 ? exit_status.load() : interrupt_status());
}

// LuaJIT allows lua_sethook in handlers, but forgets the hook if it was just then changing what the
// interpreter checks, as at the end of a compilation: so it is set every second.
void raise_soon(lua_State* L) {
    lua_sethook(L, raise_from_hook, LUA_MASKCALL | LUA_MASKRET | LUA_MASKCOUNT, 1);
    alarm(1);
}

void on_interrupt(int signal) {
    const int errno_before = errno;
    if (pthread_equal(pthread_self(), main_thread) == 0) {
        // a thread of a library that did not block the signal
        pthread_kill(main_thread, signal);
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
        pressed_signal = signal;
        pressed_at = now;
        worked_before = worked_nanoseconds();
        pressed = true;
        pending = true;
        limax_interrupt();
        if (now - watched_since > long_call) write_watched("\nlimax: interrupted in ", "\n");
        raise_soon(L);
    }
    errno = errno_before;
}

void arm(std::int64_t nanoseconds) {
    armed = true;
    alarm(static_cast<unsigned>(nanoseconds / 1'000'000'000));
}

// Reports a slow function once, however often it is called. Calls end and begin without a system
// call: the alarm of one call serves those that follow it.
void look_at_watched() {
    armed = false;
    const std::string* const name = watched;
    if (name == nullptr) return;
    const std::int64_t left = watched_since + time_to_report - monotonic_nanoseconds();
    if (left > 0)
        arm(left + 999'999'999);
    else if (reported.exchange(name) != name)
        write_watched("\nlimax: ", " has been running for 5 s; Ctrl-C stops the run\n");
}

void on_alarm(int) {
    if (!pending) {
        look_at_watched();
        return;
    }
    lua_State* const L = state;
    // the last alarm comes a little early or late
    constexpr std::int64_t early = 500'000'000;
    if (L != nullptr && worked_nanoseconds() - worked_before < time_to_react - early &&
        monotonic_nanoseconds() - pressed_at < time_to_return - early) {
        raise_soon(L);
        return;
    }
    static const char text[] =
        "\nlimax: what runs (a compiled loop?) did not stop after Ctrl-C: stopping hard. "
        "Written files are complete.\n";
    write_to_stderr(text, sizeof text - 1);
    stop_with_message();
}

sigset_t interrupts() {
    sigset_t set;
    sigemptyset(&set);
    sigaddset(&set, SIGINT);
    sigaddset(&set, SIGTERM);
    return set;
}

// Blocks these signals on this thread for the length of a scope.
class without_interrupts {
public:
    without_interrupts() {
        const sigset_t set = interrupts();
        pthread_sigmask(SIG_BLOCK, &set, &before_);
    }
    ~without_interrupts() { pthread_sigmask(SIG_SETMASK, &before_, nullptr); }
    without_interrupts(const without_interrupts&) = delete;
    without_interrupts& operator=(const without_interrupts&) = delete;

private:
    sigset_t before_{};
};

int lua_raise_if_interrupted(lua_State* L) { return interrupted() ? raise_interrupt(L) : 0; }

int lua_status(lua_State* L) { return push(L, interrupt_status()); }

int lua_rearm(lua_State* L) {
    acknowledge_interrupt();
    pressed = false;
    return push(L, pressed_signal != SIGTERM);
}

int lua_on_hard_stop(lua_State* L) {
    // none is ever freed: the handler may be about to read it
    static std::deque<std::string> lines;
    hard_stop_message = nullptr;
    if (!lua_isnoneornil(L, 1))
        hard_stop_message = &lines.emplace_back(std::string(text_argument(L, 1)) + "\n");
    return 0;
}

int lua_watch(lua_State* L) {
    static std::set<std::string> names;
    const std::string* const before = watched;
    const std::string* const now =
        lua_isnoneornil(L, 1) ? nullptr : &*names.insert(std::string(text_argument(L, 1))).first;
    watched_since = monotonic_nanoseconds();
    watched = now;
    if (now != nullptr && !armed) {
        const without_interrupts blocked;
        if (!pending) arm(time_to_report);
    }
    if (before == nullptr) return 0;
    return push(L, *before);
}

int interrupt_text(lua_State* L) { return push(L, "interrupted"); }

void handle(int signal, void (*handler)(int)) {
    struct sigaction action {};
    action.sa_handler = handler;
    // an interrupt sets an alarm of its own, which no other may replace
    action.sa_mask = interrupts();
    // no SA_RESTART for Ctrl-C: a read that waits for input must return to Lua
    action.sa_flags = signal == SIGALRM ? SA_RESTART : 0;
    sigaction(signal, &action, nullptr);
}

}  // namespace

void install_signals(lua_State* L) {
    main_thread = pthread_self();
    state = L;
    handle(SIGINT, on_interrupt);
    handle(SIGTERM, on_interrupt);
    handle(SIGALRM, on_alarm);
}

void release_signals() {
    const without_interrupts blocked;
    if (lua_State* const L = state.exchange(nullptr)) lua_sethook(L, nullptr, 0, 0);
    pending = false;
}

void settle_status(int status) { exit_status = status; }

int interrupt_status() { return status_of_signal + pressed_signal; }

bool interrupted() { return pending; }

void acknowledge_interrupt() {
    const without_interrupts blocked;
    if (!pending) return;
    if (lua_State* const L = state) lua_sethook(L, nullptr, 0, 0);
    limax_interrupt_clear();
    alarm(0);
    armed = false;
    watched = nullptr;
    pending = false;
}

bool was_interrupted() { return pressed; }

void set_hook(lua_State* L, lua_Hook hook, int mask, int count) {
    const without_interrupts blocked;
    if (!pending) lua_sethook(L, hook, mask, count);
}

void push_interrupt(lua_State* L) { lua_getfield(L, LUA_REGISTRYINDEX, interrupt_key); }

int raise_interrupt(lua_State* L) {
    push_interrupt(L);
    return lua_error(L);
}

void open_signals(lua_State* L) {
    lua_newtable(L);
    lua_newtable(L);
    add_function<interrupt_text>(L, "__tostring");
    lua_setmetatable(L, -2);
    lua_setfield(L, LUA_REGISTRYINDEX, interrupt_key);

    push_interrupt(L);
    lua_setfield(L, -2, "interrupt");
    add_function<lua_raise_if_interrupted>(L, "raise_if_interrupted");
    lua_newtable(L);
    add_function<lua_rearm>(L, "rearm");
    add_function<lua_status>(L, "status");
    add_function<lua_on_hard_stop>(L, "on_hard_stop");
    add_function<lua_watch>(L, "watch");
    lua_setfield(L, -2, "signal");
}

}  // namespace limax::host
