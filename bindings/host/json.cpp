// json.cpp: host.json, and Lua tables to JSON text. Numbers are the shortest text that reads back
// equal, independent of the locale; keys are sorted, so equal values give equal bytes.
#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <stdexcept>
#include <vector>

#include "guard.h"
#include "json.h"

namespace limax::host {
namespace {

constexpr std::size_t longest_place = 120;  // bytes of a path in a message

class writer {
public:
    writer(lua_State* L, int indent) : L_(L), indent_(indent) {}

    std::string take(int index) {
        value(index < 0 ? index + lua_gettop(L_) + 1 : index);
        return std::move(text_);
    }

private:
    // A key, or an index if the key is empty.
    struct step {
        std::string_view key;
        int index;
    };

    [[noreturn]] void refuse(const std::string& what) const {
        std::string place;
        for (const step& each : path_) {
            if (each.key.data() == nullptr)
                place += "[" + std::to_string(each.index) + "]";
            else
                place.append(place.empty() ? "" : ".").append(each.key);
        }
        if (!place.empty()) place = " at " + place;
        if (place.size() > longest_place) place = place.substr(0, longest_place) + "...";
        throw std::runtime_error("cannot write JSON: " + what + place);
    }

    void value(int index) {
        switch (lua_type(L_, index)) {
            case LUA_TNIL: text_ += "null"; return;
            case LUA_TBOOLEAN: text_ += lua_toboolean(L_, index) != 0 ? "true" : "false"; return;
            case LUA_TNUMBER: number(lua_tonumber(L_, index)); return;
            case LUA_TSTRING: string(text_at(L_, index)); return;
            case LUA_TTABLE: table(index); return;
            case LUA_TUSERDATA: {
                push_json_null(L_);
                const bool null = lua_rawequal(L_, -1, index) != 0;
                lua_pop(L_, 1);
                if (null) {
                    text_ += "null";
                    return;
                }
                [[fallthrough]];
            }
            default: refuse(std::string("a ") + luaL_typename(L_, index));
        }
    }

    void number(double x) {
        if (!std::isfinite(x)) refuse(std::isnan(x) ? "NaN" : "infinity");
        const bool whole = std::trunc(x) == x;
        char digits[40];
        std::to_chars_result end{};
        if (x == 0 && std::signbit(x)) {
            text_ += "-0.0";
            return;
        }
        if (whole && std::fabs(x) <= json_largest_integer)
            end = std::to_chars(digits, digits + sizeof digits, static_cast<long long>(x));
        else if (whole)
            // readers refuse long whole numbers: write an exponent
            end = std::to_chars(digits, digits + sizeof digits, x, std::chars_format::scientific);
        else
            end = std::to_chars(digits, digits + sizeof digits, x);
        text_.append(digits, end.ptr);
    }

    void string(std::string_view bytes) {
        if (const std::size_t bad = find_invalid_utf8(bytes); bad != std::string_view::npos)
            refuse("a string that is not UTF-8 (byte " + std::to_string(bad + 1) + ")");
        text_ += '"';
        std::size_t plain = 0;  // start of the letters that need no escape
        for (std::size_t i = 0; i < bytes.size(); ++i) {
            const char letter = bytes[i];
            const auto code = static_cast<unsigned char>(letter);
            if (code >= 0x20 && letter != '"' && letter != '\\') continue;
            text_.append(bytes, plain, i - plain);
            plain = i + 1;
            switch (letter) {
                case '"': text_ += "\\\""; break;
                case '\\': text_ += "\\\\"; break;
                case '\n': text_ += "\\n"; break;
                case '\r': text_ += "\\r"; break;
                case '\t': text_ += "\\t"; break;
                default:
                    text_ += "\\u00";
                    text_ += "0123456789abcdef"[code >> 4];
                    text_ += "0123456789abcdef"[code & 15];
            }
        }
        text_.append(bytes, plain);
        text_ += '"';
    }

    void table(int index) {
        if (depth_ == json_nesting)
            refuse("a table nested deeper than " + std::to_string(json_nesting) +
                   " levels (does it contain itself?)");
        luaL_checkstack(L_, 8, "JSON");
        ++depth_;
        if (is_json_array(L_, index) || lua_objlen(L_, index) > 0)
            array(index);
        else
            object(index);
        --depth_;
    }

    void array(int index) {
        const int length = static_cast<int>(lua_objlen(L_, index));
        bool flat = true;  // no containers inside: stays on one line
        int entries = 0;
        for (lua_pushnil(L_); lua_next(L_, index) != 0; lua_pop(L_, 1)) {
            if (lua_type(L_, -2) != LUA_TNUMBER) {
                const std::string key = lua_type(L_, -2) == LUA_TSTRING
                                            ? std::string(text_at(L_, -2))
                                            : luaL_typename(L_, -2);
                refuse("an array with the key " + key);
            }
            const double key = lua_tonumber(L_, -2);
            if (key < 1 || key > length || std::trunc(key) != key) refuse("an array with gaps");
            flat = flat && !lua_istable(L_, -1);
            ++entries;
        }
        if (entries != length) refuse("an array with gaps");
        text_ += '[';
        for (int i = 1; i <= length; ++i) {
            if (i > 1) text_ += flat && indent_ > 0 ? ", " : ",";
            if (!flat) line();
            path_.push_back({{}, i});
            lua_rawgeti(L_, index, i);
            value(lua_gettop(L_));
            lua_pop(L_, 1);
            path_.pop_back();
        }
        close(']', length == 0 || flat);
    }

    void object(int index) {
        const std::size_t first = keys_.size();
        for (lua_pushnil(L_); lua_next(L_, index) != 0; lua_pop(L_, 1)) {
            if (lua_type(L_, -2) != LUA_TSTRING)
                refuse(std::string("a table with a key that is a ") + luaL_typename(L_, -2));
            keys_.push_back(text_at(L_, -2));
        }
        const std::size_t last = keys_.size();
        std::sort(keys_.begin() + static_cast<std::ptrdiff_t>(first), keys_.end());
        text_ += '{';
        for (std::size_t k = first; k < last; ++k) {
            // nested tables add their keys and remove them
            const std::string_view key = keys_[k];
            if (k > first) text_ += ',';
            line();
            string(key);
            path_.push_back({key, 0});
            text_ += indent_ > 0 ? ": " : ":";
            push(L_, key);
            lua_rawget(L_, index);
            value(lua_gettop(L_));
            lua_pop(L_, 1);
            path_.pop_back();
        }
        close('}', first == last);
        keys_.resize(first);
    }

    void line() {
        if (indent_ == 0) return;
        text_ += '\n';
        text_.append(static_cast<std::size_t>(depth_) * static_cast<std::size_t>(indent_), ' ');
    }

    void close(char bracket, bool same_line) {
        if (!same_line) {
            --depth_;
            line();
            ++depth_;
        }
        text_ += bracket;
    }

    lua_State* L_;
    int indent_;
    int depth_ = 0;
    std::string text_;
    // of all tables from the outermost to this one, which keep their keys alive
    std::vector<std::string_view> keys_;
    std::vector<step> path_;
};

// In the registry: the value of null, and the metatable of arrays.
const char* const null_key = "limax.json.null";
const char* const array_key = "limax.json.array";

constexpr int largest_indent = 16;

int null_text(lua_State* L) { return push(L, "null"); }

int encode(lua_State* L) {
    luaL_checkany(L, 1);
    int indent = 0;
    if (!lua_isnoneornil(L, 2)) {
        luaL_checktype(L, 2, LUA_TTABLE);
        lua_getfield(L, 2, "indent");
        indent = luaL_optint(L, -1, 0);
        luaL_argcheck(L, indent >= 0 && indent <= largest_indent, 2, "indent must be 0 to 16");
    }
    return push(L, encode_json(L, 1, indent));
}

int decode(lua_State* L) {
    decode_json(L, text_argument(L, 1), luaL_optstring(L, 2, "JSON text"));
    return 1;
}

int array(lua_State* L) {
    luaL_checktype(L, 1, LUA_TTABLE);
    if (lua_getmetatable(L, 1) != 0 && !is_json_array(L, 1))
        return luaL_argerror(L, 1, "a table with a metatable cannot be marked as an array");
    mark_json_array(L, 1);
    lua_settop(L, 1);
    return 1;
}

int is_array(lua_State* L) {
    return push(L, lua_istable(L, 1) && (is_json_array(L, 1) || lua_objlen(L, 1) > 0));
}

}  // namespace

std::size_t find_invalid_utf8(std::string_view text) {
    const auto is_ascii = [](char letter) {
        return (static_cast<unsigned char>(letter) & 0x80) == 0;
    };
    if (std::all_of(text.begin(), text.end(), is_ascii)) return std::string_view::npos;
    // the smallest letter of a sequence with so many continuation bytes
    constexpr unsigned least[] = {0, 0x80, 0x800, 0x10000};
    for (std::size_t i = 0, more = 0; i < text.size(); i += more + 1) {
        const auto lead = static_cast<unsigned char>(text[i]);
        const int ones = std::countl_one(lead);
        if (ones == 1 || ones > 4) return i;
        more = ones == 0 ? 0 : static_cast<std::size_t>(ones) - 1;
        unsigned letter = lead & (0xffu >> (ones + 1));
        if (i + more >= text.size()) return i;
        for (const char next : text.substr(i + 1, more)) {
            if ((static_cast<unsigned char>(next) & 0xc0) != 0x80) return i;
            letter = letter << 6 | (static_cast<unsigned char>(next) & 0x3fu);
        }
        const bool surrogate = letter >> 11 == 0x1b;
        if (letter < least[more] || surrogate || letter > 0x10ffff) return i;
    }
    return std::string_view::npos;
}

std::string encode_json(lua_State* L, int index, int indent) {
    return writer(L, indent).take(index);
}

void push_json_null(lua_State* L) { lua_getfield(L, LUA_REGISTRYINDEX, null_key); }

void mark_json_array(lua_State* L, int index) {
    lua_pushvalue(L, index);
    luaL_getmetatable(L, array_key);
    lua_setmetatable(L, -2);
    lua_pop(L, 1);
}

bool is_json_array(lua_State* L, int index) {
    if (lua_getmetatable(L, index) == 0) return false;
    luaL_getmetatable(L, array_key);
    const bool same = lua_rawequal(L, -1, -2) != 0;
    lua_pop(L, 2);
    return same;
}

void open_json(lua_State* L) {
    luaL_newmetatable(L, array_key);
    lua_newuserdata(L, 0);
    lua_newtable(L);
    add_function<null_text>(L, "__tostring");
    lua_setmetatable(L, -2);
    lua_setfield(L, LUA_REGISTRYINDEX, null_key);
    lua_pop(L, 1);

    lua_newtable(L);
    add_function<encode>(L, "encode");
    add_function<decode>(L, "decode");
    add_function<array>(L, "array");
    add_function<is_array>(L, "is_array");
    push_json_null(L);
    lua_setfield(L, -2, "null");
    lua_setfield(L, -2, "json");
}

}  // namespace limax::host
