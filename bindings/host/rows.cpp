// rows.cpp: host.rows. A .npy file (format 2.0) holds the fields of a row side by side, each of
// one of five types; its header names them. Memory of the engine and lists of Lua are its sources.
#include "rows.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <vector>

#include "guard.h"
#include "json.h"

namespace limax::host {
namespace {

static_assert(std::endian::native == std::endian::little, ".npy files are little-endian");

constexpr std::string_view magic{"\x93NUMPY\2\0", 8};
constexpr std::size_t header_at = 12;  // after the magic and four bytes of length
constexpr std::size_t most_fields = 10000;
constexpr std::size_t widest_field = 1 << 20;  // bytes
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

enum class type { number, whole, whole32, truth, text };

// As NumPy names them; a text is followed by its bytes.
constexpr std::string_view type_names[] = {"<f8", "<i8", "<i4", "|b1", "|S"};

struct field {
    std::string name;
    type kind = type::number;
    std::size_t size = 8;   // bytes of one value
    std::size_t count = 1;  // values
    bool is_list = false;
    std::size_t offset = 0;  // in a row

    std::size_t bytes() const { return size * count; }
};

std::size_t size_of(type kind) {
    return kind == type::truth ? 1 : kind == type::whole32 ? 4 : kind == type::text ? 1 : 8;
}

template <class T>
T read(const char* from) {
    T value;
    std::memcpy(&value, from, sizeof value);
    return value;
}

template <class T>
void write(char* to, T value) {
    std::memcpy(to, &value, sizeof value);
}

// ---- packing ------------------------------------------------------------------------------------

std::string header_of(const std::vector<field>& fields, std::size_t rows) {
    std::string text = "{'descr': [";
    for (const field& each : fields) {
        text += "('" + each.name + "', '";
        text += type_names[static_cast<int>(each.kind)];
        if (each.kind == type::text) text += std::to_string(each.size);
        text += each.is_list ? "', (" + std::to_string(each.count) + ",)), " : "'), ";
    }
    text += "], 'fortran_order': False, 'shape': (" + std::to_string(rows) + ",), }";
    // header and line break end at a multiple of 64 bytes
    text.append(63 - (header_at + text.size()) % 64, ' ') += '\n';
    std::string header(magic);
    const auto length = static_cast<std::uint32_t>(text.size());
    header.append(reinterpret_cast<const char*>(&length), sizeof length);
    return header + text;
}

// In place of a type: a whole number in memory that becomes a text of 16 digits.
constexpr std::string_view hexadecimal = "hexadecimal";
constexpr std::size_t hexadecimal_digits = 16;

// A field and where its values come from: memory, or values of a list of Lua by row.
struct source {
    field is;
    const char* memory = nullptr;
    std::size_t stride = 0;
    bool is_hexadecimal = false;
    int list = 0;   // the stack's index
    int first = 0;  // keys of the field's table from this one on lead into an entry of the list
    int last = -1;
    int entry = 0;  // the stack's index of that table
};

// Pushes the value of row i; nil where there is none.
void push_value(lua_State* L, const source& from, int i) {
    lua_rawgeti(L, from.list, i);
    for (int key = from.first; key <= from.last && lua_istable(L, -1); ++key) {
        lua_rawgeti(L, from.entry, key);
        lua_rawget(L, -2);
        lua_replace(L, -2);
    }
}

void put_number(char* to, type kind, double value, bool is_there) {
    switch (kind) {
        case type::number: write(to, is_there && std::isfinite(value) ? value : nan); break;
        case type::whole: write(to, is_there ? static_cast<std::int64_t>(value) : -1); break;
        case type::whole32: write(to, is_there ? static_cast<std::int32_t>(value) : -1); break;
        default: write(to, static_cast<char>(is_there && value != 0));
    }
}

// The value on top of the stack.
void put_value(lua_State* L, const field& is, char* to) {
    if (is.kind == type::text) {
        const std::string_view text = lua_isnil(L, -1) ? std::string_view{} : text_at(L, -1);
        std::memcpy(to, text.data(), std::min(text.size(), is.size));
        return;
    }
    for (std::size_t k = 0; k < is.count; ++k) {
        if (is.is_list && lua_istable(L, -1))
            lua_rawgeti(L, -1, static_cast<int>(k + 1));
        else
            lua_pushvalue(L, -1);
        if (lua_isboolean(L, -1))
            write(to + k, static_cast<char>(lua_toboolean(L, -1)));
        else
            put_number(to + k * is.size, is.kind, lua_tonumber(L, -1), lua_isnumber(L, -1) != 0);
        lua_pop(L, 1);
    }
}

void put_memory(const source& from, std::size_t row, char* to) {
    const field& is = from.is;
    const char* const at = from.memory + row * from.stride;
    if (from.is_hexadecimal) {
        const auto value = read<std::uint64_t>(at);
        for (std::size_t k = 0; k < hexadecimal_digits; ++k)
            to[k] = "0123456789abcdef"[value >> (60 - 4 * k) & 15];
        return;
    }
    std::memcpy(to, at, is.bytes());
    if (is.kind != type::number) return;
    bool finite = true;
    for (std::size_t k = 0; k < is.count; ++k)
        finite = finite && std::isfinite(read<double>(to + k * 8));
    for (std::size_t k = 0; k < is.count && !finite; ++k) write(to + k * 8, nan);
}

// Finds the width of texts and lists of Lua. Returns whether any row has a value.
bool measure(lua_State* L, source& from, std::size_t rows) {
    std::size_t longest = 0;
    bool any = false;
    for (std::size_t i = 1; i <= rows; ++i) {
        push_value(L, from, static_cast<int>(i));
        any = any || !lua_isnil(L, -1);
        if (from.is.kind == type::text || lua_istable(L, -1))
            longest = std::max<std::size_t>(longest, lua_objlen(L, -1));
        lua_pop(L, 1);
    }
    if (from.is.kind == type::text) from.is.size = longest;
    // a list of whole numbers is never left out
    if (from.is.is_list)
        from.is.count = std::max<std::size_t>(longest, from.is.kind == type::whole ? 1 : 0);
    return any && from.is.bytes() > 0;
}

bool any_number(const source& from, std::size_t rows) {
    if (from.is.kind != type::number) return true;
    for (std::size_t i = 0; i < rows; ++i)
        if (std::isfinite(read<double>(from.memory + i * from.stride))) return true;
    return false;
}

// The field that the table on top of the stack describes: { name, type, list of Lua, key ... }, or
// { name, type, FFI array, offset, stride, count }; a type that ends in "[]" is a list.
source source_of(lua_State* L) {
    source from;
    from.entry = lua_gettop(L);
    const auto get = [&](int k) {
        lua_rawgeti(L, from.entry, k);
        return lua_gettop(L);
    };
    from.is.name = text_at(L, get(1));
    std::string_view kind = text_at(L, get(2));
    from.is.is_list = kind.ends_with("[]");
    if (from.is.is_list) kind.remove_suffix(2);
    from.is_hexadecimal = kind == hexadecimal;
    if (from.is_hexadecimal) kind = type_names[static_cast<int>(type::text)];
    const auto found = std::find(std::begin(type_names), std::end(type_names), kind);
    if (found == std::end(type_names)) throw std::runtime_error("rows: an unknown type");
    from.is.kind = static_cast<type>(found - std::begin(type_names));
    from.is.size = size_of(from.is.kind);
    from.list = get(3);
    if (lua_istable(L, from.list)) {
        from.first = 4;
        from.last = static_cast<int>(lua_objlen(L, from.entry));
        return from;
    }
    from.memory = static_cast<const char*>(lua_topointer(L, from.list)) +
                  static_cast<std::size_t>(lua_tonumber(L, get(4)));
    from.stride = static_cast<std::size_t>(lua_tonumber(L, get(5)));
    const auto count = static_cast<std::size_t>(lua_tonumber(L, get(6)));
    if (from.is.is_list) from.is.count = count;
    if (from.is.kind == type::text) from.is.size = from.is_hexadecimal ? hexadecimal_digits : count;
    return from;
}

// pack(rows, fields) -> bytes of a .npy file
int pack(lua_State* L) {
    const auto rows = static_cast<std::size_t>(luaL_checkint(L, 1));
    luaL_checktype(L, 2, LUA_TTABLE);
    std::vector<source> sources;
    std::vector<field> fields;
    std::size_t width = 0;
    const int count = static_cast<int>(lua_objlen(L, 2));
    luaL_checkstack(L, 8 * count + 8, "rows");
    for (int k = 1; k <= count; ++k) {
        lua_rawgeti(L, 2, k);
        source from = source_of(L);
        const bool any = from.memory != nullptr ? any_number(from, rows) : measure(L, from, rows);
        if (!any) continue;
        from.is.offset = width;
        width += from.is.bytes();
        sources.push_back(from);
        fields.push_back(from.is);
    }
    std::string npy = header_of(fields, rows);
    const std::size_t begin = npy.size();
    npy.resize(begin + rows * width);
    for (const source& from : sources) {
        char* to = npy.data() + begin + from.is.offset;
        for (std::size_t i = 0; i < rows; ++i, to += width) {
            if (from.memory != nullptr) {
                put_memory(from, i, to);
                continue;
            }
            push_value(L, from, static_cast<int>(i + 1));
            put_value(L, from.is, to);
            lua_pop(L, 1);
        }
    }
    return push(L, npy);
}

// ---- reading ------------------------------------------------------------------------------------

// Reads the header of a file that anybody may have written.
class header_reader {
public:
    explicit header_reader(std::string_view npy) : npy_(npy) {
        if (!npy.starts_with(magic) || npy.size() < header_at)
            fail("is not a NumPy array of records");
        const std::size_t length = read<std::uint32_t>(npy.data() + magic.size());
        if (length > npy.size() - header_at) fail("ends within its header");
        rest_ = npy.substr(header_at, length);
        data = header_at + length;
        take("{'descr': [");
        while (!try_take("]")) {
            if (fields.size() == most_fields) fail("has too many fields");
            fields.push_back(next_field());
            width += fields.back().bytes();
        }
        take(", 'fortran_order': False, 'shape': (");
        rows = number(std::numeric_limits<std::uint32_t>::max());
        take(",), }");
        if (npy.size() - data != rows * width) fail("has not the size that its header states");
    }

    std::vector<field> fields;
    std::size_t rows = 0, width = 0, data = 0;

private:
    [[noreturn]] static void fail(const char* what) { throw failure(what); }

    bool try_take(std::string_view word) {
        const bool there = rest_.starts_with(word);
        if (there) rest_.remove_prefix(word.size());
        return there;
    }
    void take(std::string_view word) {
        if (!try_take(word)) fail("has a header that limax does not write");
    }
    std::size_t number(std::size_t most) {
        std::size_t value = 0;
        if (rest_.empty() || rest_[0] < '0' || rest_[0] > '9') take("a number");
        while (!rest_.empty() && rest_[0] >= '0' && rest_[0] <= '9') {
            value = 10 * value + static_cast<std::size_t>(rest_[0] - '0');
            if (value > most) fail("states too large a number in its header");
            rest_.remove_prefix(1);
        }
        return value;
    }
    field next_field() {
        field is;
        take("('");
        const std::size_t end = rest_.find('\'');
        if (end == rest_.npos || end == 0) take("a name");
        is.name = rest_.substr(0, end);
        rest_.remove_prefix(end);
        take("', '");
        int k = 0;
        while (k < 4 && !try_take(type_names[k])) ++k;
        is.kind = static_cast<type>(k);
        if (is.kind == type::text) take(type_names[k]);
        is.size = is.kind == type::text ? number(widest_field) : size_of(is.kind);
        is.is_list = try_take("', (");
        if (is.is_list) is.count = number(widest_field / 8);
        take(is.is_list ? ",)), " : "'), ");
        is.offset = width;
        return is;
    }

    std::string_view npy_, rest_;
};

// A part of a name with its escapes resolved: %2E is a dot.
std::string decoded(std::string_view part) {
    std::string text;
    for (std::size_t i = 0; i < part.size(); ++i) {
        if (part[i] != '%' || i + 2 >= part.size()) {
            text += part[i];
            continue;
        }
        const std::string_view digits = "0123456789ABCDEF";
        const std::size_t high = digits.find(part[i + 1]), low = digits.find(part[i + 2]);
        if (high == digits.npos || low == digits.npos) throw failure("has a name that is no name");
        text += static_cast<char>(high << 4 | low);
        i += 2;
    }
    return text;
}

// A step from an object or a list to one of its entries.
struct step {
    std::string key;  // as JSON, with its colon; empty in a list
    std::string name;
};

std::vector<step> steps_of(const std::string& name) {
    std::vector<step> steps;
    std::size_t from = 0;
    while (from <= name.size()) {
        const std::size_t end = std::min(name.find_first_of(".[", from + 1), name.size());
        step next{"", name.substr(from, end - from)};
        if (!next.name.starts_with('[')) {
            if (append_json_string(next.key, decoded(next.name)) != std::string_view::npos)
                throw failure("has a name that is not UTF-8");
            next.key += ':';
        }
        steps.push_back(std::move(next));
        from = end < name.size() && name[end] == '.' ? end + 1 : end;
        if (from == name.size()) break;
    }
    if (steps.size() > 8) throw failure("has a name with too many parts");
    return steps;
}

class line_writer {
public:
    explicit line_writer(const header_reader& header) : header_(header) {
        for (const field& each : header.fields) paths_.push_back(steps_of(each.name));
    }

    std::string text(const char* data) {
        for (std::size_t i = 0; i < header_.rows; ++i, data += header_.width) {
            text_ += '{';
            open_ = nullptr;
            depth_ = 0;
            for (std::size_t k = 0; k < paths_.size(); ++k) add(header_.fields[k], paths_[k], data);
            while (depth_ > 0) close();
            text_ += "}\n";
            if (i == 0) text_.reserve(text_.size() * header_.rows * 5 / 4);
        }
        return std::move(text_);
    }

private:
    using path = std::vector<step>;

    void add(const field& is, const path& steps, const char* row) {
        const char* const at = row + is.offset;
        const std::size_t count = values(is, at);
        // a list of whole numbers is never left out
        if (count == 0 && !(is.is_list && is.kind == type::whole)) return;
        enter(steps);
        text_ += steps.back().key;
        if (is.is_list) text_ += '[';
        for (std::size_t k = 0; k < count; ++k) {
            if (k > 0) text_ += ',';
            value(is, at + k * is.size);
        }
        if (is.is_list) text_ += ']';
    }

    // Closes and opens objects and lists up to the one that the last step is in.
    void enter(const path& steps) {
        std::size_t common = 0;
        while (common < depth_ && common + 1 < steps.size() &&
               (*open_)[common].name == steps[common].name)
            ++common;
        while (depth_ > common) close();
        if (text_.back() != '{') text_ += ',';
        for (; depth_ + 1 < steps.size(); ++depth_) {
            text_ += steps[depth_].key;
            text_ += steps[depth_ + 1].key.empty() ? '[' : '{';
        }
        open_ = &steps;
    }
    void close() { text_ += (*open_)[depth_--].key.empty() ? ']' : '}'; }

    static bool is_there(const field& is, const char* at) {
        switch (is.kind) {
            case type::number: return std::isfinite(read<double>(at));
            case type::whole: return read<std::int64_t>(at) != -1;
            case type::whole32: return read<std::int32_t>(at) != -1;
            case type::truth: return true;
            default: return is.size > 0 && *at != '\0';
        }
    }
    static std::size_t values(const field& is, const char* at) {
        std::size_t count = is.count;
        while (count > 0 && !is_there(is, at + (count - 1) * is.size)) --count;
        return count;
    }

    void value(const field& is, const char* at) {
        switch (is.kind) {
            case type::number: {
                const double number = read<double>(at);
                if (!std::isfinite(number)) throw failure("has a number within a list missing");
                append_json_number(text_, number);
                return;
            }
            case type::whole:
                append_json_number(text_, static_cast<double>(read<std::int64_t>(at)));
                return;
            case type::whole32: append_json_number(text_, read<std::int32_t>(at)); return;
            case type::truth: text_ += *at != '\0' ? "true" : "false"; return;
            default: {
                std::string_view bytes(at, is.size);
                bytes = bytes.substr(0, bytes.find_last_not_of('\0') + 1);
                if (append_json_string(text_, bytes) != std::string_view::npos)
                    throw failure("has a text that is not UTF-8");
            }
        }
    }

    const header_reader& header_;
    std::vector<path> paths_;
    std::string text_;
    const path* open_ = nullptr;  // that of the last field
    std::size_t depth_ = 0;       // its steps that are open
};

int lines(lua_State* L) { return push(L, lines_of_rows(text_argument(L, 1))); }

}  // namespace

std::string lines_of_rows(std::string_view npy) {
    const header_reader header(npy);
    return line_writer(header).text(npy.data() + header.data);
}

void open_rows(lua_State* L) {
    lua_newtable(L);
    add_function<pack>(L, "pack");
    add_function<lines>(L, "lines");
    lua_setfield(L, -2, "rows");
}

}  // namespace limax::host
