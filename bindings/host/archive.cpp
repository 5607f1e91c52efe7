// archive.cpp: ZIP archives in memory through libzip, without files. Equal entries give equal bytes
// at any time.
#include <zip.h>

#include <cstring>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "guard.h"
#include "modules.h"

namespace limax::host {
namespace {

// Most entries of an archive that is read, and most bytes of all of them unpacked. Arrays of robots
// are far smaller.
constexpr zip_int64_t most_entries = 1000;
constexpr zip_uint64_t most_bytes = 256ull << 20;

// 1 January 1980, the first day that a ZIP file can name: (year - 1980) << 9 | month << 5 | day
constexpr zip_uint16_t first_day = 1 << 5 | 1;

struct free_zip {
    void operator()(zip_t* archive) const { zip_discard(archive); }
    void operator()(zip_source_t* source) const { zip_source_free(source); }
    void operator()(zip_file_t* file) const { zip_fclose(file); }
};
using archive_handle = std::unique_ptr<zip_t, free_zip>;
using source_handle = std::unique_ptr<zip_source_t, free_zip>;
using file_handle = std::unique_ptr<zip_file_t, free_zip>;

std::string text_of(zip_error_t& error) {
    std::string text = zip_error_strerror(&error);
    zip_error_fini(&error);
    return text;
}

[[noreturn]] void fail(zip_t* archive) { throw std::runtime_error(zip_strerror(archive)); }

// Opens an archive over a source that the caller keeps.
archive_handle open_archive(zip_source_t* source, int flags) {
    zip_error_t error;
    zip_error_init(&error);
    zip_source_keep(source);
    zip_t* const archive = zip_open_from_source(source, flags, &error);
    if (archive == nullptr) {
        zip_source_free(source);
        throw std::runtime_error(text_of(error));
    }
    zip_error_fini(&error);
    return archive_handle(archive);
}

source_handle memory(const char* data, std::size_t size) {
    zip_error_t error;
    zip_error_init(&error);
    zip_source_t* const source = zip_source_buffer_create(data, size, 0, &error);
    if (source == nullptr) throw std::runtime_error(text_of(error));
    zip_error_fini(&error);
    return source_handle(source);
}

// All bytes of a source that an archive was written to.
std::string contents(zip_source_t* source) {
    zip_stat_t facts;
    zip_stat_init(&facts);
    if (zip_source_stat(source, &facts) != 0 || zip_source_open(source) != 0)
        throw std::runtime_error("the archive in memory cannot be read");
    std::string bytes(facts.size, '\0');
    const zip_int64_t count = zip_source_read(source, bytes.data(), bytes.size());
    zip_source_close(source);
    if (count != static_cast<zip_int64_t>(bytes.size()))
        throw std::runtime_error("the archive in memory was cut short");
    return bytes;
}

// A string in the table on top of the stack, which keeps the bytes alive.
std::pair<const char*, std::size_t> string_at(lua_State* L, int i) {
    lua_rawgeti(L, -1, i);
    if (lua_type(L, -1) != LUA_TSTRING)
        throw std::runtime_error("zip: an entry is a list { name, bytes }");
    std::size_t size = 0;
    const char* const data = lua_tolstring(L, -1, &size);
    lua_pop(L, 1);
    return {data, size};
}

// pack({ { name, bytes }, ... }) -> bytes of the archive, in that order
int pack(lua_State* L) {
    luaL_checktype(L, 1, LUA_TTABLE);
    std::string bytes;
    {
        const source_handle target = memory(nullptr, 0);
        archive_handle archive = open_archive(target.get(), ZIP_CREATE | ZIP_TRUNCATE);
        const int count = static_cast<int>(lua_objlen(L, 1));
        for (int i = 1; i <= count; ++i) {
            lua_rawgeti(L, 1, i);
            if (!lua_istable(L, -1))
                throw std::runtime_error("zip: an entry is a list { name, bytes }");
            const auto [name, name_size] = string_at(L, 1);
            const auto [data, size] = string_at(L, 2);
            if (std::strlen(name) != name_size)
                throw std::runtime_error("zip: an entry's name must not contain a zero byte");
            lua_pop(L, 1);
            zip_source_t* const source = zip_source_buffer(archive.get(), data, size, 0);
            if (source == nullptr) fail(archive.get());
            const zip_int64_t index = zip_file_add(archive.get(), name, source, ZIP_FL_ENC_UTF_8);
            if (index < 0) {
                zip_source_free(source);
                fail(archive.get());
            }
            if (zip_set_file_compression(archive.get(), static_cast<zip_uint64_t>(index),
                                         ZIP_CM_DEFLATE, 0) != 0 ||
                zip_file_set_dostime(archive.get(), static_cast<zip_uint64_t>(index), 0, first_day,
                                     0) != 0)
                fail(archive.get());
        }
        if (zip_close(archive.get()) != 0) fail(archive.get());
        static_cast<void>(archive.release());
        bytes = contents(target.get());
    }
    lua_pushlstring(L, bytes.data(), bytes.size());
    return 1;
}

// Why an entry's name is refused; empty if it is not.
std::string refusal(const std::string& name) {
    const bool climbs = name == ".." || name.rfind("../", 0) == 0 ||
                        name.find("/../") != std::string::npos ||
                        (name.size() > 2 && name.compare(name.size() - 3, 3, "/..") == 0);
    if (name.empty() || name[0] == '/' || climbs || name.find('\\') != std::string::npos ||
        name.find(':') != std::string::npos)
        return "an entry names a place outside of the archive";
    return {};
}

// Name and size of an entry, checked. `left`: bytes that may still be unpacked.
zip_stat_t checked_entry(zip_t* archive, zip_uint64_t index, zip_uint64_t& left) {
    zip_stat_t facts;
    if (zip_stat_index(archive, index, 0, &facts) != 0) fail(archive);
    if ((facts.valid & ZIP_STAT_NAME) == 0 || (facts.valid & ZIP_STAT_SIZE) == 0)
        throw std::runtime_error("an entry without a name or a size");
    const std::string problem = refusal(facts.name);
    if (!problem.empty()) throw std::runtime_error(problem);
    if (facts.size > left)
        throw std::runtime_error("more than " + std::to_string(most_bytes) +
                                 " bytes when unpacked");
    left -= facts.size;
    return facts;
}

std::string read_entry(zip_t* archive, zip_uint64_t index, zip_uint64_t size) {
    const file_handle file(zip_fopen_index(archive, index, 0));
    if (!file) fail(archive);
    std::string bytes(size, '\0');
    zip_uint64_t have = 0;
    while (have < size) {
        const zip_int64_t got = zip_fread(file.get(), bytes.data() + have, size - have);
        if (got <= 0) break;
        have += static_cast<zip_uint64_t>(got);
    }
    // reading past the end compares the checksum
    char beyond = 0;
    if (have != size || zip_fread(file.get(), &beyond, 1) != 0)
        throw std::runtime_error("an entry is damaged, or its size is wrong");
    return bytes;
}

// Puts all entries into the table on top of the stack; throws with the reason.
void read_entries(lua_State* L, const char* data, std::size_t size) {
    const source_handle source = memory(data, size);
    const archive_handle archive = open_archive(source.get(), ZIP_RDONLY);
    const zip_int64_t count = zip_get_num_entries(archive.get(), 0);
    if (count > most_entries)
        throw std::runtime_error(std::to_string(count) + " entries; at most " +
                                 std::to_string(most_entries) + " are read");
    // check all before unpacking the first
    std::vector<zip_stat_t> entries;
    zip_uint64_t left = most_bytes;
    for (zip_int64_t i = 0; i < count; ++i)
        entries.push_back(checked_entry(archive.get(), static_cast<zip_uint64_t>(i), left));
    for (std::size_t i = 0; i < entries.size(); ++i) {
        const std::string bytes = read_entry(archive.get(), i, entries[i].size);
        lua_createtable(L, 2, 0);
        lua_pushstring(L, entries[i].name);
        lua_rawseti(L, -2, 1);
        lua_pushlstring(L, bytes.data(), bytes.size());
        lua_rawseti(L, -2, 2);
        lua_rawseti(L, -2, static_cast<int>(i + 1));
    }
}

// unpack(bytes) -> { { name, bytes }, ... } | nil, message
int unpack(lua_State* L) {
    std::size_t size = 0;
    const char* const data = luaL_checklstring(L, 1, &size);
    lua_newtable(L);
    std::string problem;
    try {
        read_entries(L, data, size);
        return 1;
    } catch (const std::exception& caught) {
        problem = caught.what();
    }
    return push_failure(L, problem);
}

}  // namespace

void open_archives(lua_State* L) {
    lua_newtable(L);
    add_function<pack>(L, "pack");
    add_function<unpack>(L, "unpack");
    lua_setfield(L, -2, "zip");
}

}  // namespace limax::host
