// temporary.cpp: folders for files of this process that nobody else may read or replace. They are
// removed with everything in them at the latest when the process ends by itself.
#include <cstdlib>
#include <filesystem>
#include <set>
#include <string>
#include <system_error>

#include "durable.h"
#include "guard.h"
#include "modules.h"

namespace limax::host {
namespace {

namespace fs = std::filesystem;

std::set<std::string>& folders() {
    static std::set<std::string> of_this_process;
    return of_this_process;
}

// temporary(): the path of a new folder, absolute, as children may run elsewhere
int lua_temporary(lua_State* L) {
    const char* const named = secure_getenv("TMPDIR");
    const fs::path base = fs::absolute(named != nullptr && *named != '\0' ? named : "/tmp");
    std::string path = (base / "limax-XXXXXX").string();
    if (mkdtemp(path.data()) == nullptr) fail("make a folder in", base.string());
    folders().insert(path);
    return push(L, path);
}

// remove_temporary(path): with everything in it
int lua_remove_temporary(lua_State* L) {
    const std::string path = path_argument(L, 1);
    luaL_argcheck(L, folders().count(path) != 0, 1, "not a temporary folder of this process");
    std::error_code problem;
    fs::remove_all(path, problem);
    if (problem) throw failure("cannot remove " + path + ": " + problem.message());
    folders().erase(path);
    return push(L, true);
}

}  // namespace

void remove_temporaries() noexcept {
    std::error_code ignored;
    for (const std::string& path : folders()) fs::remove_all(path, ignored);
    folders().clear();
}

void add_temporaries(lua_State* L) {
    add_function<lua_temporary>(L, "temporary");
    add_function<lua_remove_temporary>(L, "remove_temporary");
}

}  // namespace limax::host
