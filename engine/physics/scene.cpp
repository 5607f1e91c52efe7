// scene.cpp: adding effects to a scene and checking their parameters.
#include "physics/scene.h"

#include "base/error.h"

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
            list.push_back({E::name, E::summary, needs, E::hooks, E::fields, E::field_count});
        });
        return list;
    }();
    return entries;
}

namespace {

int find_effect(const std::string& name) {
    const auto& entries = effect_entries();
    std::string known;
    for (std::size_t i = 0; i < entries.size(); ++i) {
        if (name == entries[i].name) return static_cast<int>(i);
        known += (known.empty() ? "" : ", ") + std::string(entries[i].name);
    }
    fail(LIMAX_INVALID_ARGUMENT,
         format("scene: there is no effect '%s'; there are %s", name.c_str(), known.c_str()));
}

}  // namespace

std::string one_of(const std::string& names) {
    return names.find(',') == std::string::npos ? "'" + names + "'" : "one of " + names;
}

scene::scene() {
    for (const effect_entry& entry : effect_entries()) {
        std::vector<double> values;
        for (int f = 0; f < entry.field_count; ++f)
            values.insert(values.end(), entry.fields[f].value,
                          entry.fields[f].value + entry.fields[f].components);
        values_.push_back(values);
    }
    add(effects::springs::name);
}

void scene::add(const std::string& effect) {
    const int index = find_effect(effect);
    if (has(index))
        fail(LIMAX_INVALID_ARGUMENT, format("scene: effect '%s' is named twice", effect.c_str()));
    mask_ |= 1u << index;
}

void scene::set(const std::string& effect, const std::string& name, const double* values,
                int count) {
    const int index = find_effect(effect);
    const effect_entry& entry = effect_entries()[index];
    int offset = 0;
    std::string known;
    for (int f = 0; f < entry.field_count; ++f) {
        const effects::field& field = entry.fields[f];
        if (name != field.name) {
            known += (known.empty() ? "" : ", ") + std::string(field.name);
            offset += field.components;
            continue;
        }
        if (count != field.components)
            fail(LIMAX_INVALID_ARGUMENT,
                 format("scene.%s.%s has %d components, %d were given", effect.c_str(),
                        name.c_str(), field.components, count));
        for (int c = 0; c < count; ++c)
            require_range(format("scene.%s.%s", effect.c_str(), name.c_str()).c_str(), values[c],
                          field.minimum, field.maximum, field.unit);
        std::copy(values, values + count, values_[index].begin() + offset);
        return;
    }
    fail(LIMAX_INVALID_ARGUMENT, format("scene.%s has no field '%s'; it has %s", effect.c_str(),
                                        name.c_str(), known.empty() ? "none" : known.c_str()));
}

void scene::check() const {
    effects::for_each([&]<class E>(E) {
        if (!has(effects::index_of<E>) || !E::needs) return;
        if (mask_ & effects::bits_with(effects::all{}, E::needs)) return;
        const std::string& needs = effect_entries()[effects::index_of<E>].needs;
        fail(LIMAX_INVALID_ARGUMENT,
             format("scene: effect '%s' needs %s, which the scene does not name", E::name,
                    one_of(needs).c_str()));
    });
}

}  // namespace limax
