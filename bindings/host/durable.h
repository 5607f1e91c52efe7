// durable.h: files that survive a kill at any moment: complete or absent (write_atomic, end_parts),
// or extended by whole lines (append), on disk when the call returns. Includes guard.h and the
// standard library only. Any thread may call these functions, which throw a `failure`.
#pragma once

#include <fcntl.h>
#include <sys/types.h>
#include <unistd.h>

#include <cerrno>
#include <string>
#include <string_view>
#include <utility>

#include "guard.h"

namespace limax::host {

constexpr mode_t file_mode = 0666;     // less the umask
constexpr mode_t private_mode = 0600;  // only for its owner

// Throws "cannot WHAT PATH: REASON", the reason from errno.
[[noreturn]] void fail(const char* what, const std::string& path);

class descriptor {
public:
    explicit descriptor(int number) : number_(number) {}
    ~descriptor() {
        if (number_ >= 0) close(number_);
    }
    descriptor(const descriptor&) = delete;
    descriptor& operator=(const descriptor&) = delete;
    descriptor(descriptor&& from) noexcept : number_(from.release()) {}

    bool fine() const { return number_ >= 0; }
    int get() const { return number_; }
    int release() { return std::exchange(number_, -1); }

private:
    int number_;
};

// Repeats a system call that a signal interrupted.
template <typename call>
auto persist(call&& try_once) {
    decltype(try_once()) result{};
    do result = try_once();
    while (result < 0 && errno == EINTR);
    return result;
}

int open_path(const std::string& path, int flags, mode_t mode = file_mode);

// An open regular file that is no link, for files whose folder may come from somebody else; throws
// where it is something else.
descriptor open_own(const std::string& path, int flags);

// ".", "/" or the part before the last slash.
std::string folder_of(const std::string& path);

// Makes changes of a file or folder survive a power cut.
void sync_path(const std::string& path, int flags);

// Writes completely or not at all. A link stays, and a terminal or a pipe is written to directly.
void write_atomic(const std::string& path, std::string_view text);

// Writes completely or not at all. A link of this name is replaced, not followed.
void replace(const std::string& path, std::string_view text);

// Creates a file that only its owner can access, completely or not at all. Of processes that start
// together one creates it: false where a file, or a link, of this name exists.
bool create_private(const std::string& path, std::string_view text);

// Appends whole lines with one write; `mode` is for a file that it creates. A part that a full disk
// accepted is removed again.
void append(const std::string& path, std::string_view text, mode_t mode);
// The same, but refuses links.
void append_own(const std::string& path, std::string_view text);

// Makes a new file of `size` bytes, which begins with `text`, for parts that several processes
// write: it has its size before, since a client of NFS that writes beyond the end may fill with
// zeros what another one wrote to the same page.
void begin_parts(const std::string& path, std::string_view text, std::size_t size);
// Writes into such a file; with `sync` it is on disk when it returns.
void write_part(const std::string& path, std::string_view text, std::size_t offset, bool sync);
// Gives it its name once it is on disk.
void end_parts(const std::string& path, const std::string& name);

// Fails unless a file has this size.
void expect_size(const std::string& path, std::size_t size);

// A string argument that ends in a line break.
inline std::string_view lines_argument(lua_State* L, int index) {
    const std::string_view text = text_argument(L, index);
    luaL_argcheck(L, !text.empty() && text.back() == '\n', index,
                  "only whole lines are appended: the text must end in a line break");
    return text;
}

}  // namespace limax::host
