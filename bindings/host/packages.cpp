// packages.cpp: where limax's own files are and how `require` finds them: "limax.engine..." in
// bindings/engine/, "limax.commands.NAME" in scripts/commands/, every other "limax.ROOM.NAME" in
// scripts/lib/; and the public modules that have names of their own.
#include "packages.h"

#include <cstdlib>
#include <filesystem>
#include <stdexcept>

#include "guard.h"

namespace limax::host {
namespace {

namespace fs = std::filesystem;

bool has_scripts(const fs::path& folder) {
    std::error_code problem;
    return fs::is_regular_file(folder / "scripts" / "lib" / "main.lua", problem);
}

bool begins(const std::string& text, const char* beginning) {
    return text.rfind(beginning, 0) == 0;
}

// Modules that users' scripts may name; other names may change.
constexpr struct {
    const char* name;
    const char* file;
} public_modules[] = {
    {"limax", "scripts/lib/limax.lua"},
    {"limax.engine", "bindings/engine/engine.lua"},
    {"limax.fitness", "scripts/lib/experiment/fitness.lua"},
    {"limax.scenes", "scripts/lib/settings/scenes.lua"},
    {"limax.selection", "scripts/lib/experiment/selection.lua"},
    {"limax.supervise", "scripts/lib/supervise/supervise.lua"},
    {"limax.test", "scripts/lib/tools/test/test.lua"},
};

// The file of one of limax's modules below home; empty for any other module.
std::string module_file(const std::string& module) {
    for (const auto& each : public_modules)
        if (module == each.name) return each.file;
    if (!begins(module, "limax.")) return {};
    std::string rest = module.substr(6);
    // only lower case, digits and dots: no path outside of the folder
    bool after_dot = true;
    for (char& letter : rest) {
        const bool word =
            (letter >= 'a' && letter <= 'z') || (letter >= '0' && letter <= '9') || letter == '_';
        if (!word && (letter != '.' || after_dot)) return {};
        after_dot = letter == '.';
        if (after_dot) letter = '/';
    }
    if (after_dot) return {};
    if (begins(rest, "engine/")) return "bindings/" + rest + ".lua";
    if (begins(rest, "commands/")) return "scripts/" + rest + ".lua";
    return "scripts/lib/" + rest + ".lua";
}

// A searcher of Lua 5.1: takes a module's name, returns its loader, or a text with the places it
// searched.
int search(lua_State* L) {
    const std::string module = luaL_checkstring(L, 1);
    const std::string file = module_file(module);
    if (file.empty()) return 0;
    const std::string path = std::string(lua_tostring(L, lua_upvalueindex(1))) + "/" + file;
    std::error_code problem;
    if (!fs::is_regular_file(path, problem)) {
        const std::string text = "\n\tno file '" + path + "'";
        lua_pushlstring(L, text.data(), text.size());
        return 1;
    }
    if (luaL_loadfilex(L, path.c_str(), "t") != 0) return lua_error(L);
    return 1;
}

}  // namespace

std::string find_executable() {
    std::error_code problem;
    const fs::path path = fs::read_symlink("/proc/self/exe", problem);
    if (problem) throw std::runtime_error("cannot read /proc/self/exe: " + problem.message());
    return path.string();
}

std::string find_home(const std::string& executable) {
    std::error_code problem;
    if (const char* const named = secure_getenv("LIMAX_HOME"); named != nullptr && *named != '\0') {
        if (!has_scripts(named))
            throw std::runtime_error("LIMAX_HOME is " + std::string(named) +
                                     ", which contains no scripts/lib/main.lua");
        return fs::canonical(named, problem).string();
    }
    const fs::path beside = fs::path(executable).parent_path().parent_path();
    const fs::path places[] = {beside / "share" / "limax", LIMAX_SOURCE_DIR, beside};
    std::string searched;
    for (const fs::path& place : places) {
        if (has_scripts(place)) return fs::canonical(place, problem).string();
        searched += "\n  " + place.string();
    }
    throw std::runtime_error(
        "limax's own scripts were not found; set LIMAX_HOME to the folder that contains scripts/. "
        "Searched:" +
        searched);
}

void install_searchers(lua_State* L, const std::string& home) {
    lua_getglobal(L, "package");
    lua_pushliteral(L, "");
    lua_setfield(L, -2, "path");
    lua_pushliteral(L, "");
    lua_setfield(L, -2, "cpath");
    // preload, ours, Lua files along package.path
    lua_getfield(L, -1, "loaders");
    lua_rawgeti(L, -1, 2);
    lua_newtable(L);
    lua_rawgeti(L, -3, 1);
    lua_rawseti(L, -2, 1);
    lua_pushlstring(L, home.data(), home.size());
    lua_pushcclosure(L, guarded<search>, 1);
    lua_rawseti(L, -2, 2);
    lua_pushvalue(L, -2);
    lua_rawseti(L, -2, 3);
    lua_setfield(L, -4, "loaders");
    lua_pop(L, 3);
}

}  // namespace limax::host
