// scene.cpp: adding effects to a scene and checking their parameters.
#include "physics/scene.h"

#include <algorithm>

#include "base/error.h"
#include "physics/sensors.h"
#include "physics/solid_edges.h"

namespace limax {

const std::vector<effect_entry>& effect_entries() {
    static const std::vector<effect_entry> entries = [] {
        std::vector<effect_entry> list;
        effects::for_each([&]<class E>(E) {
            std::string needs;
            effects::for_each([&]<class F>(F) {
                if (F::hooks & E::needs)
                    needs += (needs.empty() ? "" : ", ") + std::string(F::name);
            });
            list.push_back({E::name, E::summary, needs, E::hooks, E::fields, E::field_count,
                            effects::most_instances<E>, effects::keeps_order<E>});
        });
        return list;
    }();
    return entries;
}

namespace {

std::vector<std::vector<double>> sorted(int effect, std::vector<std::vector<double>> instances) {
    if (!effect_entries()[effect].keeps_order) std::sort(instances.begin(), instances.end());
    return instances;
}

int find_effect(const std::string& name) {
    const auto& entries = effect_entries();
    std::string names;
    for (std::size_t i = 0; i < entries.size(); ++i) {
        if (name == entries[i].name) return static_cast<int>(i);
        names += (names.empty() ? "" : ", ") + std::string(entries[i].name);
    }
    fail(LIMAX_INVALID_ARGUMENT,
         format("scene: there is no effect '%s'; there are %s; an effect of your own has a text "
                "'force'",
                name.c_str(), names.c_str()));
}

}  // namespace

std::string one_of(const std::string& names) {
    return names.find(',') == std::string::npos ? "'" + names + "'" : "one of " + names;
}

std::string name_of_instance(int effect, std::size_t instance) {
    const effect_entry& entry = effect_entries()[effect];
    return entry.most_instances == 1 ? format("scene.%s", entry.name)
                                     : format("scene.%s[%zu]", entry.name, instance + 1);
}

scene::scene() {
    for (const effect_entry& entry : effect_entries()) {
        std::vector<double> values;
        for (int f = 0; f < entry.field_count; ++f)
            values.insert(values.end(), entry.fields[f].value,
                          entry.fields[f].value + entry.fields[f].components);
        defaults_.push_back(values);
    }
    instances_.resize(defaults_.size());
    sorted_.resize(defaults_.size());
    add(effects::springs::name);
}

void scene::add(const std::string& effect) {
    const int index = find_effect(effect);
    const int most = effect_entries()[index].most_instances;
    if (instances(index) == most)
        fail(LIMAX_INVALID_ARGUMENT,
             most == 1 ? format("scene: effect '%s' is named twice", effect.c_str())
                       : format("scene.%s: at most %d of them are possible", effect.c_str(), most));
    instances_[index].push_back(defaults_[index]);
    sorted_[index] = sorted(index, instances_[index]);
    mask_ |= 1u << index;
}

void scene::set(const std::string& effect, const std::string& name, const double* values,
                int count) {
    const int index = find_effect(effect);
    const effect_entry& entry = effect_entries()[index];
    if (!has(index))
        fail(LIMAX_INVALID_ARGUMENT, format("scene.%s.%s is set, but the scene does not name '%s'",
                                            effect.c_str(), name.c_str(), effect.c_str()));
    const std::string place = name_of_instance(index, instances_[index].size() - 1);
    int offset = 0;
    std::string names;
    for (int f = 0; f < entry.field_count; ++f) {
        const effects::field& field = entry.fields[f];
        if (name != field.name) {
            names += (names.empty() ? "" : ", ") + std::string(field.name);
            offset += field.components;
            continue;
        }
        if (field.components == effects::table_of_heights)
            fail(LIMAX_INVALID_ARGUMENT,
                 format("%s.%s is a table of heights, not a number", place.c_str(), name.c_str()));
        if (count != field.components)
            fail(LIMAX_INVALID_ARGUMENT, format("%s.%s has %d components, got %d", place.c_str(),
                                                name.c_str(), field.components, count));
        for (int c = 0; c < count; ++c)
            require_range((place + "." + name).c_str(), values[c], field.minimum, field.maximum,
                          field.unit);
        // -0 becomes 0, so that equal values are equal bits
        for (int c = 0; c < count; ++c) instances_[index].back()[offset + c] = values[c] + 0.0;
        sorted_[index] = sorted(index, instances_[index]);
        return;
    }
    fail(LIMAX_INVALID_ARGUMENT, format("%s has no field '%s'; it has %s", place.c_str(),
                                        name.c_str(), names.empty() ? "none" : names.c_str()));
}

void scene::set_heights(const std::string& effect, const std::string& name, const double* heights,
                        int nx, int ny) {
    constexpr int most = 512;  // a side
    const int index = find_effect(effect);
    const effect_entry& entry = effect_entries()[index];
    const std::string place = "scene." + effect + "." + name;
    const effects::field* field = nullptr;
    for (int f = 0; f < entry.field_count; ++f)
        if (name == entry.fields[f].name && entry.fields[f].components == effects::table_of_heights)
            field = &entry.fields[f];
    if (!field) fail(LIMAX_INVALID_ARGUMENT, format("%s is not a table of heights", place.c_str()));
    if (!has(index))
        fail(LIMAX_INVALID_ARGUMENT,
             format("%s is set, but the scene does not name '%s'", place.c_str(), effect.c_str()));
    if (nx < 2 || ny < 2 || nx > most || ny > most)
        fail(LIMAX_INVALID_ARGUMENT, format("%s is a table of %d x %d; it must be 2 x 2 to %d x %d",
                                            place.c_str(), nx, ny, most, most));
    std::vector<float> table(std::size_t(nx) * std::size_t(ny));
    for (std::size_t i = 0; i < table.size(); ++i) {
        if (!(heights[i] >= field->minimum && heights[i] <= field->maximum))
            require_range(format("%s[%zu][%zu]", place.c_str(), i / std::size_t(ny) + 1,
                                 i % std::size_t(ny) + 1)
                              .c_str(),
                          heights[i], field->minimum, field->maximum, field->unit);
        table[i] = float(heights[i]);
    }
    heights_ = std::move(table);
    heights_nx_ = nx;
    heights_ny_ = ny;
}

void scene::add_script(const std::string& name, const std::string& text,
                       const std::vector<scripted::parameter>& parameters, const double* bound) {
    constexpr std::size_t most_scripts = LIMAX_MOST_SCRIPTS;
    constexpr double most_stiffness = 1e9, most_damping = 1e9;  // N/m, N s/m: those of contacts
    const std::string place = "scene." + name;
    if (scripts_.size() == most_scripts)
        fail(LIMAX_INVALID_ARGUMENT,
             format("%s: at most %zu scripted effects are possible", place.c_str(), most_scripts));
    if (!scripted::is_name(name))
        fail(LIMAX_INVALID_ARGUMENT,
             format("scene: the name of a scripted effect is letters, digits and _, not '%.60s'",
                    name.c_str()));
    for (const effect_entry& entry : effect_entries())
        if (name == entry.name)
            fail(LIMAX_INVALID_ARGUMENT,
                 format("%s: a scripted effect cannot have the name of one that is built in",
                        place.c_str()));
    scripted_effect added{
        name, scripted::compile(place + ".force", text, parameters), bound != nullptr, {}};
    if (bound) {
        require_range((place + ".bound.stiffness").c_str(), bound[0], 0, most_stiffness, "N/m");
        require_range((place + ".bound.damping").c_str(), bound[1], 0, most_damping, "N s/m");
        added.bound = {bound[0], bound[1]};
    }
    require_parameters(place, added.law.parameters);
    const auto at =
        std::lower_bound(scripts_.begin(), scripts_.end(), name,
                         [](const scripted_effect& a, const std::string& b) { return a.name < b; });
    if (at != scripts_.end() && at->name == name)
        fail(LIMAX_INVALID_ARGUMENT, format("scene: effect '%s' is named twice", name.c_str()));
    scripts_.insert(at, std::move(added));
}

// Refuses `added` more numbers than the scene's scripts may have as parameters.
void scene::require_parameters(const std::string& place, int added) const {
    for (const scripted_effect& script : scripts_) added += script.law.parameters;
    added += controller_.parameters;
    if (added > scripted::most_parameters)
        fail(LIMAX_INVALID_ARGUMENT,
             format("%s: with it the scripts of the scene have %d numbers as parameters; at most "
                    "%d are possible",
                    place.c_str(), added, scripted::most_parameters));
}

effects::stiffness_damping scene::script_bound() const {
    effects::stiffness_damping sum{0, 0};
    for (const scripted_effect& script : scripts_) {
        sum.stiffness += script.bound.stiffness;
        sum.damping += script.bound.damping;
    }
    return sum;
}

void scene::set_controller(const std::string& text,
                           const std::vector<scripted::parameter>& parameters) {
    if (!has(effects::index_of<effects::control>))
        fail(LIMAX_INVALID_ARGUMENT, "scene.control.signal is set, but the scene has no control");
    controller_ = {};
    scripted::program law = scripted::compile_controller("scene.control.signal", text, parameters);
    require_parameters("scene.control.signal", law.parameters);
    controller_ = std::move(law);
}

void scene::check() const {
    if (has(effects::index_of<effects::control>)) {
        if (has(effects::index_of<effects::actuation>))
            fail(LIMAX_INVALID_ARGUMENT,
                 "scene: control takes the place of actuation; name one of them");
        if (controller_.results.empty())
            fail(LIMAX_INVALID_ARGUMENT, "scene.control has no signal, the text of the controller");
        if (sensors::reads(controller_.sensors, sensors::target, sensors::block) &&
            !has(effects::index_of<effects::target>))
            fail(LIMAX_INVALID_ARGUMENT,
                 "scene.control.signal reads the target, but the scene has no target");
        if (sensors::reads(controller_.sensors, sensors::block, sensors::ahead) &&
            !has(effects::index_of<effects::block>))
            fail(LIMAX_INVALID_ARGUMENT,
                 "scene.control.signal reads the block, but the scene has no block");
    }
    const double spacing =
        effects::terrain::spacing_of(values(effects::index_of<effects::terrain>));
    const bool with_edges =
        has(effects::index_of<effects::edges>) && has(effects::index_of<effects::terrain>);
    for (int i = 0; with_edges && i < instances(effects::index_of<effects::block>); ++i) {
        const double* const size = values(effects::index_of<effects::block>, i);
        if (solid::touches_of_terrain({0.5 * size[0], 0.5 * size[1], 0.5 * size[2]}, spacing) <=
            solid::most_touches)
            continue;
        fail(LIMAX_INVALID_ARGUMENT,
             format("scene.edges: the block meets more than %d places of a terrain with a spacing "
                    "of %g m; take a larger scene.terrain.spacing, or a smaller block",
                    solid::most_touches, spacing));
    }
    constexpr int target = effects::index_of<effects::target>;
    for (int i = 1; i < instances(target); ++i) {
        const double before = values_as_added(target, i - 1)[effects::target::at_time],
                     time = values_as_added(target, i)[effects::target::at_time];
        if (!(before < time))
            fail(LIMAX_INVALID_ARGUMENT,
                 format("scene.target[%d].time: %g s, but the target before it appears at %g s; "
                        "expected a later time",
                        i + 1, time, before));
    }
    const unsigned changes = mask_ & effects::change_bits;
    if (changes && !has(effects::index_of<effects::control>))
        fail(LIMAX_INVALID_ARGUMENT,
             format("scene: effect '%s' acts on controlled muscles: name control instead of "
                    "actuation (control = \"sine\" drives them alike)",
                    changes & effects::bit<effects::damage> ? "damage" : "growth"));
    effects::for_each([&]<class E>(E) {
        constexpr int index = effects::index_of<E>;
        if constexpr (requires { E::problem(instances_[index][0].data()); })
            for (std::size_t i = 0; i < instances_[index].size(); ++i)
                if (const char* problem = E::problem(instances_[index][i].data()))
                    fail(LIMAX_INVALID_ARGUMENT,
                         format("%s: %s", name_of_instance(index, i).c_str(), problem));
        if (!has(index) || !E::needs) return;
        if (mask_ & effects::bits_with(effects::all{}, E::needs)) return;
        const std::string& needs = effect_entries()[index].needs;
        fail(LIMAX_INVALID_ARGUMENT,
             format("scene: effect '%s' needs %s, which the scene does not name", E::name,
                    one_of(needs).c_str()));
    });
}

}  // namespace limax
