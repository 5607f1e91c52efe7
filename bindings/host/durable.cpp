// durable.cpp: atomic writes and appends that are on disk when they return.
#include "durable.h"

#include <sys/stat.h>

#include <atomic>
#include <cstdio>
#include <filesystem>
#include <system_error>

namespace limax::host {

void fail(const char* what, const std::string& path) {
    throw failure(std::string("cannot ") + what + " " + path + ": " +
                  std::generic_category().message(errno));
}

int open_path(const std::string& path, int flags, mode_t mode) {
    return persist([&] { return open(path.c_str(), flags | O_CLOEXEC, mode); });
}

descriptor open_own(const std::string& path, int flags) {
    descriptor file(open_path(path, flags | O_NOFOLLOW));
    if (!file.fine() && errno == ELOOP) throw failure(path + " is a link");
    if (!file.fine()) fail("open", path);
    struct stat found {};
    if (fstat(file.get(), &found) != 0) fail("look at", path);
    if (!S_ISREG(found.st_mode)) throw failure(path + " is not a regular file");
    return file;
}

std::string folder_of(const std::string& path) {
    const std::string folder = std::filesystem::path(path).parent_path().string();
    return folder.empty() ? "." : folder;
}

void sync_path(const std::string& path, int flags) {
    const descriptor at(open_path(path, O_RDONLY | flags));
    if (!at.fine()) fail("open", path);
    // EINVAL: the file system has nothing to sync
    if (persist([&] { return fsync(at.get()); }) != 0 && errno != EINVAL) fail("sync", path);
}

namespace {

void write_all(const descriptor& file, std::string_view text, const std::string& path) {
    while (!text.empty()) {
        const ssize_t written =
            persist([&] { return write(file.get(), text.data(), text.size()); });
        if (written < 0) fail("write", path);
        text.remove_prefix(static_cast<std::size_t>(written));
    }
}

// Writes a file beside `path`, as a rename within a folder is atomic, and gives it this name once
// it is on disk; false where it must be new and the name exists.
bool write_whole(const std::string& path, std::string_view text, mode_t mode, bool must_be_new) {
    static std::atomic<unsigned long> serial = 0;
    const std::string part = folder_of(path) + "/." + path.substr(path.find_last_of('/') + 1) +
                             "." + std::to_string(getpid()) + "-" + std::to_string(++serial) +
                             ".part";
    // of a killed process that had the same number
    unlink(part.c_str());
    const descriptor file(open_path(part, O_WRONLY | O_CREAT | O_EXCL, mode));
    if (!file.fine()) fail("create", path);
    bool done = false;
    try {
        write_all(file, text, path);
        if (persist([&] { return fsync(file.get()); }) != 0) fail("sync", path);
        // unlike a rename, a link replaces nothing
        const auto name_it = must_be_new ? link : rename;
        done = name_it(part.c_str(), path.c_str()) == 0;
        if (!done && !(must_be_new && errno == EEXIST)) fail("create", path);
    } catch (const failure&) {
        unlink(part.c_str());
        throw;
    }
    if (must_be_new) unlink(part.c_str());
    if (done) sync_path(folder_of(path), O_DIRECTORY);
    return done;
}

// Appends with one write, on disk when it returns.
void append_to(const descriptor& file, const std::string& path, std::string_view text) {
    const off_t before = lseek(file.get(), 0, SEEK_END);
    const ssize_t written = persist([&] { return write(file.get(), text.data(), text.size()); });
    if (written != static_cast<ssize_t>(text.size())) {
        const int reason = written < 0 ? errno : ENOSPC;
        if (written > 0 && before >= 0 && ftruncate(file.get(), before) != 0)
            fail("remove a part of a line from", path);
        errno = reason;
        fail("append to", path);
    }
    // EINVAL: a pipe or a device
    if (persist([&] { return fdatasync(file.get()); }) != 0 && errno != EINVAL) fail("sync", path);
}

// The file to replace: for a link its target, so that the link stays.
std::string target_of(const std::string& path) {
    std::error_code problem;
    if (!std::filesystem::is_symlink(path, problem)) return path;
    const std::filesystem::path real = std::filesystem::canonical(path, problem);
    return problem ? path : real.string();
}

// Whether `path` is a terminal, a pipe, a device, or a name of an open file ("/dev/stdout"), which
// is written to and not replaced.
bool is_stream(const std::string& path) {
    struct stat found {};
    if (stat(path.c_str(), &found) != 0 || S_ISDIR(found.st_mode)) return false;
    return !S_ISREG(found.st_mode) || path.rfind("/dev/std", 0) == 0 ||
           path.rfind("/dev/fd/", 0) == 0 || path.rfind("/proc/", 0) == 0;
}

void write_stream(const std::string& path, std::string_view text) {
    // a redirected file that is opened again would be written at another offset
    const bool standard = path == "/dev/stdout";
    const descriptor stream(standard ? dup(STDOUT_FILENO) : open_path(path, O_WRONLY | O_APPEND));
    if (!stream.fine()) fail("open", path);
    // output printed before comes first
    std::fflush(nullptr);
    write_all(stream, text, path);
}

}  // namespace

void write_atomic(const std::string& path, std::string_view text) {
    if (is_stream(path)) return write_stream(path, text);
    replace(target_of(path), text);
}

void replace(const std::string& path, std::string_view text) {
    write_whole(path, text, file_mode, false);
}

bool create_private(const std::string& path, std::string_view text) {
    return write_whole(path, text, private_mode, true);
}

void append(const std::string& path, std::string_view text, mode_t mode) {
    const bool created = access(path.c_str(), F_OK) != 0;
    const descriptor file(open_path(path, O_WRONLY | O_APPEND | O_CREAT, mode));
    if (!file.fine()) fail("open", path);
    append_to(file, path, text);
    if (created) sync_path(folder_of(path), O_DIRECTORY);
}

void begin_parts(const std::string& path, std::string_view text, std::size_t size) {
    const descriptor file(open_path(path, O_WRONLY | O_CREAT | O_EXCL));
    if (!file.fine()) fail("create", path);
    if (ftruncate(file.get(), static_cast<off_t>(size)) != 0) fail("write", path);
    write_all(file, text, path);
}

void write_part(const std::string& path, std::string_view text, std::size_t offset, bool sync) {
    descriptor file = open_own(path, O_WRONLY);
    if (lseek(file.get(), static_cast<off_t>(offset), SEEK_SET) < 0) fail("write", path);
    write_all(file, text, path);
    if (sync && persist([&] { return fsync(file.get()); }) != 0) fail("sync", path);
    // a network file system may report here that a write failed
    if (close(file.release()) != 0 && errno != EINTR) fail("write", path);
}

void end_parts(const std::string& path, const std::string& name) {
    sync_path(path, 0);
    if (rename(path.c_str(), name.c_str()) != 0) fail("create", name);
    sync_path(folder_of(name), O_DIRECTORY);
}

void expect_size(const std::string& path, std::size_t size) {
    // an open file of a network has its current size
    const descriptor file = open_own(path, O_RDONLY);
    struct stat found {};
    if (fstat(file.get(), &found) != 0) fail("read", path);
    if (std::size_t(found.st_size) != size)
        throw failure(path + " has " + std::to_string(found.st_size) + " bytes instead of " +
                      std::to_string(size) +
                      ": another process wrote it, so this one, whose lock was lost, ends");
}

void append_own(const std::string& path, std::string_view text) {
    const bool created = access(path.c_str(), F_OK) != 0;
    append_to(open_own(path, O_WRONLY | O_APPEND | O_CREAT), path, text);
    if (created) sync_path(folder_of(path), O_DIRECTORY);
}

}  // namespace limax::host
