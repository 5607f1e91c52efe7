// laws.h: which headers are laws, and a kernel that calls all of them, for the tests that compile
// laws.
#pragma once

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <sstream>
#include <string>
#include <vector>

namespace limax::test {

// Their names below engine/, sorted: the list of kernels.cmake and the effects.
inline std::vector<std::string> law_headers() {
    std::istringstream list(LIMAX_LAW_TEXTS);
    std::vector<std::string> names(std::istream_iterator<std::string>(list), {});
    for (const auto& entry : std::filesystem::directory_iterator(
             std::filesystem::path(LIMAX_SOURCE_DIR) / "engine/physics/effects"))
        names.push_back("physics/effects/" + entry.path().filename().string());
    std::sort(names.begin(), names.end());
    return names;
}

inline std::string including(const std::vector<std::string>& names) {
    std::string text;
    for (const std::string& name : names) text += "#include \"" + name + "\"\n";
    return text;
}

// Device code that calls every law, those of effects in both precisions. New effects are included
// automatically.
inline const char* const kernel_of_every_law = R"(
using namespace limax;

struct whole_scene {
    double value[effects::all::count][16];
    effects::height_table heights;
    __device__ bool has(int) const { return true; }
    __device__ int instances(int) const { return 1; }
    __device__ const double* values(int effect, int = 0) const { return value[effect]; }
};

template <class R>
__device__ R every_effect(const whole_scene& scene, R x) {
    using namespace limax::effects;
    const double origin[3] = {2, 0, -2};
    const actuation::clock clock = actuation::make_clock(scene.values(index_of<actuation>), 1e-4);
    const auto rate = actuation::rate_at(clock, int64_t(x), 1e-4);
    const auto now = actuation::at<R>(clock, int64_t(x), 1e-4);
    spring_state<R> spring{x, x, x, x, x, x, x};
    const node_state<R> node{{x, x, x}, {x, x, x}, x, x};
    vector<R> force{};
    vector<R> velocity{x, x, x};
    R sum = R(rate.sine + rate.cosine);
    for_each([&]<class E>(E) {
        if constexpr (bool(E::hooks & hook_rest)) spring.rest = E::rest(now, spring);
        if constexpr (bool(E::hooks & hook_pair)) sum += tension(E::pair(spring, {}), spring.length);
        if constexpr (requires { E::template make<R>(nullptr, nullptr); }) {
            const double* values = scene.values(index_of<E>);
            auto params = make_params<E, R>(values, origin, scene.heights);
            if constexpr (requires { E::follow(params, values, origin); })
                E::follow(params, values, origin);
            if constexpr (pushes_masses<E>) add_force<E>(params, node, force);
            if constexpr (is_contact<E>)
                velocity = after_friction<E, friction>(
                    params, friction::make<R>(scene.values(index_of<friction>), origin), node,
                    node.velocity, velocity, x);
            if constexpr (bool(E::hooks & hook_impulse))
                velocity = E::impulse(params, node, velocity, x);
            if constexpr (bool(E::hooks & hook_face)) {
                const vector<R> kick = E::face(params, face_state<R>{velocity, velocity, velocity, x}, x);
                velocity = {velocity.x + kick.x, velocity.y + kick.y, velocity.z + kick.z};
            }
            if constexpr (stores_energy_on_masses<E>) sum += energy_of_mass<E>(params, node);
        } else if constexpr (bool(E::hooks & hook_energy)) {
            sum += E::energy(spring);
        }
    });
    R lost = 0;
    const R after = kick<true>(velocity.x, force.x, x, x, lost) +
                    kick<false>(velocity.y, force.y, x, x, lost);
    sum += drift<true>(x, after, x, lost) + drift<false>(x, after, x, lost);
    const vector<double> turning{double(x), double(x), double(x)};
    const auto box = block::make<double>(scene.values(index_of<block>), origin);
    const auto inertia = inertia_of_box(box.half, box.mass);
    const quaternion points = turned_freely({1, 0, 0, 0}, inertia, turning, 1e-4);
    sum += R(angular_velocity(rotation_of(points), inertia, cross(turning, turning)).x) +
           R(block::parts(box, block::solid(box, turning).depth, 1.0, 1.0)) +
           R(block::most_touching(box, 0.1));
    solid::state load_state = solid::placed(box, inertia, scene.values(index_of<block>), origin);
    solid::follow(load_state, origin);
    const solid::moment moment = solid::moment_of(load_state, inertia);
    solid::touch touch{};
    solid::load load{};
    const solid::view view = solid::view_of(load_state, moment);
    if (solid::meet_mass<R>(box, view, 1, velocity, velocity, 1.0, touch))
        solid::meet_back<R>(load, touch);
    solid::meet_contacts(
        box, view, load,
        [&](const auto& visit) {
            visit(ground{}, ground::make<double>(scene.values(index_of<ground>), origin));
        },
        [&](const solid::touch& corner) { touch = corner; });
    solid::kick(load_state, load, box.mass, 1e-4);
    solid::motion rubbed{};
    solid::rub(
        friction::make<double>(scene.values(index_of<friction>), origin), box, load_state, moment,
        1e-4, rubbed, [&](const auto& visit) { visit(touch); },
        [&](const solid::touch&) { return turning; }, [&](const solid::touch&) { return turning; },
        [&](const solid::touch&) { return 1.0; },
        [&](const solid::touch&, const vector<double>& impulse) {
            return solid::give_mass(velocity.x, velocity.y, velocity.z, impulse, 1.0, 1.0);
        });
    solid::drift(load_state, inertia, 1e-4, true, 0.5);
    sum += R(solid::velocity(load_state, true).x + rubbed.spin.x +
             solid::broken(load_state, box, inertia, 1.0).speed);
    sum += lead(x, after, x, lost) + R(coarse_speed(double(x), 1e-4) + origin_shift(double(x)));
    return sum + predict(velocity.z, after, x) + lost + inverse_length(x);
}

extern "C" __global__ void every_law(double* out, const __grid_constant__ whole_scene scene,
                                     const __grid_constant__ voxel_body body,
                                     const spring_constants constants,
                                     const __grid_constant__ network_shape shape,
                                     const __grid_constant__ random_key key) {
    const int i = int(threadIdx.x);
    const int x = i % body.grid.nx, y = i / body.grid.nx, z = 0;
    const direction d = direction_at(i % direction_count);
    const spring_parameters spring =
        spring_between(body, x, y, z, d, site_mass(body, x, y, z),
                       site_mass(body, x + d.x, y + d.y, z + d.z),
                       [&](int64_t voxel) { return share_of(body, voxel); });
    const int corner[3] = {0, 0, 0};
    double sum = double(spring.stiffness + spring.damping + spring.sine + spring.cosine);
    sum += stable_step_of_mass(scene, scheme(i % 4), body.grid, constants, i, out[i]);
    sum += is_held(scene, sum, corner, x, y, z);
    sum += every_effect(scene, float(out[i])) + every_effect(scene, out[i]);
    const float gene = initial_gene(key, uint32_t(i), 0.1);
    sum += child_gene({0.1, 0.1, 0.4}, key, uint32_t(i), gene, float(sum));
    sum += random_uniform(key, uint32_t(i)) + random_integer(key, uint32_t(i), 5);
    sum += weight_unit(add_input(gene, hidden_unit(gene), float(sum))) + shape.genes();
    out[i] = exponential(sum) + double(wins(gene, 0.5f));
}
)";

}  // namespace limax::test
