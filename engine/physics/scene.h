// scene.h: a scene is the list of its effects, each with the values of its parameters. The order
// of adding matters only among instances of an effect that keeps it.
#pragma once

#include <string>
#include <vector>

#include "physics/effects/all.h"
#include "physics/scripted/program.h"

namespace limax {

// Name, fields and hooks of an effect, without its laws.
struct effect_entry {
    const char* name;
    const char* summary;
    std::string needs;  // comma-separated names, one of which must be there; or empty
    unsigned hooks;
    const effects::field* fields;
    int field_count;
    int most_instances;
    bool keeps_order;
};

// Every effect, in the order of effects::all.
const std::vector<effect_entry>& effect_entries();

// "'ground'", or "one of ground, planes", for messages.
std::string one_of(const std::string& names);

// "scene.ground", or "scene.planes[2]" of an effect that may be there several times.
std::string name_of_instance(int effect, std::size_t instance);

// An effect that a script brings: a force on every mass.
struct scripted_effect {
    std::string name;
    scripted::program law;
    bool bounded;                      // whether the script states the bound
    effects::stiffness_damping bound;  // on each mass
};

class scene {
public:
    scene();  // only springs

    // Adds an effect with its defaults; a repeatable effect gets another instance.
    void add(const std::string& effect);
    // Sets a field of an effect, of its latest instance.
    void set(const std::string& effect, const std::string& field, const double* values, int count);
    // Sets the table of heights that an effect reads, [x][y], m.
    void set_heights(const std::string& effect, const std::string& field, const double* heights,
                     int nx, int ny);
    // Adds a force that a text describes. `bound` is the largest stiffness and damping that it
    // gives a mass, N/m and N s/m; null where the script does not state it.
    void add_script(const std::string& name, const std::string& text,
                    const std::vector<scripted::parameter>& parameters, const double* bound);
    // Sets the text of the effect `control`.
    void set_controller(const std::string& text,
                        const std::vector<scripted::parameter>& parameters);
    // Refuses a scene in which an effect has none of those that it needs, or values that do not go
    // together.
    void check() const;

    bool has(int effect) const { return mask_ >> effect & 1u; }
    unsigned mask() const { return mask_; }
    int instances(int effect) const { return int(instances_[effect].size()); }
    // Components of all fields of an instance of an effect, one after the other; the defaults of an
    // effect that is not there. Instances are sorted by their values, so that the order of adding
    // does not affect results, unless the effect keeps it.
    const double* values(int effect, int instance = 0) const {
        return has(effect) ? sorted_[effect][instance].data() : defaults_[effect].data();
    }

    // The same, in the order of adding.
    const double* values_as_added(int effect, int instance) const {
        return instances_[effect][instance].data();
    }

    // Sorted by their names, so that the order of adding does not affect results.
    const std::vector<scripted_effect>& scripts() const { return scripts_; }
    // The sum of their bounds for a mass.
    effects::stiffness_damping script_bound() const;

    // Empty in a scene without control.
    const scripted::program& controller() const { return controller_; }

    // The heights of the terrain; flat if none were set. The scene owns them.
    effects::height_table heights() const { return {heights_.data(), heights_nx_, heights_ny_}; }

private:
    void require_parameters(const std::string& place, int added) const;

    unsigned mask_ = 0;
    std::vector<std::vector<double>> defaults_;                // [effect][component]
    std::vector<std::vector<std::vector<double>>> instances_;  // [effect][instance][component]
    std::vector<std::vector<std::vector<double>>> sorted_;     // the same
    std::vector<float> heights_ = {0, 0, 0, 0};                // m, [x][y]
    int heights_nx_ = 2, heights_ny_ = 2;
    std::vector<scripted_effect> scripts_;
    scripted::program controller_;
};

}  // namespace limax
