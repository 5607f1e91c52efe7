// parser_process.cpp: the process in which a parser of a language model's text runs, with a socket
// as its standard input and output. Before it reads anything it gives up the right to open files
// and limits its memory and time. The parser finds string, table, math, json and little more.
#include <sys/resource.h>
#include <sys/time.h>
#include <unistd.h>

#include <cmath>
#include <cstddef>
#include <fstream>
#include <iostream>
#include <iterator>
#include <memory>
#include <string>

#include "guard.h"
#include "json.h"
#include "modules.h"

namespace limax::host {
namespace {

// What a parser may use beyond the executable itself. A good one takes about a thousandth.
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

// Takes the request as light userdata and an error; replaces the request by an answer with the
// problem.
int describe(lua_State* L) {
    std::string& answer = *static_cast<std::string*>(lua_touserdata(L, 1));
    lua_newtable(L);
    if (lua_type(L, 2) == LUA_TSTRING)
        set(L, "problem", text_at(L, 2).substr(0, longest_error));
    else
        set(L, "problem", std::string("an error that is a ") + luaL_typename(L, 2));
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

int run_parser_process(double seconds) {
    if (!confine(seconds)) return 1;
    std::cout << answer_to({std::istreambuf_iterator<char>(std::cin), {}}) << std::flush;
    return std::cout ? 0 : 1;
}

}  // namespace limax::host
