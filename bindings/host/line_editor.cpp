// line_editor.cpp: libedit at the prompt. We read its input with short waits, so that Ctrl-C is
// noticed at once, and redraw after a resize or a return from the background.
#include <histedit.h>
#include <poll.h>
#include <termios.h>
#include <unistd.h>

#include <cerrno>
#include <clocale>
#include <csignal>
#include <cstdio>
#include <cwchar>
#include <memory>
#include <string>
#include <string_view>

#include "guard.h"
#include "modules.h"
#include "signals.h"

namespace limax::host {
namespace {

// Time between checks for Ctrl-C.
constexpr int wait_slice = 100;  // ms
constexpr int longest_history = 10000;

// arguments of `read`, which stay on its stack while a line is read
constexpr int complete_argument = 2;

volatile std::sig_atomic_t resized = 0;
volatile std::sig_atomic_t continued = 0;
volatile std::sig_atomic_t reading = 0;
termios before_reading{};  // written while `reading` is 0

struct {
    std::unique_ptr<EditLine, decltype(&el_end)> line{nullptr, el_end};
    std::unique_ptr<History, decltype(&history_end)> history{nullptr, history_end};
    std::string prompt;
    lua_State* L = nullptr;  // while a line is read
} the_editor;

void on_change(int signal) { (signal == SIGWINCH ? resized : continued) = 1; }

// Restores the terminal before the process ends or stops. Async-signal-safe.
void on_leaving(int signal) {
    if (reading != 0) tcsetattr(STDIN_FILENO, TCSANOW, &before_reading);
    // now the default action; after a stop this returns
    raise(signal);
    continued = 1;
}

void follow_terminal() {
    struct sigaction action {};
    sigemptyset(&action.sa_mask);
    action.sa_flags = SA_RESTART;
    action.sa_handler = on_change;
    for (const int signal : {SIGWINCH, SIGCONT}) sigaction(signal, &action, nullptr);
    action.sa_handler = on_leaving;
    action.sa_flags = static_cast<int>(SA_RESTART | SA_RESETHAND | SA_NODEFER);
    for (const int signal : {SIGTERM, SIGHUP, SIGTSTP}) sigaction(signal, &action, nullptr);
}

void redraw(EditLine* line) {
    if (continued != 0) {
        // the shell has reset the terminal, and the handlers were reset by their first signal
        follow_terminal();
        el_set(line, EL_PREP_TERM, 0);
        el_set(line, EL_PREP_TERM, 1);
    }
    // libedit assumes that the cursor is at the beginning of the line
    std::fputs("\r", stdout);
    if (resized != 0) el_resize(line);
    resized = 0;
    continued = 0;
    el_set(line, EL_REFRESH);
}

// Reads one byte of the terminal: 1, 0 at its end, -1 on Ctrl-C or failure.
int read_byte(EditLine* line, char* byte) {
    for (;;) {
        if (interrupted()) return -1;
        if (resized != 0 || continued != 0) redraw(line);
        pollfd gate{STDIN_FILENO, POLLIN, 0};
        const int ready = poll(&gate, 1, wait_slice);
        if (ready == 0 || (ready < 0 && errno == EINTR)) continue;
        const ssize_t count = read(STDIN_FILENO, byte, 1);
        if (count >= 0) return static_cast<int>(count);
        if (errno != EINTR) return -1;
    }
}

// Called by libedit for a key.
int read_key(EditLine* line, wchar_t* key) {
    std::mbstate_t state{};
    for (;;) {
        char byte = 0;
        const int count = read_byte(line, &byte);
        if (count != 1) return count;
        // NOLINTNEXTLINE(concurrency-mt-unsafe): the state is our own
        const std::size_t length = std::mbrtowc(key, &byte, 1, &state);
        if (length == 0 || length == 1) return 1;
        // not UTF-8: dropped
        if (length == static_cast<std::size_t>(-1)) state = std::mbstate_t{};
    }
}

char* prompt_of(EditLine*) { return the_editor.prompt.data(); }

// Calls complete(text before the cursor), which returns a text to insert and one to show.
unsigned char complete(EditLine* line, int) {
    const LineInfo* const typed = el_line(line);
    lua_State* const L = the_editor.L;
    lua_pushvalue(L, complete_argument);
    lua_pushlstring(L, typed->buffer, static_cast<std::size_t>(typed->cursor - typed->buffer));
    // no error may pass through libedit's frames: on an error the terminal beeps
    if (lua_pcall(L, 1, 2, 0) != 0) {
        lua_pop(L, 1);
        return CC_ERROR;
    }
    unsigned char done = CC_REFRESH_BEEP;
    if (const char* const insert = lua_tostring(L, -2))
        done = el_insertstr(line, insert) == 0 ? CC_REFRESH : CC_ERROR;
    if (const char* const list = lua_tostring(L, -1)) {
        std::fprintf(stdout, "\n%s\n", list);
        done = CC_REDISPLAY;
    }
    lua_pop(L, 2);
    return done;
}

void begin() {
    auto& now = the_editor;
    // how letters are read and shown at the prompt; LuaJIT and numbers do not depend on it
    // NOLINTNEXTLINE(concurrency-mt-unsafe): before the first line is read
    std::setlocale(LC_CTYPE, "C.UTF-8");
    now.line.reset(el_init("limax", stdin, stdout, stderr));
    now.history.reset(history_init());
    if (!now.line || !now.history) throw std::runtime_error("cannot begin libedit");
    HistEvent event{};
    history(now.history.get(), &event, H_SETSIZE, longest_history);
    history(now.history.get(), &event, H_SETUNIQUE, 1);
    EditLine* const line = now.line.get();
    el_set(line, EL_PROMPT, prompt_of);
    el_set(line, EL_EDITOR, "emacs");
    el_set(line, EL_HIST, history, now.history.get());
    el_set(line, EL_GETCFN, read_key);
    el_set(line, EL_ADDFN, "limax-complete", "complete the text before the cursor", complete);
    el_set(line, EL_BIND, "^I", "limax-complete", nullptr);
    el_set(line, EL_BIND, "^R", "em-inc-search-prev", nullptr);
    el_source(line, nullptr);
    follow_terminal();
}

int lua_read(lua_State* L) {
    const std::string_view prompt = text_argument(L, 1);
    luaL_checktype(L, complete_argument, LUA_TFUNCTION);
    auto& now = the_editor;
    if (!now.line) begin();
    now.prompt = prompt;
    now.L = L;
    tcgetattr(STDIN_FILENO, &before_reading);
    reading = 1;
    // libedit would do it after showing the prompt, and keys in between would be echoed twice
    el_set(now.line.get(), EL_PREP_TERM, 1);
    int count = 0;
    const char* const line = el_gets(now.line.get(), &count);
    reading = 0;
    now.L = nullptr;
    if (interrupted()) {
        std::fputs("^C", stdout);
        std::fflush(stdout);
        return raise_interrupt(L);
    }
    if (line == nullptr || count <= 0) {
        lua_pushnil(L);
        return 1;
    }
    std::string_view text = line;
    if (!text.empty() && text.back() == '\n') text.remove_suffix(1);
    return push(L, text);
}

int lua_remember(lua_State* L) {
    const char* const text = luaL_checkstring(L, 1);
    HistEvent event{};
    if (!the_editor.line) begin();
    history(the_editor.history.get(), &event, H_ENTER, text);
    return 0;
}

}  // namespace

void open_line_editor(lua_State* L) {
    lua_newtable(L);
    add_function<lua_read>(L, "read");
    add_function<lua_remember>(L, "remember");
    lua_setfield(L, -2, "line_editor");
}

}  // namespace limax::host
