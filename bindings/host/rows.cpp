// rows.cpp: host.rows: lines of JSON of a .npy file that scripts/lib/base/npy_records.lua writes:
// the fields of a row side by side, each of one of five types, which its header names.
#include "rows.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
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
    add_function<lines>(L, "lines");
    lua_setfield(L, -2, "rows");
}

}  // namespace limax::host
