// kernel_sets.cpp: from a scene to the defines of its kernels.
#include "backend/cuda/kernel_sets.h"

#include <cmath>
#include <nlohmann/json.hpp>

namespace limax::cuda {

namespace {

std::string names_of_effects(const scene& scene) {
    std::string names;
    effects::for_each([&]<class E>(E) {
        if (scene.has(effects::index_of<E>))
            names += (names.empty() ? "" : ", ") + std::string(E::name);
    });
    return names;
}

const char* name_of_precision(int32_t precision) {
    static const char* const names[] = {"single", "compensated", "mixed", "double"};
    return names[precision];
}

}  // namespace

template <class R>
step_launch<R> scene_kernels::step_arguments() const {
    const simulation_setup& setup = *setup_;
    step_launch<R> launch{};
    const double origin[3] = {0, 0, 0};
    for (int kind = 0; kind < 3; ++kind) {
        launch.rest[kind] = setup.options.edge * std::sqrt(double(kind + 1));
        launch.rest_single[kind] = float(launch.rest[kind]);
    }
    launch.max_speed = setup.options.max_speed;
    launch.max_stretch = setup.options.max_stretch;
    effects::for_each([&]<class E>(E) {
        constexpr int index = effects::index_of<E>;
        int components = 0;
        for (int f = 0; f < E::field_count; ++f) components += E::fields[f].components;
        if (components > 0)
            std::copy_n(setup.scene.values(index), components, launch.scene.value[index]);
        if constexpr (acts_on_masses<E>)
            launch.params.template of<E>() = E::template make<R>(setup.scene.values(index), origin);
    });
    return launch;
}

template <class R>
measure_launch<R> scene_kernels::measure_arguments() const {
    const step_launch<R> step = step_arguments<R>();
    measure_launch<R> launch{};
    launch.grid = setup_->grid;
    std::copy_n(step.rest, 3, launch.rest);
    launch.scene = step.scene;
    return launch;
}

template step_launch<float> scene_kernels::step_arguments<float>() const;
template step_launch<double> scene_kernels::step_arguments<double>() const;
template measure_launch<float> scene_kernels::measure_arguments<float>() const;
template measure_launch<double> scene_kernels::measure_arguments<double>() const;

std::string scene_kernels::describe() const {
    const function_facts facts = step_->facts("limax_advance");
    nlohmann::ordered_json text;
    text["device"] = "cuda";
    text["path"] = "block";
    text["effects"] = names_of_effects(setup_->scene);
    text["precision"] = name_of_precision(setup_->options.precision);
    text["origin"] = name_of(step_->binary().origin);
    text["seconds"] = step_->binary().seconds;
    text["architecture"] = step_->binary().architecture;
    text["threads"] = shape_.threads;
    text["registers"] = facts.registers;
    text["spilled"] = facts.spilled;
    text["shared_bytes"] = shape_.shared_bytes + std::size_t(facts.shared);
    text["blocks_of_multiprocessor"] =
        step_->blocks_of_multiprocessor("limax_advance", shape_.threads, shape_.shared_bytes);
    text["instructions"] = facts.instructions;
    return text.dump();
}

scene_kernels load_scene(const simulation_setup& setup, gpu_team& team, const context& gpu,
                         kernel_library& kernels) {
    scene_kernels out;
    out.setup_ = &setup;
    out.damped = setup.scene.has(effects::index_of<effects::damping>);
    out.actuated = setup.scene.has(effects::index_of<effects::actuation>);
    out.spring_columns = 1 + (out.damped ? 1 : 0) + (out.actuated ? 2 : 0);
    out.state_columns = setup.options.precision == LIMAX_COMPENSATED ? 15 : 9;
    out.plan = team.plan_of(setup.grid);
    out.doing_ = format("stepping robots of %dx%dx%d voxels with %s in %s", setup.grid.nx,
                        setup.grid.ny, setup.grid.nz, names_of_effects(setup.scene).c_str(),
                        name_of_precision(setup.options.precision));

    const kernel_needs needs{setup.options.precision, out.spring_columns, out.damped};
    const auto shape =
        shape_block(*out.plan, setup.grid, needs, gpu.device().shared_memory_of_block);
    if (!shape) fail(LIMAX_INTERNAL, "lattice too large for a block");
    out.shape_ = *shape;

    const auto number = [](auto value) { return std::to_string(value); };
    const std::map<std::string, std::string> of_scene = {
        {"LIMAX_EFFECTS", number(setup.scene.mask())},
        {"LIMAX_PRECISION", number(setup.options.precision)},
        {"LIMAX_LEAPFROG", number(setup.options.integrator == LIMAX_LEAPFROG ? 1 : 0)}};
    kernel_set step{"step", of_scene}, measure{"measure", of_scene};
    for (const auto& [name, value] : std::initializer_list<std::pair<const char*, int64_t>>{
             {"LIMAX_NX", setup.grid.nx},
             {"LIMAX_NY", setup.grid.ny},
             {"LIMAX_NZ", setup.grid.nz},
             {"LIMAX_ROW", out.plan->row},
             {"LIMAX_PLANE", out.plan->plane},
             {"LIMAX_CUBE_SLOTS", out.plan->cube_slots},
             {"LIMAX_RIM_SLOTS", out.plan->rim_slots},
             {"LIMAX_THREADS", shape->threads},
             {"LIMAX_BLOCKS", shape->blocks},
             {"LIMAX_CUBE_HELD", shape->cube_held},
             {"LIMAX_SHARED_BYTES", int64_t(shape->shared_bytes)}})
        step.defines.emplace(name, number(value));
    out.step_ = kernels.load(step);
    out.step_->allow_shared_memory("limax_advance", shape->shared_bytes);
    bool measures = false;
    for (int kind = 0; kind < sample_kinds; ++kind)
        measures |= !taken_by_step(kind) && setup.options.record[kind] > 0;
    if (measures) out.measure_ = kernels.load(measure);
    return out;
}

}  // namespace limax::cuda
