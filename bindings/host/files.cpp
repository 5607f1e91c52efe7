// files.cpp: files and folders for scripts. Every function returns true (or its value), or nil and
// a message with the path and the system's reason.
#include <sys/file.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "durable.h"
#include "guard.h"
#include "modules.h"

namespace limax::host {
namespace {

constexpr mode_t folder_mode = 0777;      // less the umask
constexpr off_t largest_private = 65536;  // bytes
const char* const lock_type = "limax.lock";

// The text of a small file that only its owner, this process's user, may read or write: a key.
std::string read_private(const std::string& path) {
    const descriptor file(open_path(path, O_RDONLY | O_NONBLOCK));
    if (!file.fine()) fail("open", path);
    // of the opened file; the path may name another one by now
    struct stat found {};
    if (fstat(file.get(), &found) != 0) fail("look at", path);
    if (!S_ISREG(found.st_mode)) throw system_problem{path + " is not a regular file"};
    if (found.st_uid != geteuid()) throw system_problem{path + " belongs to another user"};
    if ((found.st_mode & (S_IRWXG | S_IRWXO)) != 0)
        throw system_problem{path + " is accessible to other users; run: chmod 600 " + path};
    if (found.st_size > largest_private)
        throw system_problem{path + " is longer than 64 KiB: not a key"};
    std::string text(static_cast<std::size_t>(found.st_size), '\0');
    std::size_t have = 0;
    while (have < text.size()) {
        const ssize_t count =
            persist([&] { return read(file.get(), text.data() + have, text.size() - have); });
        if (count < 0) fail("read", path);
        if (count == 0) break;
        have += static_cast<std::size_t>(count);
    }
    text.resize(have);
    return text;
}

// Makes the folder and those above it, where they are missing.
void make_folder(const std::string& path) {
    struct stat found {};
    if (stat(path.c_str(), &found) == 0) {
        if (S_ISDIR(found.st_mode)) return;
        errno = ENOTDIR;
        fail("make the folder", path);
    }
    const std::string above = folder_of(path.substr(0, path.find_last_not_of('/') + 1));
    if (above != path && above != "." && above != "/") make_folder(above);
    if (mkdir(path.c_str(), folder_mode) != 0 && errno != EEXIST) fail("make the folder", path);
}

std::vector<std::string> list_folder(const std::string& path) {
    std::vector<std::string> names;
    try {
        for (const auto& entry : std::filesystem::directory_iterator(path))
            names.push_back(entry.path().filename().string());
    } catch (const std::filesystem::filesystem_error& problem) {
        throw system_problem{"cannot list " + path + ": " + problem.code().message()};
    }
    std::sort(names.begin(), names.end());
    return names;
}

// Ends a Lua function: true, or nil and the message of a system_problem.
template <typename work>
int answer(lua_State* L, work&& try_it) {
    std::string message;
    try {
        try_it();
        lua_pushboolean(L, 1);
        return 1;
    } catch (const system_problem& problem) {
        message = problem.message;
    }
    return push_failure(L, message);
}

int lua_write_atomic(lua_State* L) {
    const std::string path = path_argument(L, 1);
    const std::string_view text = text_argument(L, 2);
    return answer(L, [&] { write_atomic(path, {&text, 1}); });
}

// append(path, text[, private]): if private, only its owner may access a file that it creates
int lua_append(lua_State* L) {
    const std::string path = path_argument(L, 1);
    const std::string_view text = text_argument(L, 2);
    luaL_argcheck(L, !text.empty() && text.back() == '\n', 2,
                  "only whole lines are appended: the text must end in a line break");
    const mode_t mode = lua_toboolean(L, 3) != 0 ? private_mode : file_mode;
    return answer(L, [&] { append(path, text, mode); });
}

int lua_mkdir(lua_State* L) {
    const std::string path = path_argument(L, 1);
    return answer(L, [&] { make_folder(path); });
}

// exists(path) -> "file" | "folder" | nil; anything but a folder counts as a file
int lua_exists(lua_State* L) {
    struct stat found {};
    if (stat(path_argument(L, 1), &found) != 0)
        lua_pushnil(L);
    else
        lua_pushstring(L, S_ISDIR(found.st_mode) ? "folder" : "file");
    return 1;
}

int lua_list(lua_State* L) {
    const std::string path = path_argument(L, 1);
    std::vector<std::string> names;
    const int results = answer(L, [&] { names = list_folder(path); });
    if (results != 1) return results;
    lua_createtable(L, static_cast<int>(names.size()), 0);
    for (std::size_t i = 0; i < names.size(); ++i) {
        lua_pushlstring(L, names[i].data(), names[i].size());
        lua_rawseti(L, -2, static_cast<int>(i + 1));
    }
    return 1;
}

int lua_truncate(lua_State* L) {
    const std::string path = path_argument(L, 1);
    const lua_Number size = luaL_checknumber(L, 2);
    luaL_argcheck(L, size >= 0 && size <= 9007199254740992.0, 2,
                  "a size in bytes must not be negative");
    return answer(L, [&] {
        if (persist([&] { return truncate(path.c_str(), static_cast<off_t>(size)); }) != 0)
            fail("truncate", path);
        sync_path(path, 0);
    });
}

// read_private(path) -> text | nil, message
int lua_read_private(lua_State* L) {
    const std::string path = path_argument(L, 1);
    std::string text;
    const int results = answer(L, [&] { text = read_private(path); });
    if (results != 1) return results;
    lua_pushlstring(L, text.data(), text.size());
    return 1;
}

// remove(path): a file or an empty folder
int lua_remove(lua_State* L) {
    const std::string path = path_argument(L, 1);
    return answer(L, [&] {
        if (remove(path.c_str()) != 0) fail("remove", path);
    });
}

int lua_rename(lua_State* L) {
    const std::string from = path_argument(L, 1);
    const std::string to = path_argument(L, 2);
    return answer(L, [&] {
        if (rename(from.c_str(), to.c_str()) != 0) fail("rename", from + " to " + to);
        sync_path(folder_of(to), O_DIRECTORY);
    });
}

// absolute(path): from the root, without "." and ".."; links are kept
int lua_absolute(lua_State* L) {
    const std::filesystem::path path =
        std::filesystem::absolute(path_argument(L, 1)).lexically_normal();
    std::string text = path.string();
    if (text.size() > 1 && text.back() == '/') text.pop_back();
    lua_pushlstring(L, text.data(), text.size());
    return 1;
}

// The lock is the open descriptor: it ends with the handle and with the process.
int lock_free(lua_State* L) {
    auto* const held = static_cast<int*>(luaL_checkudata(L, 1, lock_type));
    if (*held >= 0) close(*held);
    *held = -1;
    return 0;
}

// lock(path) -> handle | nil, message: locks a folder or a file (created if missing) for this
// process
int lua_lock(lua_State* L) {
    const std::string path = path_argument(L, 1);
    auto* const held = static_cast<int*>(lua_newuserdata(L, sizeof(int)));
    *held = -1;
    luaL_getmetatable(L, lock_type);
    lua_setmetatable(L, -2);
    const int results = answer(L, [&] {
        struct stat found {};
        const bool missing = stat(path.c_str(), &found) != 0 && errno == ENOENT;
        descriptor file(open_path(path, missing ? O_RDWR | O_CREAT : O_RDONLY));
        if (!file.fine()) fail("open", path);
        if (flock(file.get(), LOCK_EX | LOCK_NB) != 0) {
            if (errno == EWOULDBLOCK) throw system_problem{path + " is in use by another process"};
            fail("lock", path);
        }
        *held = file.release();
    });
    if (results != 1) return results;
    lua_pop(L, 1);
    return 1;
}

}  // namespace

void open_files(lua_State* L) {
    luaL_newmetatable(L, lock_type);
    add_function<lock_free>(L, "free");
    add_function<lock_free>(L, "__gc");
    lua_pushvalue(L, -1);
    lua_setfield(L, -2, "__index");
    lua_pop(L, 1);

    lua_newtable(L);
    add_function<lua_write_atomic>(L, "write_atomic");
    add_function<lua_append>(L, "append");
    add_function<lua_mkdir>(L, "mkdir");
    add_function<lua_exists>(L, "exists");
    add_function<lua_list>(L, "list");
    add_function<lua_read_private>(L, "read_private");
    add_function<lua_truncate>(L, "truncate");
    add_function<lua_remove>(L, "remove");
    add_function<lua_rename>(L, "rename");
    add_function<lua_absolute>(L, "absolute");
    add_function<lua_lock>(L, "lock");
    add_writer(L);
    lua_setfield(L, -2, "file");
}

}  // namespace limax::host
