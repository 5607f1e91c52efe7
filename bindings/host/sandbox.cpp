// sandbox.cpp: runs a parser of a language model's text in a Lua state of its own: text in, a plain
// value out. That state has no way to files, processes, the engine, bytecode or the main state; its
// memory, instructions and time are limited, and nothing in it can outlive the limits.
#include "sandbox.h"

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <string>

#include "guard.h"
#include "json.h"
#include "pattern.h"
#include "signals.h"
#include "stack_room.h"

namespace limax::host {
namespace {

using steady = std::chrono::steady_clock;

// What a parser may use by default. A good one takes about a thousandth of each.
constexpr std::size_t most_bytes = std::size_t{64} << 20;
constexpr std::int64_t most_instructions = 200'000'000;  // 2 to 4 s of the interpreter
constexpr double most_seconds = 5;
// Between two looks at the limits: half a microsecond, or that many library calls.
constexpr int instructions_between = 50;
// Longest text that string.rep makes.
constexpr std::size_t longest_repetition = std::size_t{1} << 20;
constexpr std::size_t longest_error = 300;  // bytes of a parser's own message

enum class stop { none, instructions, time, stack, interrupt };

// All of a parser's run that C++ knows of; the allocator's user data, so that a hook finds it.
struct confinement {
    std::size_t bytes = 0;
    std::size_t bytes_most = most_bytes;
    bool out_of_memory = false;
    std::int64_t instructions_left = most_instructions;
    double seconds = most_seconds;
    steady::time_point deadline;
    stack_room room;
    stop stopped = stop::none;

    std::string_view source;
    std::string_view name;
    std::string_view text;
    std::string_view limits;  // JSON

    std::string value;    // JSON of what the parser returned; empty: nil
    std::string message;  // its second result
    std::string note;     // its third
};

confinement& of(lua_State* L) {
    void* mine = nullptr;
    lua_getallocf(L, &mine);
    return *static_cast<confinement*>(mine);
}

void* allocate(void* mine, void* block, std::size_t before, std::size_t after) {
    confinement& here = *static_cast<confinement*>(mine);
    if (block == nullptr) before = 0;
    if (after == 0) {
        here.bytes -= before;
        std::free(block);
        return nullptr;
    }
    if (after > before && here.bytes - before + after > here.bytes_most) {
        here.out_of_memory = true;
        return nullptr;
    }
    void* const made = std::realloc(block, after);
    if (made != nullptr) here.bytes += after - before;
    return made;
}

// Sets the reason to stop, if there is one now.
bool is_over(confinement& here) {
    if (here.stopped != stop::none) return true;
    if (here.instructions_left <= 0) here.stopped = stop::instructions;
    if (steady::now() > here.deadline) here.stopped = stop::time;
    if (interrupted()) here.stopped = stop::interrupt;
    return here.stopped != stop::none;
}

// Once a limit is passed, raises in every further instruction: no pcall of the parser holds it up.
void look(lua_State* L, lua_Debug*) {
    confinement& here = of(L);
    here.instructions_left -= instructions_between;
    if (!here.room.is_there(L)) here.stopped = stop::stack;
    if (!is_over(here)) return;
    lua_sethook(L, look, LUA_MASKCALL | LUA_MASKRET | LUA_MASKCOUNT, 1);
    luaL_error(L, "stopped");
}

// ---- what a parser finds -----------------------------------------------------------------------

// string.rep(text, n [, between]), of bounded length
int repeat(lua_State* L) {
    std::size_t length = 0;
    std::size_t gap = 0;
    const char* const text = luaL_checklstring(L, 1, &length);
    const double times = luaL_checknumber(L, 2);
    const char* const between = luaL_optlstring(L, 3, "", &gap);
    if (!(times >= 1)) {
        lua_pushliteral(L, "");
        return 1;
    }
    if (times * static_cast<double>(length + gap) > static_cast<double>(longest_repetition) ||
        times > static_cast<double>(longest_repetition))
        return luaL_error(L, "string.rep: the result would be longer than 1 MiB");
    std::string made;
    const auto count = static_cast<std::size_t>(times);
    made.reserve(count * (length + gap));
    for (std::size_t i = 0; i < count; ++i) {
        if (i > 0) made.append(between, gap);
        made.append(text, length);
    }
    lua_pushlstring(L, made.data(), made.size());
    return 1;
}

// tostring(value) without addresses, which would differ from run to run
int to_text(lua_State* L) {
    luaL_checkany(L, 1);
    switch (lua_type(L, 1)) {
        case LUA_TNUMBER:
        case LUA_TSTRING: lua_pushvalue(L, 1), lua_tostring(L, -1); return 1;
        case LUA_TBOOLEAN: lua_pushstring(L, lua_toboolean(L, 1) != 0 ? "true" : "false"); return 1;
        default: lua_pushstring(L, luaL_typename(L, 1)); return 1;
    }
}

// string.format(form, ...) of numbers, texts and booleans; upvalue 1 is the library's own
int format(lua_State* L) {
    const std::string_view form = luaL_checkstring(L, 1);
    for (std::size_t i = 0; i + 1 < form.size(); ++i) {
        if (form[i] != '%') continue;
        if (form[++i] == '%') continue;
        const std::size_t letter = form.find_first_not_of("-+ #0123456789.", i);
        if (letter != std::string_view::npos && form[letter] == 'p')
            return luaL_error(L, "string.format: %%p shows addresses");
        i = letter == std::string_view::npos ? form.size() : letter;
    }
    const int count = lua_gettop(L);
    for (int i = 2; i <= count; ++i) {
        const int type = lua_type(L, i);
        if (type != LUA_TNUMBER && type != LUA_TSTRING) {
            lua_pushcfunction(L, guarded<to_text>);
            lua_pushvalue(L, i);
            lua_call(L, 1, 1);
            lua_replace(L, i);
        }
    }
    lua_pushvalue(L, lua_upvalueindex(1));
    lua_insert(L, 1);
    lua_call(L, count, 1);
    return 1;
}

// Called by the pattern matcher from time to time.
void keep_time(lua_State* L) {
    if (is_over(of(L))) luaL_error(L, "stopped");
}

void open_library(lua_State* L, const char* name, lua_CFunction open) {
    lua_pushcfunction(L, open);
    lua_pushstring(L, name);
    lua_call(L, 1, 0);
}

void remove_field(lua_State* L, const char* name) {
    lua_pushnil(L);
    lua_setfield(L, -2, name);
}

// The libraries, less what leads out, what no limit reaches, and what differs from run to run.
void furnish(lua_State* L) {
    static const char* const kept[] = {"assert", "error",    "ipairs", "next",   "pairs",   "pcall",
                                       "select", "tonumber", "type",   "unpack", "_VERSION"};
    open_library(L, "", luaopen_base);
    open_library(L, LUA_STRLIBNAME, luaopen_string);
    open_library(L, LUA_TABLIBNAME, luaopen_table);
    open_library(L, LUA_MATHLIBNAME, luaopen_math);

    lua_newtable(L);
    for (const char* name : kept) {
        lua_getglobal(L, name);
        lua_setfield(L, -2, name);
    }
    add_function<to_text>(L, "tostring");

    lua_getglobal(L, LUA_STRLIBNAME);
    remove_field(L, "dump");
    add_function<repeat>(L, "rep");
    lua_getfield(L, -1, "format");
    lua_pushcclosure(L, guarded<format>, 1);
    lua_setfield(L, -2, "format");
    open_patterns(L, keep_time);
    lua_setfield(L, -2, LUA_STRLIBNAME);

    lua_getglobal(L, LUA_TABLIBNAME);
    lua_setfield(L, -2, LUA_TABLIBNAME);
    lua_getglobal(L, LUA_MATHLIBNAME);
    remove_field(L, "random");
    remove_field(L, "randomseed");
    lua_setfield(L, -2, LUA_MATHLIBNAME);
    open_json(L);
    lua_replace(L, LUA_GLOBALSINDEX);

    // the libraries register themselves where `require` would look
    lua_pushnil(L);
    lua_setfield(L, LUA_REGISTRYINDEX, "_LOADED");
    lua_settop(L, 0);
}

// ---- one run -----------------------------------------------------------------------------------

void take_text(lua_State* L, int index, std::string& into) {
    if (lua_type(L, index) != LUA_TSTRING) return;
    std::size_t length = 0;
    const char* const text = lua_tolstring(L, index, &length);
    into.assign(text, length);
}

// The parser's whole life: loaded, called, its value written as JSON.
int parse(lua_State* L) {
    confinement& here = of(L);
    furnish(L);
    const std::string name(here.name);
    // "t": no bytecode, which could do anything
    if (luaL_loadbufferx(L, here.source.data(), here.source.size(), name.c_str(), "t") != 0)
        return lua_error(L);
    lua_call(L, 0, 1);
    if (!lua_isfunction(L, -1))
        return luaL_error(L, "expected a file that returns a function, got %s",
                          luaL_typename(L, -1));
    lua_pushlstring(L, here.text.data(), here.text.size());
    decode_json(L, here.limits, "limits");
    lua_call(L, 2, 3);
    take_text(L, -2, here.message);
    take_text(L, -1, here.note);
    if (!lua_isnil(L, -3)) here.value = encode_json(L, -3, 0);
    return 0;
}

struct closer {
    void operator()(lua_State* L) const { lua_close(L); }
};

std::string why(lua_State* L, const confinement& here, int status) {
    switch (here.stopped) {
        case stop::instructions:
            return "stopped after " + std::to_string(most_instructions / 1000000) +
                   " million instructions";
        case stop::time: return "stopped after " + std::to_string(here.seconds).substr(0, 4) + " s";
        case stop::stack: return "stack overflow: its recursion has no end";
        case stop::interrupt: return "interrupted";
        case stop::none: break;
    }
    if (status == LUA_ERRMEM || here.out_of_memory)
        return "it needs more than " + std::to_string(here.bytes_most >> 20) + " MB";
    std::string text;
    take_text(L, -1, text);
    if (text.empty()) text = std::string("an error that is a ") + luaL_typename(L, -1);
    return text.substr(0, longest_error);
}

std::string_view text_field(lua_State* L, const char* name) {
    lua_getfield(L, 1, name);
    if (lua_type(L, -1) != LUA_TSTRING) luaL_error(L, "sandbox: expected a text as %s", name);
    std::size_t length = 0;
    const char* const text = lua_tolstring(L, -1, &length);
    return {text, length};
}

double number_field(lua_State* L, const char* name, double most) {
    lua_getfield(L, 1, name);
    const double value = lua_isnil(L, -1) ? most : luaL_checknumber(L, -1);
    lua_pop(L, 1);
    if (!(value > 0 && value <= most))
        luaL_error(L, "sandbox: expected %s above 0 and of at most %f", name, most);
    return value;
}

// sandbox { source, name, text, limits = JSON [, seconds, bytes] }
//     -> true, value|nil, message|nil, note|nil   | false, why it did not come to its end
int run(lua_State* L) {
    luaL_checktype(L, 1, LUA_TTABLE);
    lua_settop(L, 1);
    confinement here;
    here.seconds = number_field(L, "seconds", most_seconds);
    here.bytes_most =
        static_cast<std::size_t>(number_field(L, "bytes", static_cast<double>(most_bytes)));
    here.source = text_field(L, "source");
    here.name = text_field(L, "name");
    here.text = text_field(L, "text");
    here.limits = text_field(L, "limits");
    here.deadline = steady::now() + std::chrono::duration_cast<steady::duration>(
                                        std::chrono::duration<double>(here.seconds));

    std::string problem;
    {
        const std::unique_ptr<lua_State, closer> own(lua_newstate(allocate, &here));
        if (!own) return push_failure(L, "there is no memory for a second Lua state");
        lua_State* const inner = own.get();
        luaJIT_setmode(inner, 0, LUAJIT_MODE_ENGINE | LUAJIT_MODE_OFF);
        lua_sethook(inner, look, LUA_MASKCOUNT, instructions_between);
        // out of memory before the first protected call would end the process: lua_cpcall is one
        const int status = lua_cpcall(inner, guarded<parse>, nullptr);
        lua_sethook(inner, nullptr, 0, 0);
        if (status != 0 || here.stopped != stop::none) problem = why(inner, here, status);
    }
    if (here.stopped == stop::interrupt) return raise_interrupt(L);
    if (!problem.empty()) {
        lua_pushboolean(L, 0);
        lua_pushlstring(L, problem.data(), problem.size());
        return 2;
    }
    lua_pushboolean(L, 1);
    if (here.value.empty())
        lua_pushnil(L);
    else
        decode_json(L, here.value, "what the parser returned");
    for (const std::string* text : {&here.message, &here.note}) {
        if (text->empty())
            lua_pushnil(L);
        else
            lua_pushlstring(L, text->data(), text->size());
    }
    return 4;
}

}  // namespace

void open_sandbox(lua_State* L) { add_function<run>(L, "sandbox"); }

}  // namespace limax::host
