// writer.cpp: files written asynchronously: a thread carries out jobs in order and stops at the
// first failure, so the jobs on disk are always the first ones. Numbers of jobs count from 1.
//
// An array is written in parts, by this process or by several: one begins a file of its size, each
// writes rows to it, and at the end it gets its name. The thread also hashes arrays, which takes
// long. Until then their hash is a placeholder of the same length, "@" and the number of the job,
// which the thread replaces in a line that is appended later.
#include <signal.h>

#include <cerrno>
#include <condition_variable>
#include <cstdint>
#include <cstdio>
#include <deque>
#include <exception>
#include <map>
#include <mutex>
#include <new>
#include <string>
#include <thread>
#include <unordered_map>
#include <utility>

#include "durable.h"
#include "guard.h"
#include "modules.h"

namespace limax::host {
namespace {

const char* const writer_type = "limax.writer";

enum class task {
    write,
    begin_array,
    write_rows,
    end_array,
    append,
    append_sealed,
    expect,
    remove
};

struct job {
    std::string path;
    std::string bytes;
    task what;
    // Bytes of a sealed line that may contain placeholders, or those that a file has.
    std::size_t size = 0;
    // Of rows: where the first one is in the file, bytes of one, and how many follow the last one.
    std::size_t offset = 0, row = 0, following = 0;
    bool sync = false;
    // Of the end of an array: its name, and the sum of hashes of its rows from other processes.
    std::string name = {};
    std::uint64_t others = 0;
};

constexpr std::size_t digits_of_hash = 16;

std::string placeholder(std::uint64_t number) {
    std::string digits = std::to_string(number);
    return "@" + std::string(digits_of_hash - 1 - digits.size(), '0') + digits;
}

// Where the hash of a line of base/sealed.lua begins, and what it is of.
constexpr std::size_t seal_at = sizeof R"({"hash":")" - 1, sealed_at = seal_at + digits_of_hash + 1;

class writer {
public:
    // Its thread blocks all signals.
    writer() {
        sigset_t all, before;
        sigfillset(&all);
        pthread_sigmask(SIG_SETMASK, &all, &before);
        thread_ = std::thread([this] { work(); });
        pthread_sigmask(SIG_SETMASK, &before, nullptr);
    }
    // Carries out all jobs first.
    ~writer() {
        {
            const std::lock_guard lock(mutex_);
            ends_ = true;
        }
        wake_.notify_one();
        thread_.join();
    }
    writer(const writer&) = delete;
    writer& operator=(const writer&) = delete;

    // Returns the number of the new job.
    std::uint64_t add(job next) {
        {
            const std::lock_guard lock(mutex_);
            jobs_.push_back(std::move(next));
        }
        wake_.notify_one();
        return ++added_;
    }

    // Memory of so many bytes, which `take_array` returns: that of an earlier array of about this
    // size, which costs no page faults.
    char* array(std::size_t bytes) {
        {
            const std::lock_guard lock(mutex_);
            const auto found = spares_.lower_bound(bytes);
            if (found != spares_.end()) array_ = std::move(spares_.extract(found).mapped());
        }
        array_.resize(bytes);
        return array_.data();
    }
    std::string take_array() { return std::exchange(array_, {}); }

    // Waits until so many jobs are on disk or one has failed; returns its message.
    std::string wait(std::uint64_t count) {
        std::unique_lock lock(mutex_);
        did_.wait(lock, [&] { return done_ >= count || !problem_.empty(); });
        return problem_;
    }

    // Jobs that are on disk.
    std::uint64_t done() const {
        const std::lock_guard lock(mutex_);
        return done_;
    }

    // Jobs so far.
    std::uint64_t added() const { return added_; }

    // The hash of an array that is on disk, once; empty for another job.
    std::string take_hash(std::uint64_t number) {
        const std::lock_guard lock(mutex_);
        const auto found = hashes_.extract(placeholder(number));
        return found ? std::move(found.mapped()) : std::string();
    }

    // The sum of the hashes of rows that were written to this file, once.
    std::uint64_t take_sum(const std::string& path) {
        const std::lock_guard lock(mutex_);
        const auto found = sums_.extract(path);
        return found ? found.mapped() : 0;
    }

private:
    // Replaces the placeholders of a line, and then its own hash.
    void complete(job& line) const {
        const std::lock_guard lock(mutex_);
        for (std::size_t at = sealed_at; at + digits_of_hash <= line.size; ++at) {
            if (line.bytes[at] != '@') continue;
            const auto found = hashes_.find(line.bytes.substr(at, digits_of_hash));
            if (found != hashes_.end()) line.bytes.replace(at, digits_of_hash, found->second);
        }
        const std::string_view rest = std::string_view(line.bytes).substr(sealed_at);
        line.bytes.replace(seal_at, digits_of_hash, xxh3(rest.substr(0, rest.size() - 1)));
    }

    void carry_out(job& next, std::uint64_t number) {
        switch (next.what) {
            case task::remove:
                if (std::remove(next.path.c_str()) != 0 && errno != ENOENT)
                    fail("remove", next.path);
                return;
            case task::write: return replace(next.path, next.bytes);
            case task::append: return append_own(next.path, next.bytes);
            case task::expect: return expect_size(next.path, next.size);
            case task::append_sealed: complete(next); return append_own(next.path, next.bytes);
            case task::begin_array:
                begin_parts(next.path, next.bytes, next.size);
                return add_rows(next, next.bytes);
            case task::write_rows:
                write_part(next.path, next.bytes, next.offset, next.sync);
                return add_rows(next, next.bytes);
            case task::end_array: end_parts(next.path, next.name);
        }
        const std::uint64_t hash = take_sum(next.path) + next.others;
        const std::lock_guard lock(mutex_);
        hashes_[placeholder(number)] = hash_digits(hash);
    }

    void add_rows(const job& next, std::string_view bytes) {
        const std::uint64_t sum = xxh3_sum(bytes, next.row, next.following);
        const std::lock_guard lock(mutex_);
        sums_[next.path] += sum;
    }

    void work() {
        std::unique_lock lock(mutex_);
        const auto has_work = [&] { return !jobs_.empty() && problem_.empty(); };
        for (;;) {
            wake_.wait(lock, [&] { return ends_ || has_work(); });
            if (!has_work()) return;
            job& next = jobs_.front();
            const std::uint64_t number = done_ + 1;
            lock.unlock();
            std::string problem;
            try {
                carry_out(next, number);
            } catch (const std::exception& found) {
                problem = found.what();
            }
            lock.lock();
            if (problem.empty()) {
                if (next.what == task::write_rows) {
                    spares_.emplace(next.bytes.capacity(), std::move(next.bytes));
                    if (spares_.size() > most_spares) spares_.erase(spares_.begin());
                }
                jobs_.pop_front();
                ++done_;
            }
            problem_ = std::move(problem);
            did_.notify_all();
        }
    }

    mutable std::mutex mutex_;
    std::condition_variable wake_, did_;
    std::deque<job> jobs_;     // the first one is in progress
    std::uint64_t added_ = 0;  // used by the thread that runs scripts
    std::uint64_t done_ = 0;
    std::string array_;  // used by the thread that runs scripts
    static constexpr std::size_t most_spares = 4;
    std::multimap<std::size_t, std::string> spares_;  // of arrays that are on disk, by capacity
    std::unordered_map<std::string, std::string> hashes_;  // of arrays, by their placeholders
    std::unordered_map<std::string, std::uint64_t> sums_;  // of arrays not yet ended, by path
    std::string problem_;                                  // of the first job that failed
    bool ends_ = false;
    std::thread thread_;
};

writer& writer_argument(lua_State* L) {
    return *static_cast<writer*>(luaL_checkudata(L, 1, writer_type));
}

// Adds a job; returns its number, and size and hash of its bytes.
int add_hashed(lua_State* L, job next) {
    const std::size_t size = next.bytes.size();
    const std::string hash = xxh3(next.bytes);
    push(L, writer_argument(L).add(std::move(next)));
    push(L, size);
    push(L, hash);
    return 3;
}

int lua_write(lua_State* L) {
    return add_hashed(L, {path_argument(L, 2), std::string(text_argument(L, 3)), task::write});
}

int lua_begin_array(lua_State* L) {
    const char* const path = path_argument(L, 2);
    const std::string_view header = text_argument(L, 3);
    const std::size_t rows = size_argument(L, 4, 0), row = size_argument(L, 5, 1);
    job next = {path, std::string(header), task::begin_array, header.size() + rows * row};
    next.row = row;
    next.following = rows;
    return push(L, writer_argument(L).add(std::move(next)));
}

int lua_array(lua_State* L) {
    lua_pushlightuserdata(L, writer_argument(L).array(size_argument(L, 2, 0)));
    return 1;
}

int lua_write_rows(lua_State* L) {
    const char* const path = path_argument(L, 2);
    const std::size_t offset = size_argument(L, 3, 0), row = size_argument(L, 4, 1),
                      following = size_argument(L, 5, 0);
    job next = {path, writer_argument(L).take_array(), task::write_rows};
    next.offset = offset;
    next.row = row;
    next.following = following;
    next.sync = lua_toboolean(L, 6) != 0;
    return push(L, writer_argument(L).add(std::move(next)));
}

int lua_end_array(lua_State* L) {
    job next = {path_argument(L, 2), {}, task::end_array};
    next.name = path_argument(L, 3);
    const std::string others(luaL_optstring(L, 4, ""));
    for (std::size_t at = 0; at < others.size(); at += digits_of_hash)
        next.others += std::stoull(others.substr(at, digits_of_hash), nullptr, 16);
    const std::uint64_t number = writer_argument(L).add(std::move(next));
    push(L, number);
    push(L, placeholder(number));
    return 2;
}

int lua_sum(lua_State* L) {
    return push(L, hash_digits(writer_argument(L).take_sum(path_argument(L, 2))));
}

int lua_append_sealed(lua_State* L) {
    const std::string_view line = lines_argument(L, 3);
    const lua_Number bytes = luaL_checknumber(L, 4);
    luaL_argcheck(L, line.size() > sealed_at && line.back() == '\n', 3, "a sealed line");
    luaL_argcheck(L, bytes >= 0 && bytes <= static_cast<lua_Number>(line.size()), 4,
                  "a size in bytes");
    return push(L, writer_argument(L).add({path_argument(L, 2), std::string(line),
                                           task::append_sealed, static_cast<std::size_t>(bytes)}));
}

int lua_hash(lua_State* L) {
    const lua_Number number = luaL_checknumber(L, 2);
    return push(L, writer_argument(L).take_hash(static_cast<std::uint64_t>(number)));
}

int lua_append(lua_State* L) {
    return add_hashed(L, {path_argument(L, 2), std::string(lines_argument(L, 3)), task::append});
}

int lua_expect(lua_State* L) {
    const std::size_t bytes = size_argument(L, 3, 0);
    return push(L, writer_argument(L).add({path_argument(L, 2), {}, task::expect, bytes}));
}

int lua_remove(lua_State* L) {
    return push(L, writer_argument(L).add({path_argument(L, 2), {}, task::remove}));
}

int lua_wait(lua_State* L) {
    writer& target = writer_argument(L);
    const lua_Number number = luaL_optnumber(L, 2, static_cast<lua_Number>(target.added()));
    luaL_argcheck(L, number >= 0 && number <= static_cast<lua_Number>(target.added()), 2,
                  "there is no such job");
    const std::string problem = target.wait(static_cast<std::uint64_t>(number));
    if (!problem.empty()) throw failure(problem);
    return push(L, true);
}

int lua_done(lua_State* L) { return push(L, writer_argument(L).done()); }

int lua_collect(lua_State* L) {
    writer_argument(L).~writer();
    return 0;
}

int lua_writer(lua_State* L) {
    new (lua_newuserdata(L, sizeof(writer))) writer;
    luaL_getmetatable(L, writer_type);
    lua_setmetatable(L, -2);
    return 1;
}

}  // namespace

void add_writer(lua_State* L) {
    luaL_newmetatable(L, writer_type);
    add_function<lua_collect>(L, "__gc");
    // scripts cannot call the finalizer
    lua_pushboolean(L, 0);
    lua_setfield(L, -2, "__metatable");
    lua_newtable(L);
    add_function<lua_write>(L, "write");
    add_function<lua_begin_array>(L, "begin_array");
    add_function<lua_array>(L, "array");
    add_function<lua_write_rows>(L, "write_rows");
    add_function<lua_end_array>(L, "end_array");
    add_function<lua_sum>(L, "sum");
    add_function<lua_append>(L, "append");
    add_function<lua_append_sealed>(L, "append_sealed");
    add_function<lua_hash>(L, "hash");
    add_function<lua_expect>(L, "expect");
    add_function<lua_remove>(L, "remove");
    add_function<lua_wait>(L, "wait");
    add_function<lua_done>(L, "done");
    lua_setfield(L, -2, "__index");
    lua_pop(L, 1);
    add_function<lua_writer>(L, "writer");
}

}  // namespace limax::host
