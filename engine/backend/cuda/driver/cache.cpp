// cache.cpp: one file per kernel: a magic, the length and the checksum of key and bytes, the bytes.
#include "backend/cuda/driver/cache.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <system_error>
#include <utility>

#include "base/error.h"

namespace limax::cuda {

namespace {

namespace fs = std::filesystem;

constexpr char magic[8] = {'l', 'i', 'm', 'a', 'x', 'k', 'n', '1'};

// In the machine's own byte order: no kernel is carried to another kind of machine.
struct file_head {
    char magic[8];
    uint64_t length;  // of the bytes that follow
    uint64_t sum[2];  // checksum, high and low
};
static_assert(sizeof(file_head) == 32);

// With the key, so that a file under another's name is found out.
hash128 checksum(const hash128& key, std::string_view bytes) {
    return hash128().add(key.hex()).add(bytes);
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

void hash128::add_bytes(std::string_view bytes) {
    constexpr wide prime = wide(1) << 88 | 0x13b;
    for (const char c : bytes) state_ = (state_ ^ static_cast<unsigned char>(c)) * prime;
}

hash128& hash128::add(std::string_view part) {
    // the length first, so that no two lists of parts run into the same bytes
    const uint64_t length = part.size();
    char bytes[sizeof length];
    std::memcpy(bytes, &length, sizeof length);
    add_bytes({bytes, sizeof bytes});
    add_bytes(part);
    return *this;
}

hash128 hash128::of(std::string_view bytes) {
    hash128 hash;
    hash.add_bytes(bytes);
    return hash;
}

std::string hash128::hex() const {
    return format("%016llx%016llx", static_cast<unsigned long long>(high()),
                  static_cast<unsigned long long>(low()));
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
    std::FILE* file = std::fopen(path.c_str(), "rb");
    if (!file) return std::nullopt;
    std::string content;
    char piece[65536];
    for (std::size_t n; (n = std::fread(piece, 1, sizeof piece, file)) > 0;)
        content.append(piece, n);
    const bool unreadable = std::ferror(file) != 0;
    std::fclose(file);

    const char* damage = nullptr;
    file_head head;
    std::string_view bytes;
    if (unreadable) {
        damage = "it cannot be read";
    } else if (content.size() < sizeof head) {
        damage = "it is too short";
    } else {
        std::memcpy(&head, content.data(), sizeof head);
        bytes = std::string_view(content).substr(sizeof head);
        const hash128 sum = checksum(key, bytes);
        if (std::memcmp(head.magic, magic, sizeof magic) != 0)
            damage = "it does not begin as one of limax";
        else if (head.length != bytes.size())
            damage = "its length is wrong";
        else if (head.sum[0] != sum.high() || head.sum[1] != sum.low())
            damage = "its checksum is wrong";
    }
    if (!damage) return std::string(bytes);
    // if it cannot be removed, store() will report the folder
    std::error_code ignored;
    fs::remove(path, ignored);
    note(reported_damaged_, format("the kernel cache's file %s is damaged (%s); the kernel is made "
                                   "again",
                                   path.c_str(), damage));
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
    const hash128 sum = checksum(key, bytes);
    file_head head;
    std::memcpy(head.magic, magic, sizeof magic);
    head.length = bytes.size();
    head.sum[0] = sum.high();
    head.sum[1] = sum.low();
    std::string reason;
    if (!write_all(file, {reinterpret_cast<const char*>(&head), sizeof head}) ||
        !write_all(file, bytes))
        reason = reason_of_errno();
    if (close(file) != 0 && reason.empty()) reason = reason_of_errno();
    if (reason.empty() && std::rename(temporary.c_str(), path_of(key).c_str()) != 0)
        reason = reason_of_errno();
    if (reason.empty()) return;
    unlink(temporary.c_str());
    cannot_write(reason);
}

std::vector<std::string> kernel_cache::take_notes() {
    const std::lock_guard lock(mutex_);
    return std::exchange(notes_, {});
}

void kernel_cache::note(bool& reported, const std::string& text) {
    const std::lock_guard lock(mutex_);
    if (!std::exchange(reported, true)) notes_.push_back(text);
}

void kernel_cache::cannot_write(const std::string& reason) {
    note(reported_unwritable_,
         format("kernels are not kept for the next run: %s cannot be written: %s", folder_.c_str(),
                reason.c_str()));
}

}  // namespace limax::cuda
