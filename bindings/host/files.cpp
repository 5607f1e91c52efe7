// files.cpp: host.file: files and folders for scripts, as host.lua describes them. Every function
// returns true (or its value), or nil and a message with the path and the system's reason.
#include <sys/stat.h>

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

constexpr std::size_t largest_private = 65536;  // bytes
const char* const lock_type = "limax.lock";

int lua_read_private(lua_State* L) {
    const std::string path = path_argument(L, 1);
    const descriptor file(open_path(path, O_RDONLY | O_NONBLOCK));
    if (!file.fine()) fail("open", path);
    // of the opened file; the path may name another one by now
    struct stat found {};
    if (fstat(file.get(), &found) != 0) fail("look at", path);
    if (!S_ISREG(found.st_mode)) throw failure(path + " is not a regular file");
    if (found.st_uid != geteuid()) throw failure(path + " belongs to another user");
    if ((found.st_mode & (S_IRWXG | S_IRWXO)) != 0)
        throw failure(path + " is accessible to other users; run: chmod 600 " + path);
    std::string text(largest_private + 1, '\0');
    const ssize_t count = persist([&] { return read(file.get(), text.data(), text.size()); });
    if (count < 0) fail("read", path);
    text.resize(static_cast<std::size_t>(count));
    if (text.size() > largest_private) throw failure(path + " is longer than 64 KiB: not a key");
    return push(L, text);
}

int lua_create_private(lua_State* L) {
    return push(L, create_private(path_argument(L, 1), text_argument(L, 2)));
}

int lua_write_atomic(lua_State* L) {
    write_atomic(path_argument(L, 1), text_argument(L, 2));
    return push(L, true);
}

int lua_append(lua_State* L) {
    const mode_t mode = lua_toboolean(L, 3) != 0 ? private_mode : file_mode;
    append(path_argument(L, 1), lines_argument(L, 2), mode);
    return push(L, true);
}

int lua_mkdir(lua_State* L) {
    // a slash at the end would name an empty folder
    const fs::path path = path_argument(L, 1);
    std::error_code problem;
    fs::create_directories(path.has_filename() ? path : path.parent_path(), problem);
    if (problem)
        throw failure("cannot make the folder " + path.string() + ": " + problem.message());
    return push(L, true);
}

int lua_exists(lua_State* L) {
    std::error_code problem;
    const char* const path = path_argument(L, 1);
    const bool of_link = lua_toboolean(L, 2) != 0;
    const fs::file_status status =
        of_link ? fs::symlink_status(path, problem) : fs::status(path, problem);
    if (!fs::exists(status)) return 0;
    if (fs::is_directory(status)) return push(L, "folder");
    return push(L, fs::is_regular_file(status) ? "file" : "other");
}

int lua_list(lua_State* L) {
    const char* const path = path_argument(L, 1);
    std::set<std::string> names;
    try {
        for (const auto& entry : fs::directory_iterator(path))
            names.insert(entry.path().filename().string());
    } catch (const fs::filesystem_error& problem) {
        throw failure("cannot list " + std::string(path) + ": " + problem.code().message());
    }
    lua_createtable(L, static_cast<int>(names.size()), 0);
    int count = 0;
    for (const std::string& name : names) {
        push(L, name);
        lua_rawseti(L, -2, ++count);
    }
    return 1;
}

int lua_truncate(lua_State* L) {
    const char* const path = path_argument(L, 1);
    const lua_Number size = luaL_checknumber(L, 2);
    luaL_argcheck(L, size >= 0 && size <= 9007199254740992.0, 2,
                  "a size in bytes must not be negative");
    if (persist([&] { return truncate(path, static_cast<off_t>(size)); }) != 0)
        fail("truncate", path);
    sync_path(path, 0);
    return push(L, true);
}

int lua_remove(lua_State* L) {
    const char* const path = path_argument(L, 1);
    if (remove(path) != 0) fail("remove", path);
    return push(L, true);
}

int lua_rename(lua_State* L) {
    const char* const from = path_argument(L, 1);
    const char* const to = path_argument(L, 2);
    if (rename(from, to) != 0) fail("rename", std::string(from) + " to " + to);
    sync_path(folder_of(to), O_DIRECTORY);
    return push(L, true);
}

// From the root, without "." and ".."; links are kept.
int lua_absolute(lua_State* L) {
    std::string path = fs::absolute(path_argument(L, 1)).lexically_normal().string();
    if (path.size() > 1 && path.back() == '/') path.pop_back();
    return push(L, path);
}

int lock_free(lua_State* L) {
    auto* const held = static_cast<int*>(luaL_checkudata(L, 1, lock_type));
    if (*held >= 0) close(*held);
    *held = -1;
    return 0;
}

[[noreturn]] void fail_lock(const std::string& path) {
    if (errno == EAGAIN || errno == EACCES)
        throw failure(path + " is in use by another process", "locked");
    fail("lock", path);
}

// The lock belongs to the descriptor and ends with it; anybody who may read the file can ask about
// it.
int lua_lock(lua_State* L) {
    const std::string path = path_argument(L, 1);
    descriptor file(open_own(path, O_RDWR | O_CREAT));
    struct flock whole {};  // the whole file
    whole.l_type = F_WRLCK;
    if (fcntl(file.get(), F_OFD_SETLK, &whole) != 0) fail_lock(path);
    auto* const held = static_cast<int*>(lua_newuserdata(L, sizeof(int)));
    *held = file.release();
    luaL_getmetatable(L, lock_type);
    lua_setmetatable(L, -2);
    return 1;
}

// Whether a process, maybe this one, has locked the file.
int lua_is_locked(lua_State* L) {
    const std::string path = path_argument(L, 1);
    const descriptor file(open_own(path, O_RDONLY | O_NONBLOCK));
    struct flock whole {};  // the whole file
    whole.l_type = F_WRLCK;
    if (fcntl(file.get(), F_OFD_GETLK, &whole) != 0) fail_lock(path);
    return push(L, whole.l_type != F_UNLCK);
}

// ---- temporary folders ----

std::set<std::string>& temporary_folders() {
    static std::set<std::string> of_this_process;
    return of_this_process;
}

// The path is absolute, as children may run elsewhere.
int lua_temporary(lua_State* L) {
    const char* const named = secure_getenv("TMPDIR");
    const fs::path base = fs::absolute(named != nullptr && *named != '\0' ? named : "/tmp");
    std::string path = (base / "limax-XXXXXX").string();
    if (mkdtemp(path.data()) == nullptr) fail("make a folder in", base.string());
    temporary_folders().insert(path);
    return push(L, path);
}

int lua_remove_temporary(lua_State* L) {
    const std::string path = path_argument(L, 1);
    luaL_argcheck(L, temporary_folders().count(path) != 0, 1,
                  "not a temporary folder of this process");
    std::error_code problem;
    fs::remove_all(path, problem);
    if (problem) throw failure("cannot remove " + path + ": " + problem.message());
    temporary_folders().erase(path);
    return push(L, true);
}

}  // namespace

void remove_temporaries() noexcept {
    std::error_code ignored;
    for (const std::string& path : temporary_folders()) fs::remove_all(path, ignored);
    temporary_folders().clear();
}

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
    add_function<lua_create_private>(L, "create_private");
    add_function<lua_read_private>(L, "read_private");
    add_function<lua_truncate>(L, "truncate");
    add_function<lua_remove>(L, "remove");
    add_function<lua_rename>(L, "rename");
    add_function<lua_absolute>(L, "absolute");
    add_function<lua_lock>(L, "lock");
    add_function<lua_is_locked>(L, "is_locked");
    add_function<lua_temporary>(L, "temporary");
    add_function<lua_remove_temporary>(L, "remove_temporary");
    add_writer(L);
    lua_setfield(L, -2, "file");
}

}  // namespace limax::host
