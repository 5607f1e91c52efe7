// kernel_masses_test.cpp: what a kernel does to a mass, and to blocks, at a step is what the CPU
// does, bit for bit, with every effect at once. The kernels' text is compiled here for the host, so
// that no GPU is needed. SI units.
#include <doctest/doctest.h>

#include "backend/cpu/rigid_blocks.h"
#include "stage.h"

// two planes, boxes and blocks, one of each other kind; double; leapfrog
#define LIMAX_EFFECTS ((1u << limax::effects::all::count) - 1)
#define LIMAX_INSTANCES 0x2450822ull
#define LIMAX_PRECISION 2
#define LIMAX_LEAPFROG 1
// two scripted effects: what kernel_text() makes of `scripted_laws`, one after the other
// clang-format off
#define LIMAX_SCRIPTED \
LIMAX_CONSTANT(8,0x0p+0)LIMAX_PARAMETER(9,0)LIMAX_PARAMETER(10,1)\
LIMAX_PARAMETER(11,2)LIMAX_PARAMETER(12,3)LIMAX_CONSTANT(13,0x1p+0)\
LIMAX_CONSTANT(14,0x1.999999999999ap-4)LIMAX_OPERATION(15,3,12,6,0)\
LIMAX_OPERATION(16,2,9,0,0)LIMAX_OPERATION(17,2,10,1,0)LIMAX_OPERATION(18,2,11,2,0)\
LIMAX_OPERATION(19,3,15,16,0)LIMAX_OPERATION(20,3,15,17,0)\
LIMAX_OPERATION(21,3,15,18,0)LIMAX_OPERATION(22,3,1,1,0)LIMAX_OPERATION(23,3,0,0,0)\
LIMAX_OPERATION(24,1,23,22,0)LIMAX_OPERATION(25,3,2,2,0)\
LIMAX_OPERATION(26,1,24,25,0)LIMAX_OPERATION(27,1,13,26,0)\
LIMAX_OPERATION(28,4,19,27,0)LIMAX_OPERATION(29,4,20,27,0)\
LIMAX_OPERATION(30,4,21,27,0)LIMAX_OPERATION(31,3,14,3,0)\
LIMAX_OPERATION(32,3,14,4,0)LIMAX_OPERATION(33,3,14,5,0)\
LIMAX_OPERATION(34,2,28,31,0)LIMAX_OPERATION(35,2,29,32,0)\
LIMAX_OPERATION(36,2,30,33,0)LIMAX_FORCE(34,35,36)LIMAX_CONSTANT(8,0x0p+0)\
LIMAX_CONSTANT(9,0x1.999999999999ap-4)LIMAX_CONSTANT(10,0x1.cp+2)\
LIMAX_OPERATION(11,12,9,2,0)LIMAX_OPERATION(12,3,10,7,0)LIMAX_OPERATION(13,6,12,0,0)\
LIMAX_OPERATION(14,9,3,0,0)LIMAX_OPERATION(15,0,14,0,0)LIMAX_OPERATION(16,8,15,0,0)\
LIMAX_OPERATION(17,18,11,13,16)LIMAX_FORCE(8,8,17)
// clang-format on
#define LIMAX_SCRIPTED_REGISTERS 37
#include "backend/cuda/kernels/solid_step.h"

// the text that a macro stands for, where no macro of it is one
#define LIMAX_AS_TEXT(...) #__VA_ARGS__
#define LIMAX_TEXT_OF(...) LIMAX_AS_TEXT(__VA_ARGS__)

using namespace limax;
using namespace limax::test;

namespace {

// The two laws whose program is above, and their parameters.
constexpr double script_parameters[] = {0.5, -0.25, 1, 3};
std::vector<scripted::program> scripted_laws() {
    return {scripted::compile("pull", "f = k * m * (centre - x) / (1 + dot(x, x)) - 0.1 * v;",
                              {{"centre", 3, {0.5, -0.25, 1}}, {"k", 1, {3, 0, 0}}}),
            scripted::compile("shake", "f.z = x.z > 0.1 ? sin(7 * t) : exp(-abs(v.x));", {})};
}

// A scene of every effect, whose contacts are all around the origin of the world.
scene every_scene() {
    stage made(lattice{1, 1, 1});
    for (const effect_entry& entry : effect_entries())
        if (std::string(entry.name) != "springs") made.effects({entry.name});
    made.set("planes", "normal", {0.3, 0.1, 1}).set("planes", "offset", {-0.1});
    made.effects({"planes"}).set("planes", "normal", {-1, 0.2, 0.1});
    made.set("spheres", "center", {0.1, 0.2, 0.3}).set("spheres", "radius", {0.6});
    made.set("boxes", "from", {-0.5, -0.5, -0.5}).set("boxes", "to", {0.4, 0.3, 0.2});
    made.effects({"boxes"}).set("boxes", "from", {0.4, -1, -1}).set("boxes", "to", {1, 1, 0.4});
    // into the contacts and each other, and turning
    made.set("block", "position", {-0.3, -0.2, -0.05}).set("block", "spin", {1, -2, 3});
    made.effects({"block"}).set("block", "position", {-0.2, -0.1, -0.1});
    made.set("block", "size", {0.4, 0.3, 0.5})
        .set("block", "mass", {2})
        .set("block", "spin", {-1, 0, 2});
    made.set("moving_boxes", "from", {0.1, -0.6, -0.2}).set("moving_boxes", "to", {0.6, 0, 0.3});
    made.set("moving_boxes", "velocity", {-0.5, 0.2, 0.1}).set("moving_boxes", "turns", {0.2});
    made.set("moving_spheres", "center", {-0.2, 0.3, -0.1});
    made.set("moving_spheres", "velocity", {0.3, -0.4, 0});
    made.set("patches", "from", {-0.3, -1, -1}).set("patches", "factor", {1.5});
    made.set("terrain", "origin", {-1, -1, 0}).set("terrain", "spacing", {1});
    const double heights[9] = {0, 0.1, -0.2, 0.3, 0, 0.2, -0.1, 0.1, 0};
    made.setup.scene.set_heights("terrain", "heights", heights, 3, 3);
    return made.setup.scene;
}

// The same scene as kernel arguments.
cuda::scene_values values_of(const scene& scene) {
    cuda::scene_values values{};
    values.heights = scene.heights();
    effects::for_each([&]<class E>(E) {
        constexpr int index = effects::index_of<E>;
        values.count[index] = scene.instances(index);
        for (int i = 0; i < scene.instances(index); ++i)
            std::copy_n(scene.values(index, i), effects::components<E>, values.of(index, i));
    });
    return values;
}

// Columns of masses along each axis, and the view of them that the passes take.
struct mass_columns {
    enum { position, velocity, next_velocity, predicted, force, columns };

    explicit mass_columns(std::size_t count) : mass(count), inverse_mass(count) {
        view.count = int64_t(count);
        for (int axis = 0; axis < 3; ++axis) {
            for (std::vector<double>& column : of[axis]) column.resize(count);
            view.position[axis] = of[axis][position].data();
            view.velocity[axis] = of[axis][velocity].data();
            view.next_velocity[axis] = of[axis][next_velocity].data();
            view.predicted[axis] = of[axis][predicted].data();
            view.force[axis] = of[axis][force].data();
        }
        view.mass = mass.data();
        view.inverse_mass = inverse_mass.data();
    }
    mass_columns(const mass_columns&) = delete;
    effects::vector<double> at(int column, std::size_t i) const {
        return {of[0][column][i], of[1][column][i], of[2][column][i]};
    }

    std::vector<double> of[3][columns], mass, inverse_mass;
    cpu::mass_arrays<double> view{};
};

void check_same(const effects::vector<double>& a, const effects::vector<double>& b) {
    CHECK(bits_as<uint64_t>(a.x) == bits_as<uint64_t>(b.x));
    CHECK(bits_as<uint64_t>(a.y) == bits_as<uint64_t>(b.y));
    CHECK(bits_as<uint64_t>(a.z) == bits_as<uint64_t>(b.z));
}

constexpr double origin[3] = {2, -4, 6}, world[3] = {0, 0, 0};
constexpr double script_time = 0.37;

// The velocities that a kernel computes; `touching` gets the number of masses at a contact.
std::vector<effects::vector<double>> velocities_of_kernel(const scene& scene,
                                                          const mass_columns& masses, double h,
                                                          int& touching) {
    const cuda::scene_values values = values_of(scene);
    cuda::mass_params<double> single{};
    effects::for_each([&]<class E>(E) {
        if constexpr (effects::acts_on_masses<E> && !effects::repeatable<E>)
            single.of<E>() = E::template make<double>(values.of(effects::index_of<E>), world);
    });
    cuda::scene_params params(single);
    cuda::follow_origin(params, values, origin, 0.0);
    cuda::move_contacts(params, values, origin, script_time);
    std::vector<effects::vector<double>> result;
    for (std::size_t i = 0; i < masses.mass.size(); ++i) {
        cuda::mass_state m{};
        for (int axis = 0; axis < 3; ++axis) {
            m.position[axis] = masses.of[axis][mass_columns::position][i];
            m.velocity[axis] = masses.of[axis][mass_columns::velocity][i];
            m.predicted[axis] = masses.of[axis][mass_columns::predicted][i];
        }
        m.mass = masses.mass[i];
        m.inverse_mass = masses.inverse_mass[i];
        m.root_mass = std::sqrt(masses.mass[i]);
        const auto f = masses.at(mass_columns::force, i);
        double next[3];
        cuda::begin_mass(m, {f.x, f.y, f.z}, {}, params, {origin, script_parameters, script_time},
                         h, next);
        result.push_back({next[0], next[1], next[2]});
        touching += cuda::touches(m, params);
    }
    return result;
}

// Leaves the velocities that the passes compute in masses.next_velocity.
void run_passes(const scene& scene, const std::vector<scripted::program>& laws, int registers,
                mass_columns& masses, double h) {
    const auto& passes = cpu::passes_of<double>(cpu::choose_passes(""));
    const auto each = [&](const auto& visit) {
        effects::for_each([&]<class E>(E) {
            constexpr int index = effects::index_of<E>;
            if constexpr (effects::acts_on_masses<E>)
                for (int i = 0; i < scene.instances(index); ++i) {
                    const auto own = effects::make_params<E, double>(scene.values(index, i), origin,
                                                                     scene.heights(), script_time);
                    visit(index, &own);
                }
        });
    };
    each([&](int index, const void* own) {
        if (passes.node[index]) passes.node[index](masses.view, own);
    });
    std::vector<double> memory(std::size_t(registers) * cpu::scripted_block);
    for (const scripted::program& law : laws)
        passes.scripted(masses.view, {law.instructions.data(),
                                      law.constants.data(),
                                      int(law.instructions.size()),
                                      int(law.constants.size()),
                                      {law.results[0], law.results[1], law.results[2]},
                                      memory.data(),
                                      script_time,
                                      {origin[0], origin[1], origin[2]}});
    passes.kick[0](masses.view, h);
    const auto friction =
        effects::friction::make<double>(scene.values(effects::index_of<effects::friction>), origin);
    const auto patch =
        effects::patches::make<double>(scene.values(effects::index_of<effects::patches>), origin);
    each([&](int index, const void* own) {
        if (passes.slip[index])
            passes.slip[index](masses.view, {0, masses.view.count}, own, &friction,
                               cpu::patch_list<double>(&patch, 1), h);
    });
}

// The blocks of a kernel, step by step.
struct kernel_blocks {
    kernel_blocks(const scene& scene, const double* start) : values(values_of(scene)) {
        for (int b = 0; b < cuda::solids; ++b)
            records[b].body =
                solid::placed(b, values.of(effects::index_of<effects::block>, b), start);
        int contacts = 0;
        for (std::size_t i = 0; i < effect_entries().size(); ++i)
            if (effects::contact_bits >> i & 1u) contacts += scene.instances(int(i));
        corners.resize(std::size_t(cuda::solids * cuda::corners_of_solid(contacts, true)));
        pairs.resize(std::size_t(cuda::pairs_of_solids(cuda::solids)));
    }
    // Pushes the masses at `sites`, and is pushed by them; the drift is left to the caller.
    void push(const mass_columns& masses, const std::vector<int32_t>& sites, double h) {
        cuda::show_solids(records);
        touching.clear();
        pushes.assign(masses.mass.size(), {});
        for (const int32_t site : sites) {
            cuda::touching_solids found{};
            bool touches = false;
            for (int b = 0; b < cuda::solids; ++b) {
                found.of[b].site = site;
                const solid::body& body = records[b].body;
                if (solid::meet_mass<double>(
                        body.law, records[b].seen, b, site, masses.at(mass_columns::position, site),
                        masses.at(mass_columns::predicted, site), masses.mass[site], found.of[b]))
                    solid::add_push<double>(pushes[site], found.of[b], touches);
            }
            if (!touches) continue;
            found.mass = masses.mass[site];
            found.inverse_mass = masses.inverse_mass[site];
            found.before = masses.at(mass_columns::velocity, site);
            found.after = masses.at(mass_columns::next_velocity, site);
            touching.push_back(found);
        }
        cuda::push_solids(records, values, origin, script_time, touching.data(),
                          int(touching.size()), corners.data(), pairs.data(), h);
    }

    cuda::scene_values values;
    cuda::solid_record records[cuda::solids]{};
    std::vector<solid::touch> corners;
    std::vector<solid::pair_touch> pairs;
    std::vector<cuda::touching_solids> touching;
    std::vector<effects::vector<double>> pushes;  // [site]
};

}  // namespace

TEST_CASE("a kernel gives every mass the same velocity as the passes") {
    const scene scene = every_scene();
    CHECK(cuda::instances_code(scene) == uint64_t(LIMAX_INSTANCES));
    const std::vector<scripted::program> laws = scripted_laws();
    int registers = 0;
    CHECK(scripted::kernel_text({&laws[0], &laws[1]}, registers) == LIMAX_TEXT_OF(LIMAX_SCRIPTED));
    CHECK(registers == LIMAX_SCRIPTED_REGISTERS);

    // states of a mass in use, but for the last, at places relative to the origin
    constexpr int count = 64;
    constexpr double h = 1e-4;
    draws draw{3};
    mass_columns masses(count);
    for (int axis = 0; axis < 3; ++axis) {
        for (std::vector<double>& column : masses.of[axis])
            for (double& value : column) value = draw();
        for (double& x : masses.of[axis][mass_columns::position]) x -= origin[axis];
    }
    std::fill_n(masses.mass.begin(), count - 1, 0.1);
    std::fill_n(masses.inverse_mass.begin(), count - 1, 10.0);

    int touching = 0;
    const auto expected = velocities_of_kernel(scene, masses, h, touching);
    CHECK(touching > count / 4);
    CHECK(touching < count);
    run_passes(scene, laws, registers, masses, h);
    for (std::size_t i = 0; i < count; ++i) {
        CAPTURE(i);
        check_same(masses.at(mass_columns::next_velocity, i), expected[i]);
    }
}

TEST_CASE("a kernel moves blocks as the CPU does") {
    scene scene = every_scene();
    const double h = 1e-3;
    // they stay within reach of it
    const double soft[1] = {100};
    scene.set("moving_boxes", "stiffness", soft, 1);
    scene.set("moving_spheres", "stiffness", soft, 1);
    const spring_body body = stage(lattice{2, 2, 2}).body();
    const double start[3] = {-origin[0], -origin[1], -origin[2]};
    mass_columns masses(std::size_t(body.count));
    for (std::size_t site = 0; site < masses.mass.size(); ++site) {
        masses.mass[site] = body.mass[site];
        masses.inverse_mass[site] = 1.0 / body.mass[site];
    }
    cpu::rigid_blocks<double> expected(scene, body, start);
    expected.follow(origin, world);
    kernel_blocks blocks(scene, start);

    draws draw{3};
    std::size_t met = 0, both = 0;
    for (int step = 0; step < 30; ++step) {
        CAPTURE(step);
        for (int axis = 0; axis < 3; ++axis)
            for (std::size_t site = 0; site < masses.mass.size(); ++site) {
                auto& of = masses.of[axis];
                of[mass_columns::position][site] = start[axis] + 0.4 * draw();
                of[mass_columns::velocity][site] = draw();
                of[mass_columns::next_velocity][site] = draw();
                of[mass_columns::predicted][site] = draw();
                of[mass_columns::force][site] = 0;
            }
        blocks.push(masses, {body.sites.begin(), body.sites.end()}, h);
        for (const auto& touch : blocks.touching)
            both += touch.of[0].push > 0 && touch.of[1].push > 0;
        met += blocks.touching.size();

        expected.move(origin, script_time);
        expected.evaluate(masses.view);
        expected.kick(h);
        expected.rub_masses(masses.view, h);
        expected.rub_contacts(h);
        for (const int32_t site : body.sites)
            check_same(blocks.pushes[site], masses.at(mass_columns::force, site));
        for (const auto& touch : blocks.touching)
            check_same(touch.after, masses.at(mass_columns::next_velocity, touch.of[0].site));
        cuda::move_solids(blocks.records, h, 0.5);
        expected.drift(h, true, 0.5);
        for (int b = 0; b < cuda::solids; ++b) {
            double of_kernel[13], of_cpu[13];
            solid::write_state(blocks.records[b].body, origin, false, of_kernel);
            solid::write_state(expected.at(b), origin, false, of_cpu);
            for (int i = 0; i < 13; ++i)
                CHECK(bits_as<uint64_t>(of_kernel[i]) == bits_as<uint64_t>(of_cpu[i]));
        }
    }
    CHECK(met > 30);
    CHECK(both > 0);
    CHECK(blocks.corners.front().push > 0);
    CHECK(blocks.pairs.front().push > 0);
}
