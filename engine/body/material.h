// material.h: the material table, read from JSON (schema limax.materials/1), which contains the
// unit, range and source of every field. SI units.
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "limax.h"

namespace limax {

// A property of materials: one entry of the table's `fields`. Its range is within the range that
// the engine allows.
struct material_field {
    std::string unit;
    double minimum = 0;  // inclusive
    double maximum = 0;  // inclusive
    std::string source;
};

// Materials by index; material 0 is always empty and the only empty one. Every number is within its
// field's range, or 0 where the kind has no such number: the empty material has none, passive ones
// have no amplitude and no phase.
class material_table {
public:
    static constexpr int field_count = 6;

    // Throws LIMAX_IO if the file cannot be read, else as parse().
    static material_table load(const std::string& path);
    // Throws LIMAX_INVALID_FILE with a message that names origin, material, field, value and the
    // range of the field.
    static material_table parse(std::string_view text, const std::string& origin);

    const std::string& name() const { return name_; }
    int32_t count() const { return static_cast<int32_t>(materials_.size()); }
    // Throws LIMAX_INVALID_ARGUMENT on an index out of range, as everything below does.
    const limax_material& at(int32_t index) const;
    // Range checked; nothing changes when it throws.
    void set(int32_t index, const std::string& field, double value);
    const material_field& field(const std::string& name) const;

private:
    std::string name_;
    std::array<material_field, field_count> fields_;
    std::vector<limax_material> materials_;

    friend class material_reader;
};

inline bool is_muscle(const limax_material& material) {
    return material.kind == LIMAX_EXPANDING || material.kind == LIMAX_CONTRACTING;
}

}  // namespace limax
