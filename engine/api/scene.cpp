// scene.cpp: effects and scenes of limax.h.
#include <algorithm>
#include <span>
#include <string_view>
#include <vector>

#include "api/api.h"
#include "base/fields.h"
#include "physics/sensors.h"

namespace {

using limax::fail;
using limax::format;
using namespace limax::api;

// An index into the list of effects, range checked.
const limax::effect_entry& entry_at(int32_t effect) {
    const auto& entries = limax::effect_entries();
    if (effect < 0 || effect >= static_cast<int32_t>(entries.size()))
        fail(LIMAX_INVALID_ARGUMENT, format("effect %lld does not exist; there are %zu",
                                            limax::from_one(effect), entries.size()));
    return entries[effect];
}

struct option_group {
    std::string_view name;
    std::span<const limax_field_info> fields;
};
constexpr option_group option_groups[] = {
    {"simulation", limax::simulation_fields},
    {"genome", limax::genome_fields},
    {"breeding", limax::breeding_fields},
};

std::vector<limax::scripted::parameter> parameters_of(const limax_script_parameter* parameters,
                                                      int32_t count) {
    limax::require_range("count", count, 0, limax::scripted::most_registers, "");
    if (count > 0) require("parameters", parameters);
    std::vector<limax::scripted::parameter> values;
    for (int32_t i = 0; i < count; ++i) {
        require("a parameter's name", parameters[i].name);
        values.push_back({parameters[i].name, parameters[i].components, {}});
        std::copy(parameters[i].value, parameters[i].value + 3, values.back().value);
    }
    return values;
}

}  // namespace

extern "C" {

// ---- scene ----

int32_t limax_effect_count(void) { return static_cast<int32_t>(limax::effect_entries().size()); }
limax_status limax_effect_describe(int32_t effect, limax_effect_info* out) {
    return guard([&] {
        require("out", out);
        const limax::effect_entry& entry = entry_at(effect);
        *out = {entry.name, entry.summary, entry.needs.c_str(), entry.field_count,
                entry.most_instances};
    });
}
limax_status limax_effect_field(int32_t effect, int32_t field, limax_field_info* out) {
    return guard([&] {
        require("out", out);
        const limax::effect_entry& entry = entry_at(effect);
        if (field < 0 || field >= entry.field_count)
            fail(LIMAX_INVALID_ARGUMENT, format("effect '%s' has %d fields, not %lld", entry.name,
                                                entry.field_count, limax::from_one(field)));
        const limax::effects::field& found = entry.fields[field];
        *out = {found.name, found.unit,    found.note,    found.components,
                0,          found.minimum, found.maximum, {}};
        std::copy(found.value, found.value + 3, out->value);
    });
}
limax_status limax_option_field(const char* group, int32_t field, limax_field_info* out) {
    return guard([&] {
        require("group, out", group, out);
        for (const option_group& each : option_groups) {
            if (each.name != std::string_view(group)) continue;
            if (field < 0 || field >= static_cast<int32_t>(each.fields.size())) break;
            *out = each.fields[static_cast<std::size_t>(field)];
            return;
        }
        fail(LIMAX_INVALID_ARGUMENT,
             format("option %lld of '%s' does not exist", limax::from_one(field), group));
    });
}
limax_status limax_scene_create(limax_scene** out) {
    return guard([&] {
        require("out", out);
        *out = new limax_scene;
    });
}
void limax_scene_free(limax_scene* scene) { delete scene; }
limax_status limax_scene_add(limax_scene* scene, const char* effect) {
    return change(scene, "scene", [&] {
        require("effect", effect);
        scene->it.add(effect);
    });
}
limax_status limax_scene_set(limax_scene* scene, const char* effect, const char* field,
                             const double* values, int32_t count) {
    return change(scene, "scene", [&] {
        require("effect, field, values", effect, field, values);
        scene->it.set(effect, field, values, count);
    });
}
limax_status limax_scene_set_heights(limax_scene* scene, const char* effect, const char* field,
                                     const double* heights, int32_t nx, int32_t ny) {
    return change(scene, "scene", [&] {
        require("effect, field, heights", effect, field, heights);
        scene->it.set_heights(effect, field, heights, nx, ny);
    });
}
limax_status limax_scene_add_script(limax_scene* scene, const char* name, const char* text,
                                    const limax_script_parameter* parameters, int32_t count,
                                    const double* bound) {
    return change(scene, "scene", [&] {
        require("name, text", name, text);
        scene->it.add_script(name, text, parameters_of(parameters, count), bound);
    });
}
limax_status limax_scene_set_controller(limax_scene* scene, const char* text,
                                        const limax_script_parameter* parameters, int32_t count) {
    return change(scene, "scene", [&] {
        require("text", text);
        scene->it.set_controller(text, parameters_of(parameters, count));
    });
}
limax_status limax_scene_controller(const limax_scene* scene, limax_controller_needs* out) {
    return read(scene, "scene", [&] {
        require("out", out);
        const limax::scripted::program& law = scene->it.controller();
        *out = {law.genes, law.states, law.messages, limax::sensors::count_bits(law.sensors)};
    });
}
int32_t limax_sensor_count(void) { return limax::sensors::sensor_count; }
limax_status limax_sensor_describe(int32_t sensor, limax_sensor_info* out) {
    return guard([&] {
        require("out", out);
        limax::require_range("sensor", sensor, 0, limax::sensors::sensor_count - 1, "");
        const limax::sensors::sensor& each = limax::sensors::list[sensor];
        *out = {each.name,
                each.unit,
                each.note,
                each.components,
                each.from != limax::sensors::source::computed,
                each.range};
    });
}
limax_status limax_scene_input(const limax_scene* scene, int32_t input, int32_t* sensor,
                               int32_t* component) {
    return read(scene, "scene", [&] {
        require("sensor, component", sensor, component);
        const uint64_t used = scene->it.controller().sensors;
        int32_t at = 0;
        for (int32_t s = 0; s < limax::sensors::sensor_count; ++s)
            for (int32_t c = 0; c < limax::sensors::list[s].components; ++c, ++at)
                if ((used >> at & 1) && input-- == 0) {
                    *sensor = s;
                    *component = c;
                    return;
                }
        fail(LIMAX_INVALID_ARGUMENT, "the controller has no such input");
    });
}
limax_status limax_scene_check(const limax_scene* scene) {
    return read(scene, "scene", [&] { scene->it.check(); });
}

}  // extern "C"
