// cuda_cache_test.cpp: the kernel cache stores kernels, detects damaged files, and never fails a
// simulation.
#include <doctest/doctest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "backend/cuda/driver/cache.h"
#include "environment.h"
#include "scratch_folder.h"

namespace fs = std::filesystem;
using limax::cuda::hash128;
using limax::cuda::kernel_cache;
using limax::test::scratch_folder;

namespace {

std::string read(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}
void write(const fs::path& path, const std::string& content) {
    std::ofstream(path, std::ios::binary) << content;
}

fs::path only_file_of(const fs::path& folder) {
    REQUIRE(std::distance(fs::directory_iterator(folder), {}) == 1);
    return fs::directory_iterator(folder)->path();
}

// All bytes, zeros among them.
std::string some_bytes() {
    std::string bytes;
    for (int i = 0; i < 1000; ++i) bytes += char(i * 7);
    return bytes;
}

const hash128 key = hash128().add("a kernel");

}  // namespace

TEST_CASE("a hash of parts depends on where one ends") {
    CHECK(hash128().add("ab").add("c").hex() != hash128().add("a").add("bc").hex());
    CHECK(hash128().add("ab").hex() != hash128().add("ab").add("").hex());
    CHECK(hash128().add(std::string("a\0b", 3)).hex() != hash128().add("a").hex());
}

TEST_CASE("a stored kernel is loaded unchanged") {
    const scratch_folder scratch;
    const fs::path folder = scratch.path / "deep" / "limax";
    kernel_cache cache(folder.string());
    CHECK_FALSE(cache.load(key));
    CHECK_FALSE(fs::exists(folder));  // looking makes nothing
    cache.store(key, some_bytes());
    REQUIRE(cache.load(key));
    CHECK(*cache.load(key) == some_bytes());
    CHECK(*kernel_cache(folder.string()).load(key) == some_bytes());
    CHECK_FALSE(cache.load(hash128().add("another kernel")));
    // nothing of the writing stays
    CHECK(only_file_of(folder).filename() == key.hex() + ".kernel");
    cache.store(key, "again");
    CHECK(*cache.load(key) == "again");
    CHECK(cache.take_notes().empty());
}

TEST_CASE("a damaged file is detected, removed, reported once and replaced") {
    const scratch_folder scratch;
    kernel_cache first(scratch.path.string());
    first.store(key, some_bytes());
    const fs::path path = only_file_of(scratch.path);
    const std::string whole = read(path);
    REQUIRE(whole.size() == some_bytes().size() + 32);

    const auto check_damage = [&](const std::string& content) {
        kernel_cache cache(scratch.path.string());
        write(path, content);
        CHECK_FALSE(cache.load(key));
        CHECK_FALSE(fs::exists(path));
        const std::vector<std::string> notes = cache.take_notes();
        REQUIRE(notes.size() == 1);
        CHECK(notes[0].find(path.string() + " is damaged") != std::string::npos);
        // the same problem is not reported again
        write(path, content);
        CHECK_FALSE(cache.load(key));
        CHECK(cache.take_notes().empty());
        cache.store(key, some_bytes());
        CHECK(*cache.load(key) == some_bytes());
        CHECK(cache.take_notes().empty());
    };
    for (const std::size_t at : {0, 31, 32, 500, 1031}) {
        CAPTURE(at);
        std::string flipped = whole;
        flipped[at] = char(flipped[at] ^ 1);
        check_damage(flipped);
        check_damage(whole.substr(0, at));
    }
    check_damage(whole + "x");

    // a whole file under another's name
    const hash128 other = hash128().add("another kernel");
    fs::copy_file(path, scratch.path / (other.hex() + ".kernel"));
    CHECK_FALSE(first.load(other));
    CHECK(*first.load(key) == some_bytes());
}

TEST_CASE("a folder that is not writable is ignored and reported once") {
    // a folder cannot be made below a file, even by root
    const scratch_folder scratch;
    write(scratch.path / "file", "");
    const std::string folder = (scratch.path / "file" / "limax").string();
    kernel_cache cache(folder);
    cache.store(key, some_bytes());
    cache.store(key, some_bytes());
    CHECK_FALSE(cache.load(key));
    const std::vector<std::string> notes = cache.take_notes();
    REQUIRE(notes.size() == 1);
    CHECK(notes[0].find(folder + " cannot be written: ") != std::string::npos);
    CHECK(cache.take_notes().empty());
}

TEST_CASE("the user's folder follows XDG_CACHE_HOME, then HOME") {
    const limax::test::environment_variable cache("XDG_CACHE_HOME"), home("HOME");
    cache.set("/somewhere");
    home.set("/home/of/somebody");
    CHECK(kernel_cache::users_folder() == "/somewhere/limax");
    for (const char* unusable : {"", "relative/path"}) {
        cache.set(unusable);
        CHECK(kernel_cache::users_folder() == "/home/of/somebody/.cache/limax");
    }
    cache.unset();
    CHECK(kernel_cache::users_folder() == "/home/of/somebody/.cache/limax");
    home.unset();
    CHECK(kernel_cache::users_folder() == "");
}
