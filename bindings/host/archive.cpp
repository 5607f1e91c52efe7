// archive.cpp: ZIP archives in memory through libzip, without files. Equal entries give equal bytes
// at any time.
#include <zip.h>

#include <memory>
#include <string>
#include <string_view>
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

// An archive over bytes in memory, which the caller keeps, or over those that it writes itself.
struct memory_archive {
    std::unique_ptr<zip_source_t, free_zip> source;
    std::unique_ptr<zip_t, free_zip> zip;

    memory_archive(std::string_view bytes, int flags) {
        zip_error_t error;
        zip_error_init(&error);
        source.reset(zip_source_buffer_create(bytes.data(), bytes.size(), 0, &error));
        if (source) zip.reset(zip_open_from_source(source.get(), flags, &error));
        const std::string problem = zip_error_strerror(&error);
        zip_error_fini(&error);
        if (!zip) throw failure(problem);
        // the archive frees the source too
        zip_source_keep(source.get());
    }
    // Throws libzip's message unless it is fine.
    void check(bool fine) const {
        if (!fine) throw failure(zip_strerror(zip.get()));
    }
};

// Text i of an entry, the table on top of the stack, which keeps it alive.
std::string_view entry_text(lua_State* L, int i) {
    lua_rawgeti(L, -1, i);
    luaL_argcheck(L, lua_type(L, -1) == LUA_TSTRING, 1, "an entry is a list { name, bytes }");
    const std::string_view text = text_at(L, -1);
    lua_pop(L, 1);
    return text;
}

int pack(lua_State* L) {
    luaL_checktype(L, 1, LUA_TTABLE);
    memory_archive archive({}, ZIP_CREATE | ZIP_TRUNCATE);
    zip_t* const zip = archive.zip.get();
    const int count = static_cast<int>(lua_objlen(L, 1));
    for (int i = 1; i <= count; ++i) {
        lua_rawgeti(L, 1, i);
        luaL_argcheck(L, lua_istable(L, -1), 1, "an entry is a list { name, bytes }");
        const std::string_view name = entry_text(L, 1), bytes = entry_text(L, 2);
        luaL_argcheck(L, name.find('\0') == name.npos, 1, "a name must not contain a zero byte");
        lua_pop(L, 1);
        zip_source_t* const source = zip_source_buffer(zip, bytes.data(), bytes.size(), 0);
        const zip_int64_t added = zip_file_add(zip, name.data(), source, ZIP_FL_ENC_UTF_8);
        if (added < 0) zip_source_free(source);
        archive.check(added >= 0);
        const auto index = static_cast<zip_uint64_t>(added);
        archive.check(zip_set_file_compression(zip, index, ZIP_CM_DEFLATE, 0) == 0 &&
                      zip_file_set_dostime(zip, index, 0, first_day, 0) == 0);
    }
    archive.check(zip_close(zip) == 0);
    static_cast<void>(archive.zip.release());
    zip_stat_t facts;
    zip_stat_init(&facts);
    zip_source_t* const source = archive.source.get();
    if (zip_source_stat(source, &facts) != 0 || zip_source_open(source) != 0)
        throw std::runtime_error("the archive in memory cannot be read");
    std::string bytes(facts.size, '\0');
    zip_source_read(source, bytes.data(), bytes.size());
    zip_source_close(source);
    return push(L, bytes);
}

// Whether a name leads out of the archive or means something else on another system.
bool is_refused(const std::string& name) {
    return name.empty() || name[0] == '/' || name.find_first_of("\\:") != name.npos ||
           ("/" + name + "/").find("/../") != std::string::npos;
}

std::string read_entry(const memory_archive& archive, zip_uint64_t index, zip_uint64_t size) {
    const std::unique_ptr<zip_file_t, free_zip> file(zip_fopen_index(archive.zip.get(), index, 0));
    archive.check(file != nullptr);
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
        throw failure("an entry is damaged, or its size is wrong");
    return bytes;
}

int unpack(lua_State* L) {
    const memory_archive archive(text_argument(L, 1), ZIP_RDONLY);
    const zip_int64_t count = zip_get_num_entries(archive.zip.get(), 0);
    if (count > most_entries)
        throw failure(std::to_string(count) + " entries; at most " + std::to_string(most_entries) +
                      " are read");
    // check all before unpacking the first
    std::vector<zip_stat_t> entries(static_cast<std::size_t>(count));
    zip_uint64_t unpacked = 0;
    for (std::size_t i = 0; i < entries.size(); ++i) {
        zip_stat_t& facts = entries[i];
        archive.check(zip_stat_index(archive.zip.get(), i, 0, &facts) == 0);
        if ((facts.valid & ZIP_STAT_NAME) == 0 || (facts.valid & ZIP_STAT_SIZE) == 0)
            throw failure("an entry without a name or a size");
        if (is_refused(facts.name)) throw failure("an entry names a place outside of the archive");
        if (facts.size > most_bytes - unpacked)
            throw failure("more than " + std::to_string(most_bytes) + " bytes when unpacked");
        unpacked += facts.size;
    }
    lua_newtable(L);
    for (std::size_t i = 0; i < entries.size(); ++i) {
        lua_createtable(L, 2, 0);
        push(L, entries[i].name);
        lua_rawseti(L, -2, 1);
        push(L, read_entry(archive, i, entries[i].size));
        lua_rawseti(L, -2, 2);
        lua_rawseti(L, -2, static_cast<int>(i + 1));
    }
    return 1;
}

}  // namespace

void open_archives(lua_State* L) {
    lua_newtable(L);
    add_function<pack>(L, "pack");
    add_function<unpack>(L, "unpack");
    lua_setfield(L, -2, "zip");
}

}  // namespace limax::host
