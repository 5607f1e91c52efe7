// json_decode.cpp: JSON text to Lua tables with nlohmann's SAX parser. Stricter than the grammar:
// no duplicate keys, no whole number beyond 2^53, no nesting deeper than json_nesting.
#include <algorithm>
#include <charconv>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "guard.h"
#include "json.h"

namespace limax::host {
namespace {

constexpr std::string_view number_letters = "+-0123456789.eE";

// Refuses the text with "origin: line L, column C: what", columns counted in characters; without
// the place if the offset is npos.
[[noreturn]] void refuse(const std::string& origin, std::string_view text, std::size_t offset,
                         const std::string& what) {
    if (offset == std::string_view::npos) throw failure(origin + ": " + what);
    const std::string_view before = text.substr(0, offset);
    const auto lines = std::count(before.begin(), before.end(), '\n');
    const std::string_view line = before.substr(before.rfind('\n') + 1);
    const auto column = std::count_if(line.begin(), line.end(), [](char letter) {
        return (static_cast<unsigned char>(letter) & 0xc0) != 0x80;  // begins a character
    });
    throw failure(origin + ": line " + std::to_string(1 + lines) + ", column " +
                  std::to_string(1 + column) + ": " + what);
}

// The parser's message without "[json.exception...] parse error at line 1, column 2: ".
std::string bare(std::string message) {
    message.erase(0, message.find("] ") + 2);
    if (message.rfind("parse error", 0) == 0) message.erase(0, message.find(": ") + 2);
    return message;
}

// Builds the value on the Lua stack: an array takes one slot, an object one and one for a pending
// key.
struct builder {
    explicit builder(lua_State* L) : L_(L) {}

    bool null() {
        push_json_null(L_);
        return store();
    }
    bool boolean(bool value) {
        lua_pushboolean(L_, value);
        return store();
    }
    bool number_integer(std::int64_t value) {
        if (value >= -static_cast<std::int64_t>(json_largest_integer))
            return number(static_cast<double>(value));
        return refuse_integer(std::to_string(value));
    }
    bool number_unsigned(std::uint64_t value) {
        if (value <= static_cast<std::uint64_t>(json_largest_integer))
            return number(static_cast<double>(value));
        return refuse_integer(std::to_string(value));
    }
    // Reads the digits again: the parser has replaced the point by the locale's decimal point.
    bool number_float(double, std::string digits) {
        for (char& letter : digits)
            if (number_letters.find(letter) == std::string_view::npos) letter = '.';
        if (digits.find_first_of(".eE") == std::string::npos) return refuse_integer(digits);
        double value = 0;
        const auto read = std::from_chars(digits.data(), digits.data() + digits.size(), value);
        // too small for a double: from_chars leaves the value unchanged
        if (read.ec == std::errc::result_out_of_range) value = digits.front() == '-' ? -0.0 : 0.0;
        return number(value);
    }
    bool string(const std::string& value) {
        lua_pushlstring(L_, value.data(), value.size());
        return store();
    }
    bool binary(const nlohmann::json::binary_t&) { return refuse("binary data"); }

    bool start_object(std::size_t) { return start(true); }
    bool end_object() { return end(); }
    bool start_array(std::size_t) { return start(false); }
    bool end_array() {
        if (levels_[depth_ - 1].count == 0) mark_json_array(L_, -1);
        return end();
    }
    bool key(const std::string& name) {
        lua_pushlstring(L_, name.data(), name.size());
        lua_pushvalue(L_, -1);
        lua_rawget(L_, -3);
        const bool twice = !lua_isnil(L_, -1);
        lua_pop(L_, 1);
        return !twice || refuse("the key \"" + name + "\" comes twice");
    }
    bool parse_error(std::size_t position, const std::string&, const std::exception& error) {
        error_offset = position == 0 ? 0 : position - 1;
        return refuse(bare(error.what()));
    }

    // of a refused text; the parser reports no place of its events
    std::size_t error_offset = std::string_view::npos;
    std::string error_text;

private:
    struct level {
        bool object;
        int count;
    };

    bool refuse(std::string text) {
        error_text = std::move(text);
        return false;
    }
    bool refuse_integer(const std::string& digits) {
        return refuse("the whole number " + digits +
                      " is beyond 2^53, where a double cannot represent all of them; write it as "
                      "a string");
    }
    bool number(double value) {
        lua_pushnumber(L_, value);
        return store();
    }
    bool start(bool object) {
        if (depth_ == json_nesting)
            return refuse("nested deeper than " + std::to_string(json_nesting) + " levels");
        lua_newtable(L_);
        levels_[depth_++] = {object, 0};
        return true;
    }
    bool end() {
        --depth_;
        return store();
    }
    // Moves the value on top into the container below it; the outermost value stays.
    bool store() {
        if (depth_ == 0) return true;
        level& here = levels_[depth_ - 1];
        if (here.object)
            lua_rawset(L_, -3);
        else
            lua_rawseti(L_, -2, ++here.count);
        return true;
    }

    lua_State* L_;
    level levels_[json_nesting]{};
    int depth_ = 0;
};

}  // namespace

void decode_json(lua_State* L, std::string_view text, const std::string& origin) {
    // the parser reports no position for encoding errors
    if (const std::size_t bad = find_invalid_utf8(text); bad != std::string_view::npos)
        refuse(origin, text, bad, "not UTF-8");
    if (lua_checkstack(L, 2 * json_nesting + 8) == 0)
        throw std::runtime_error("the stack is too full to read JSON");
    const int top = lua_gettop(L);
    builder handler(L);
    if (nlohmann::json::sax_parse(text.begin(), text.end(), &handler)) return;
    lua_settop(L, top);
    refuse(origin, text, handler.error_offset, handler.error_text);
}

}  // namespace limax::host
