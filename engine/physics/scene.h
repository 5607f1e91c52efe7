// scene.h: a scene is the list of its effects, each with the values of its parameters. The order
// of adding never matters.
#pragma once

#include <string>
#include <vector>

#include "physics/effects/all.h"

namespace limax {

// What is known of an effect without its laws.
struct effect_entry {
    const char* name;
    const char* summary;
    std::string needs;  // comma-separated names, one of which must be there; or empty
    unsigned hooks;
    const effects::field* fields;
    int field_count;
};

// Every effect, in the order of effects::all.
const std::vector<effect_entry>& effect_entries();

// "'ground'", or "one of ground, planes", for messages.
std::string one_of(const std::string& names);

class scene {
public:
    scene();  // springs alone

    void add(const std::string& effect);
    void set(const std::string& effect, const std::string& field, const double* values, int count);
    // Refuses a scene in which an effect has none of those that it needs.
    void check() const;

    bool has(int effect) const { return mask_ >> effect & 1u; }
    unsigned mask() const { return mask_; }
    // Components of all fields of an effect, one after the other.
    const double* values(int effect) const { return values_[effect].data(); }

private:
    unsigned mask_ = 0;
    std::vector<std::vector<double>> values_;  // [effect][component]
};

}  // namespace limax
