// material.cpp: reading and checking the material table. The only place of the engine that reads
// JSON from outside.
#include "body/material.h"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <system_error>

#include "base/error.h"

namespace limax {

namespace {

using json = nlohmann::json;

constexpr const char* schema = "limax.materials/1";
constexpr std::size_t most_bytes = std::size_t{1} << 20;  // tables have a few thousand
constexpr int most_depth = 20;  // of nested JSON; tables have 3, and json::dump() recurses

// The engine's own limits: a table's range may be narrower, never wider. Amplitude below 1 keeps
// rest lengths above 0; the stiffness range keeps the time step between about 1e-6 and 1e-2 s; the
// others are wide but finite.
struct limit {
    const char* name;
    double limax_material::*number;
    const char* unit;
    double minimum, maximum;
    bool muscles_only;
};
constexpr limit limits[material_table::field_count] = {
    {"stiffness", &limax_material::stiffness, "N/m", 1, 1e7, false},
    {"mass_per_site", &limax_material::mass_per_site, "kg", 1e-6, 1e4, false},
    {"damping_ratio", &limax_material::damping_ratio, "1", 0, 2, false},
    {"amplitude", &limax_material::amplitude, "1", 0, 0.95, true},
    {"phase", &limax_material::phase, "rad", 0, 3.141592653589793, true},
    {"stiffness_floor", &limax_material::stiffness_floor, "1", 0, 1, false},
};

constexpr const char* kinds[] = {"empty", "passive", "expanding",
                                 "contracting"};  // limax_material_kind

std::string all_fields() {
    std::string names;
    for (const limit& l : limits) names += (names.empty() ? "" : ", ") + std::string(l.name);
    return names;
}

// Index of a field in `limits`, or -1.
int find_field(const std::string& name) {
    for (int i = 0; i < material_table::field_count; ++i)
        if (name == limits[i].name) return i;
    return -1;
}

bool has_field(int32_t kind, const limit& l) {
    return kind != LIMAX_EMPTY && (kind != LIMAX_PASSIVE || !l.muscles_only);
}

std::string range_text(const material_field& field) {
    return format("%.9g to %.9g%s", field.minimum, field.maximum,
                  field.unit == "1" ? "" : (" " + field.unit).c_str());
}

// Why a field of a material cannot have this value; empty if it can.
std::string refusal(int32_t kind, const limit& l, const material_field& field, double value) {
    if (!has_field(kind, l)) {
        if (value == 0) return "";
        return format("%s is %.9g; a material of kind %s has none, so it must be 0 or absent",
                      l.name, value, kinds[kind]);
    }
    if (value >= field.minimum && value <= field.maximum) return "";
    return format("%s is %.9g; it must be %s", l.name, value, range_text(field).c_str());
}

// A JSON value as text, truncated.
std::string shown(const json& value) {
    std::string text = value.dump();
    if (text.size() > 60) text = text.substr(0, 57) + "...";
    return text;
}

}  // namespace

// Reads one table; every message begins with `origin` and the place within the table.
class material_reader {
public:
    explicit material_reader(const std::string& origin) : origin_(origin) {}

    material_table read(std::string_view text) {
        if (text.size() > most_bytes)
            refuse("", format("longer than %zu bytes, the limit for a material table", most_bytes));
        const json root = parse(text);
        if (!root.is_object())
            refuse("",
                   "expected an object with schema, name, fields, materials, not " + shown(root));
        const std::string stated = string_of(root, "", "schema");
        if (stated != schema)
            refuse("", "schema is \"" + stated + "\"; this engine reads \"" + schema + "\"");
        only(root, "", {"schema", "name", "note", "fields", "materials"});
        table_.name_ = string_of(root, "", "name");
        if (root.contains("note")) string_of(root, "", "note");
        read_fields(member(root, "", "fields"));
        read_materials(member(root, "", "materials"));
        return std::move(table_);
    }

private:
    [[noreturn]] void refuse(const std::string& place, const std::string& text) const {
        fail(LIMAX_INVALID_FILE, origin_ + ": " + (place.empty() ? "" : place + ": ") + text);
    }

    // Refuses broken JSON with line and column, and objects with the same field twice.
    json parse(std::string_view text) const {
        std::vector<std::set<std::string>> open;
        const auto watch = [&](int depth, json::parse_event_t event, json& value) {
            if (event == json::parse_event_t::object_start) open.emplace_back();
            if (event == json::parse_event_t::object_end) open.pop_back();
            if (depth > most_depth) refuse("", format("nested deeper than %d levels", most_depth));
            if (event == json::parse_event_t::key &&
                !open.back().insert(value.get<std::string>()).second)
                refuse("", "the field " + shown(value) + " occurs twice in one object");
            return true;
        };
        try {
            return json::parse(text, watch);
        } catch (const json::parse_error& mistake) {
            const std::size_t byte = std::min(mistake.byte ? mistake.byte - 1 : 0, text.size());
            const auto end = text.begin() + static_cast<std::ptrdiff_t>(byte);
            const auto line = 1 + std::count(text.begin(), end, '\n');
            const std::size_t line_start =
                byte ? text.rfind('\n', byte - 1) + 1 : 0;  // npos + 1 is 0
            std::string reason = mistake.what();
            const std::size_t colon = reason.find(": ", reason.find("column "));
            if (colon != std::string::npos) reason = reason.substr(colon + 2);
            refuse(format("line %ld, column %zu", long(line), byte - line_start + 1),
                   "broken JSON: " + reason);
        } catch (const json::exception& mistake) {  // such as a number too large for a double
            refuse("", std::string("broken JSON: ") + mistake.what());
        }
    }

    const json& member(const json& object, const std::string& place, const char* name) const {
        const auto found = object.find(name);
        if (found == object.end()) refuse(place, format("the field %s is missing", name));
        return *found;
    }
    std::string string_of(const json& object, const std::string& place, const char* name) const {
        const json& value = member(object, place, name);
        if (!value.is_string() || value.get<std::string>().empty())
            refuse(place, std::string(name) + " is " + shown(value) +
                              "; it must be a string that is not empty");
        return value.get<std::string>();
    }
    double number_of(const json& object, const std::string& place, const char* name,
                     const std::string& range) const {
        const json& value = member(object, place, name);
        if (!value.is_number())
            refuse(place,
                   std::string(name) + " is " + shown(value) + "; it must be a number" + range);
        return value.get<double>();
    }
    void only(const json& object, const std::string& place,
              const std::vector<std::string>& names) const {
        for (const auto& [name, value] : object.items()) {
            if (std::find(names.begin(), names.end(), name) != names.end()) continue;
            std::string list;
            for (const std::string& n : names) list += (list.empty() ? "" : ", ") + n;
            refuse(place, "unknown field " + shown(name) + "; the fields here are " + list);
        }
    }

    void read_fields(const json& fields) {
        if (!fields.is_object())
            refuse("", "fields is " + shown(fields) + "; it must be an object");
        std::vector<std::string> names;
        for (const limit& l : limits) names.emplace_back(l.name);
        only(fields, "fields", names);
        for (int i = 0; i < material_table::field_count; ++i) {
            const limit& l = limits[i];
            const std::string place = std::string("fields, ") + l.name;
            const json& entry = member(fields, "fields", l.name);
            if (!entry.is_object()) refuse(place, "expected an object, not " + shown(entry));
            only(entry, place, {"unit", "minimum", "maximum", "source"});
            material_field& field = table_.fields_[std::size_t(i)];
            field.unit = string_of(entry, place, "unit");
            field.source = string_of(entry, place, "source");
            field.minimum = number_of(entry, place, "minimum", "");
            field.maximum = number_of(entry, place, "maximum", "");
            if (field.unit != l.unit)
                refuse(place, "unit is \"" + field.unit + "\"; it must be \"" + l.unit + "\"");
            for (const auto& [name, bound] :
                 {std::pair("minimum", field.minimum), std::pair("maximum", field.maximum)})
                if (!(bound >= l.minimum && bound <= l.maximum))
                    refuse(place, format("%s is %.9g; the engine allows %.9g to %.9g", name, bound,
                                         l.minimum, l.maximum));
            if (field.minimum > field.maximum)
                refuse(place,
                       format("minimum %.9g is above maximum %.9g", field.minimum, field.maximum));
        }
    }

    void read_materials(const json& list) {
        if (!list.is_array()) refuse("", "materials is " + shown(list) + "; it must be a list");
        if (list.size() < 2 || list.size() > LIMAX_MAX_MATERIALS)
            refuse("",
                   format("materials has %zu entries; it must have 2 to %d, the empty one first",
                          list.size(), int(LIMAX_MAX_MATERIALS)));
        for (std::size_t i = 0; i < list.size(); ++i) read_material(list[i], int(i) + 1);
    }

    void read_material(const json& entry, int position) {
        std::string place = format("material %d", position);
        if (!entry.is_object()) refuse(place, "expected an object, not " + shown(entry));
        limax_material material = {};
        const std::string name = string_of(entry, place, "name");
        for (const char c : name)
            if (static_cast<unsigned char>(c) < ' ')
                refuse(place, "name is " + shown(name) + "; it must have no control characters");
        place += " \"" + name + "\"";
        std::vector<std::string> names = {"name", "letter", "kind"};
        for (const limit& l : limits) names.emplace_back(l.name);
        only(entry, place, names);

        if (name.size() >= sizeof material.name)
            refuse(place, format("name has %zu bytes; it must have at most %zu", name.size(),
                                 sizeof material.name - 1));
        std::memcpy(material.name, name.data(), name.size());
        const std::string letter = string_of(entry, place, "letter");
        if (letter.size() != 1 || letter[0] <= ' ' || letter[0] > '~')
            refuse(place,
                   "letter is " + shown(letter) + "; it must be one visible ASCII character");
        material.letter[0] = letter[0];
        material.kind = kind_of(entry, place, position);

        for (const limax_material& other : table_.materials_) {
            if (name == other.name) refuse(place, "an earlier material has the same name");
            if (letter == other.letter)
                refuse(place,
                       format("letter \"%s\" is already used by \"%s\"", other.letter, other.name));
        }
        for (int i = 0; i < material_table::field_count; ++i) {
            const limit& l = limits[i];
            const material_field& field = table_.fields_[std::size_t(i)];
            const bool needed = has_field(material.kind, l);
            if (!needed && !entry.contains(l.name)) continue;
            const double value =
                number_of(entry, place, l.name, needed ? ", " + range_text(field) : "");
            const std::string why = refusal(material.kind, l, field, value);
            if (!why.empty()) refuse(place, why);
            material.*l.number = value;
        }
        table_.materials_.push_back(material);
    }

    int32_t kind_of(const json& entry, const std::string& place, int position) const {
        const std::string kind = string_of(entry, place, "kind");
        const auto found = std::find(std::begin(kinds), std::end(kinds), kind);
        if (found == std::end(kinds))
            refuse(place, "kind is " + shown(kind) +
                              "; it must be empty, passive, expanding or contracting");
        const auto index = static_cast<int32_t>(found - std::begin(kinds));
        if ((position == 1) != (index == LIMAX_EMPTY))
            refuse(place, position == 1
                              ? "kind is \"" + kind + "\"; the first material must be the empty one"
                              : "kind is \"empty\"; only the first material may be");
        return index;
    }

    std::string origin_;
    material_table table_;
};

material_table material_table::parse(std::string_view text, const std::string& origin) {
    return material_reader(origin).read(text);
}

material_table material_table::load(const std::string& path) {
    const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rb"),
                                                               &std::fclose);
    if (!file) fail(LIMAX_IO, path + ": " + std::generic_category().message(errno));
    std::string text;
    char piece[4096];
    std::size_t length;
    // a device or a pipe may be endless: at most one piece more than the limit is read
    while (text.size() <= most_bytes &&
           (length = std::fread(piece, 1, sizeof piece, file.get())) > 0)
        text.append(piece, length);
    if (std::ferror(file.get()))
        fail(LIMAX_IO, path + ": " + std::generic_category().message(errno));
    return parse(text, path);
}

const limax_material& material_table::at(int32_t index) const {
    if (index < 0 || index >= count())
        fail(LIMAX_INVALID_ARGUMENT,
             format("material %lld does not exist; there are %d", from_one(index), count()));
    return materials_[std::size_t(index)];
}

const material_field& material_table::field(const std::string& name) const {
    const int i = find_field(name);
    if (i < 0)
        fail(LIMAX_INVALID_ARGUMENT,
             "unknown material field \"" + name + "\"; the fields are " + all_fields());
    return fields_[std::size_t(i)];
}

void material_table::set(int32_t index, const std::string& name, double value) {
    const material_field& checked = field(name);
    const limit& l = limits[find_field(name)];
    const limax_material& material = at(index);
    const std::string why = refusal(material.kind, l, checked, value);
    if (!why.empty())
        fail(LIMAX_INVALID_ARGUMENT, format("material \"%s\": ", material.name) + why);
    materials_[std::size_t(index)].*l.number = value;
}

}  // namespace limax
