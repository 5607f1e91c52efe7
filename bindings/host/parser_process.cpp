// parser_process.cpp: the process in which a parser of a language model's text runs, with a socket
// as its standard input and output. Before it reads anything it gives up the right to open files
// and limits its memory and time. The parser finds string, table, math, json and little more.
#include <sys/resource.h>
#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <cstdio>
#include <memory>
#include <string>

#include "guard.h"
#include "json.h"
#include "parser_process.h"

namespace limax::host {
namespace {

// What a parser may use beyond the executable itself. A good one takes about a thousandth.
constexpr rlim_t most_bytes = rlim_t{64} << 20;
// A process that outlives its parent, which measures the wall time, ends by this limit.
constexpr rlim_t most_cpu_seconds = 6;
constexpr std::size_t longest_error = 300;  // bytes of a parser's own message
constexpr char out_of_memory[] = R"({"problem":"it needs more than 64 MB"})";

// Bytes of this process's address space; 0: unknown.
rlim_t address_space() {
    std::FILE* const file = std::fopen("/proc/self/statm", "r");
    unsigned long pages = 0;
    if (file == nullptr || std::fscanf(file, "%lu", &pages) != 1) return 0;
    std::fclose(file);
    return rlim_t{pages} * static_cast<rlim_t>(sysconf(_SC_PAGESIZE));
}

bool confine() {
    const rlim_t mapped = address_space();
    if (mapped == 0) return false;
    const struct {
        __rlimit_resource_t resource;
        rlim_t most;
    } limits[] = {{RLIMIT_AS, mapped + most_bytes},
                  {RLIMIT_CPU, most_cpu_seconds},
                  {RLIMIT_NOFILE, 0},
                  {RLIMIT_FSIZE, 0},
                  {RLIMIT_NPROC, 0},
                  {RLIMIT_CORE, 0}};
    for (const auto& each : limits) {
        const rlimit limit{each.most, each.most};
        if (setrlimit(each.resource, &limit) != 0) return false;
    }
    return true;
}

std::string read_all() {
    std::string text;
    char buffer[65536];
    for (;;) {
        const ssize_t count = read(STDIN_FILENO, buffer, sizeof buffer);
        if (count > 0)
            text.append(buffer, static_cast<std::size_t>(count));
        else if (count == 0 || errno != EINTR)
            return text;
    }
}

bool write_all(std::string_view text) {
    while (!text.empty()) {
        const ssize_t count = write(STDOUT_FILENO, text.data(), text.size());
        if (count < 0 && errno != EINTR) return false;
        if (count > 0) text.remove_prefix(static_cast<std::size_t>(count));
    }
    return true;
}

// The libraries of a parser.
void open_libraries(lua_State* L) {
    static const char* const kept[] = {"assert",       "error",        "ipairs",       "next",
                                       "pairs",        "pcall",        "select",       "tonumber",
                                       "type",         "tostring",     "_VERSION",     "unpack",
                                       LUA_STRLIBNAME, LUA_TABLIBNAME, LUA_MATHLIBNAME};
    luaL_openlibs(L);
    lua_newtable(L);
    for (const char* name : kept) {
        lua_getglobal(L, name);
        lua_setfield(L, -2, name);
    }
    open_json(L);
    lua_replace(L, LUA_GLOBALSINDEX);
}

void check_type(lua_State* L, int index, int type, const char* expected) {
    if (lua_type(L, index) != type)
        luaL_error(L, "expected %s, got %s", expected, luaL_typename(L, index));
}

// Takes the request's text as light userdata; replaces it by the answer's.
int parse(lua_State* L) {
    std::string& exchanged = *static_cast<std::string*>(lua_touserdata(L, 1));
    open_libraries(L);
    decode_json(L, exchanged, "the request");
    for (const char* name : {"source", "name", "text", "limits"}) lua_getfield(L, 2, name);
    std::size_t length = 0;
    const char* const source = luaL_checklstring(L, 3, &length);
    // "t": text, no bytecode, which could do anything
    if (luaL_loadbufferx(L, source, length, luaL_checkstring(L, 4), "t") != 0) return lua_error(L);
    lua_call(L, 0, 1);
    check_type(L, -1, LUA_TFUNCTION, "a file that returns a function");
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

// Takes the request as light userdata and an error; replaces the request by an answer with the
// problem.
int describe(lua_State* L) {
    std::string& answer = *static_cast<std::string*>(lua_touserdata(L, 1));
    lua_newtable(L);
    if (lua_type(L, 2) == LUA_TSTRING)
        set_text(L, "problem", std::string_view(lua_tostring(L, 2)).substr(0, longest_error));
    else
        set_text(L, "problem", std::string("an error that is a ") + luaL_typename(L, 2));
    answer = encode_json(L, -1, 0);
    return 0;
}

std::string answer_to(std::string request) {
    struct closer {
        void operator()(lua_State* L) const { lua_close(L); }
    };
    const std::unique_ptr<lua_State, closer> state(luaL_newstate());
    lua_State* const L = state.get();
    if (L == nullptr) return out_of_memory;
    luaJIT_setmode(L, 0, LUAJIT_MODE_ENGINE | LUAJIT_MODE_OFF);
    const int status = lua_cpcall(L, guarded<parse>, &request);
    if (status == 0) return request;
    const std::string_view text = lua_type(L, -1) == LUA_TSTRING ? lua_tostring(L, -1) : "";
    if (status == LUA_ERRMEM || text == "std::bad_alloc" || text == "not enough memory")
        return out_of_memory;
    lua_pushcfunction(L, guarded<describe>);
    lua_pushlightuserdata(L, &request);
    lua_pushvalue(L, -3);
    return lua_pcall(L, 2, 0, 0) == 0 ? request
                                      : R"({"problem":"its error is not a text in UTF-8"})";
}

}  // namespace

int run_parser_process() {
    if (!confine()) return 1;
    return write_all(answer_to(read_all())) ? 0 : 1;
}

}  // namespace limax::host
