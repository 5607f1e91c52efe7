// cache.cpp: one file per kernel: the checksum of key and bytes, as 32 digits, then the bytes.
#include "backend/cuda/driver/cache.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <system_error>
#include <utility>

#include "base/error.h"

namespace limax::cuda {

namespace {

namespace fs = std::filesystem;

// With the key, so that a file under another's name is found out.
std::string checksum(const hash128& key, std::string_view bytes) {
    return hash128().add(key.hex()).add(bytes).hex();
}

std::string reason_of_errno() { return std::generic_category().message(errno); }

// Writes all bytes; false with errno.
bool write_all(int file, std::string_view bytes) {
    while (!bytes.empty()) {
        const ssize_t written = write(file, bytes.data(), bytes.size());
        if (written < 0 && errno == EINTR) continue;
        if (written <= 0) return false;
        bytes.remove_prefix(std::size_t(written));
    }
    return true;
}

}  // namespace

// ---- hash ----

hash128& hash128::add(std::string_view part) {
    constexpr wide prime = wide(1) << 88 | 0x13b;
    // the length first, so that no two lists of parts run into the same bytes
    for (const std::string& bytes : {format("%zu:", part.size()), std::string(part)})
        for (const char c : bytes) state_ = (state_ ^ static_cast<unsigned char>(c)) * prime;
    return *this;
}

std::string hash128::hex() const {
    return format("%016llx%016llx", static_cast<unsigned long long>(state_ >> 64),
                  static_cast<unsigned long long>(state_));
}

// ---- cache ----

std::string kernel_cache::users_folder() {
    // the standard has relative paths ignored
    const char* cache = secure_getenv("XDG_CACHE_HOME");
    if (cache && cache[0] == '/') return std::string(cache) + "/limax";
    const char* home = secure_getenv("HOME");
    if (home && home[0] == '/') return std::string(home) + "/.cache/limax";
    return "";
}

kernel_cache& kernel_cache::users() {
    static kernel_cache cache(users_folder());
    return cache;
}

std::string kernel_cache::path_of(const hash128& key) const {
    return folder_ + "/" + key.hex() + ".kernel";
}

std::optional<std::string> kernel_cache::load(const hash128& key) {
    if (folder_.empty()) return std::nullopt;
    const std::string path = path_of(key);
    std::ifstream file(path, std::ios::binary);
    if (!file) return std::nullopt;
    std::ostringstream content;
    content << file.rdbuf();
    std::string bytes = content.str();
    const std::string sum = bytes.substr(0, hash128().hex().size());
    bytes.erase(0, sum.size());
    if (sum == checksum(key, bytes)) return bytes;
    // if it cannot be removed, store() will report the folder
    std::error_code ignored;
    fs::remove(path, ignored);
    note(reported_damaged_,
         format("the kernel cache's file %s is damaged; the kernel is made again", path.c_str()));
    return std::nullopt;
}

void kernel_cache::store(const hash128& key, std::string_view bytes) {
    if (folder_.empty())
        return note(reported_unwritable_,
                    "kernels are not kept for the next run: neither XDG_CACHE_HOME nor HOME names "
                    "a folder");
    std::error_code problem;
    fs::create_directories(folder_, problem);
    if (problem) return cannot_write(problem.message());

    std::string temporary = folder_ + "/.kernel-XXXXXX";
    const int file = mkostemp(temporary.data(), O_CLOEXEC);
    if (file < 0) return cannot_write(reason_of_errno());
    std::string reason;
    if (!write_all(file, checksum(key, bytes)) || !write_all(file, bytes))
        reason = reason_of_errno();
    if (close(file) != 0 && reason.empty()) reason = reason_of_errno();
    if (reason.empty() && std::rename(temporary.c_str(), path_of(key).c_str()) != 0)
        reason = reason_of_errno();
    if (reason.empty()) return;
    unlink(temporary.c_str());
    cannot_write(reason);
}

void kernel_cache::note(bool& reported, const std::string& text) {
    if (!std::exchange(reported, true)) notes_.push_back(text);
}

void kernel_cache::cannot_write(const std::string& reason) {
    note(reported_unwritable_,
         format("kernels are not kept for the next run: %s cannot be written: %s", folder_.c_str(),
                reason.c_str()));
}

}  // namespace limax::cuda
