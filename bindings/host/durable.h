// durable.h: files that survive a kill at any moment: whole or absent (write_atomic), or grown by
// whole lines (append), on disk when the call returns. Includes the standard library only.
#pragma once

#include <fcntl.h>
#include <sys/types.h>
#include <unistd.h>

#include <cerrno>
#include <span>
#include <string>
#include <string_view>

namespace limax::host {

constexpr mode_t file_mode = 0666;     // less the umask
constexpr mode_t private_mode = 0600;  // for its owner alone

// A failure of the system, turned into nil and a message where the Lua function ends.
struct system_problem {
    std::string message;
};

// "cannot WHAT PATH: " and the reason that errno has.
[[noreturn]] void fail(const char* what, const std::string& path);

class descriptor {
public:
    explicit descriptor(int number) : number_(number) {}
    ~descriptor() {
        if (number_ >= 0) close(number_);
    }
    descriptor(const descriptor&) = delete;
    descriptor& operator=(const descriptor&) = delete;

    bool fine() const { return number_ >= 0; }
    int get() const { return number_; }
    int release() {
        const int number = number_;
        number_ = -1;
        return number;
    }

private:
    int number_;
};

// Repeats a system call that a signal cut short.
template <typename call>
auto persist(call&& try_once) {
    decltype(try_once()) result{};
    do result = try_once();
    while (result < 0 && errno == EINTR);
    return result;
}

int open_path(const std::string& path, int flags, mode_t mode = file_mode);

// ".", "/" or what stands before the last slash.
std::string folder_of(const std::string& path);

// Makes what was created, renamed or removed in a folder survive a power cut.
void sync_path(const std::string& path, int flags);

// The pieces, one after the other, whole or not at all. What is no file (a terminal, a pipe) is
// written to instead. Throws system_problem. Any thread.
void write_atomic(const std::string& path, std::span<const std::string_view> pieces);

// One write of whole lines at the end; `mode` is that of a file which it makes. What a full disk
// let through of it is taken back. Throws system_problem. Any thread.
void append(const std::string& path, std::string_view text, mode_t mode = file_mode);

}  // namespace limax::host
