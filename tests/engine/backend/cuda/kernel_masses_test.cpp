// kernel_masses_test.cpp: what a kernel does to a mass, and to the block, at a step is what the CPU
// does, bit for bit, with every effect at once. The kernels' text is compiled here for the host, so
// that no GPU is needed. SI units.
#include <doctest/doctest.h>

#include "backend/cpu/rigid_block.h"
#include "stage.h"

// two planes, a sphere, two boxes; double; leapfrog
#define LIMAX_EFFECTS ((1u << limax::effects::all::count) - 1)
#define LIMAX_INSTANCES (2 | 1 << 8 | 2 << 16)
#define LIMAX_PRECISION 3
#define LIMAX_LEAPFROG 1
// two scripted effects: what kernel_text() makes of `scripted_laws`, one after the other
// clang-format off
#define LIMAX_SCRIPTED \
LIMAX_CONSTANT(8,0x0p+0)LIMAX_CONSTANT(9,0x1p-1)LIMAX_CONSTANT(10,-0x1p-2)\
LIMAX_CONSTANT(11,0x1p+0)LIMAX_CONSTANT(12,0x1.8p+1)LIMAX_CONSTANT(13,0x1p+0)\
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

// The two laws whose program is above.
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

// Numbers from -1 to 1, the same for the same seed.
struct numbers {
    uint32_t state = 3;
    double operator()() {
        return double((state = state * 1664525u + 1013904223u) >> 8) / double(1 << 23) - 1;
    }
};

}  // namespace

TEST_CASE("a kernel gives every mass the same velocity as the passes") {
    const scene scene = every_scene();
    CHECK(cuda::instances_code(scene) == uint64_t(LIMAX_INSTANCES));
    const double origin[3] = {2, -4, 6}, world[3] = {0, 0, 0}, h = 1e-4;
    constexpr int count = 64;

    // states of a mass in use, but for the last, at places relative to the origin
    numbers draw;
    std::vector<double> columns[3][5];  // of each axis: x, u, the next u, p, force
    for (int axis = 0; axis < 3; ++axis)
        for (std::vector<double>& column : columns[axis])
            for (int i = 0; i < count; ++i) column.push_back(draw());
    std::vector<double> mass(count, 0.1), inverse_mass(count, 10.0);
    mass.back() = inverse_mass.back() = 0;
    cpu::mass_arrays<double> masses{};
    masses.count = count;
    for (int axis = 0; axis < 3; ++axis) {
        for (double& x : columns[axis][0]) x -= origin[axis];
        masses.position[axis] = columns[axis][0].data();
        masses.velocity[axis] = columns[axis][1].data();
        masses.next_velocity[axis] = columns[axis][2].data();
        masses.predicted[axis] = columns[axis][3].data();
        masses.force[axis] = columns[axis][4].data();
    }
    masses.mass = mass.data();
    masses.inverse_mass = inverse_mass.data();

    // the kernel's way, from the same numbers
    const cuda::scene_values values = values_of(scene);
    cuda::mass_params<double> single{};
    effects::for_each([&]<class E>(E) {
        constexpr int index = effects::index_of<E>;
        if constexpr (effects::acts_on_masses<E> && !effects::repeatable<E>)
            single.of<E>() = E::template make<double>(values.of(index), world);
    });
    const std::vector<scripted::program> laws = scripted_laws();
    int registers = 0;
    std::vector<const scripted::program*> both;
    for (const scripted::program& law : laws) both.push_back(&law);
    CHECK(scripted::kernel_text(both, registers) == LIMAX_TEXT_OF(LIMAX_SCRIPTED));
    CHECK(registers == LIMAX_SCRIPTED_REGISTERS);
    const cuda::scripted_moment now{origin, 0.37};
    cuda::scene_params params(single);
    cuda::follow_origin(params, values, origin);
    double expected[count][3];
    int touching = 0;
    for (int i = 0; i < count; ++i) {
        cuda::mass_state m{};
        for (int axis = 0; axis < 3; ++axis) {
            m.position[axis] = columns[axis][0][i];
            m.velocity[axis] = columns[axis][1][i];
            m.predicted[axis] = columns[axis][3][i];
        }
        m.mass = mass[i];
        m.inverse_mass = inverse_mass[i];
        cuda::begin_mass(m, {columns[0][4][i], columns[1][4][i], columns[2][4][i]}, {}, params, now,
                         h, expected[i]);
        touching += cuda::touches(m, params);
    }
    CHECK(touching > count / 4);
    CHECK(touching < count);

    // the passes' way
    const auto& passes = cpu::mass_passes_of<double>(cpu::choose_passes(""));
    const auto each = [&](const auto& visit) {
        effects::for_each([&]<class E>(E) {
            constexpr int index = effects::index_of<E>;
            if constexpr (effects::acts_on_masses<E>)
                for (int i = 0; i < scene.instances(index); ++i) {
                    const auto own = effects::make_params<E, double>(scene.values(index, i), origin,
                                                                     scene.heights());
                    visit(index, &own);
                }
        });
    };
    each([&](int index, const void* own) {
        if (passes.node[index]) passes.node[index](masses, own);
    });
    std::vector<double> memory(std::size_t(registers) * cpu::scripted_block);
    for (const scripted::program& law : laws)
        passes.scripted(masses, {law.instructions.data(),
                                 law.constants.data(),
                                 int(law.instructions.size()),
                                 int(law.constants.size()),
                                 {law.force[0], law.force[1], law.force[2]},
                                 memory.data(),
                                 now.time,
                                 {origin[0], origin[1], origin[2]}});
    passes.kick[0](masses, h);
    each([&](int index, const void* own) {
        if (passes.impulse[index]) passes.impulse[index](masses, own, h);
    });
    const auto friction =
        effects::friction::make<double>(scene.values(effects::index_of<effects::friction>), origin);
    each([&](int index, const void* own) {
        if (passes.slip[index]) passes.slip[index](masses, own, &friction, h);
    });
    for (int i = 0; i < count; ++i)
        for (int axis = 0; axis < 3; ++axis) {
            CAPTURE(i);
            CHECK(bits_as<uint64_t>(columns[axis][2][i]) == bits_as<uint64_t>(expected[i][axis]));
        }
}

TEST_CASE("a kernel moves the block as the CPU does") {
    scene scene = every_scene();
    // into the contacts, and turning
    const double place[3] = {-0.3, -0.2, -0.05}, spin[3] = {1, -2, 3};
    scene.set("block", "position", place, 3);
    scene.set("block", "spin", spin, 3);
    const spring_body body = stage(lattice{2, 2, 2}).body();
    const double origin[3] = {2, -4, 6}, still[3] = {0, 0, 0}, h = 1e-3;
    const double start[3] = {-origin[0], -origin[1], -origin[2]};
    const auto count = std::size_t(body.count);
    std::vector<double> columns[3][5];  // of each axis: x, u, the next u, p, force
    cpu::mass_arrays<double> masses{};
    masses.count = body.count;
    for (int axis = 0; axis < 3; ++axis) {
        for (std::vector<double>& column : columns[axis]) column.resize(count);
        masses.position[axis] = columns[axis][0].data();
        masses.velocity[axis] = columns[axis][1].data();
        masses.next_velocity[axis] = columns[axis][2].data();
        masses.predicted[axis] = columns[axis][3].data();
        masses.force[axis] = columns[axis][4].data();
    }
    std::vector<double> inverse_mass(count);
    for (std::size_t site = 0; site < count; ++site) inverse_mass[site] = 1.0 / body.mass[site];
    masses.inverse_mass = inverse_mass.data();

    cpu::rigid_block<double> expected(scene, body, start);
    expected.follow(origin, still);
    const cuda::scene_values values = values_of(scene);
    const cuda::solid_laws laws(values);
    cuda::solid_record record{};
    record.block = solid::placed(laws.block, laws.inertia,
                                 values.of(effects::index_of<effects::block>), start);
    int contacts = 0;
    for (std::size_t i = 0; i < effect_entries().size(); ++i)
        if (effects::contact_bits >> i & 1u) contacts += scene.instances(int(i));
    std::vector<solid::touch> corners(std::size_t(cuda::corners_of_solid(contacts)));

    numbers draw;
    std::size_t met = 0;
    for (int step = 0; step < 30; ++step) {
        CAPTURE(step);
        for (int axis = 0; axis < 3; ++axis)
            for (std::size_t site = 0; site < count; ++site) {
                columns[axis][0][site] = start[axis] + 0.4 * draw();
                for (const int column : {1, 2, 3}) columns[axis][column][site] = draw();
                columns[axis][4][site] = 0;
            }
        cuda::show_solid(record, laws);
        std::vector<cuda::solid_touch<double>> touching;
        std::vector<effects::vector<double>> pushes(count);
        const auto in = [&](int column, std::size_t site) {
            return effects::vector<double>{columns[0][column][site], columns[1][column][site],
                                           columns[2][column][site]};
        };
        for (const int32_t site : body.sites) {
            cuda::solid_touch<double> found;
            if (!solid::meet_mass<double>(laws.block, record.seen, site, in(0, site), in(3, site),
                                          body.mass[site], found))
                continue;
            found.mass = body.mass[site];
            found.inverse_mass = inverse_mass[site];
            found.before = in(1, site);
            found.after = in(2, site);
            pushes[site] = solid::push_on_mass<double>(found);
            touching.push_back(found);
        }
        met += touching.size();
        cuda::push_solid(record, values, origin, touching.data(), int(touching.size()),
                         corners.data(), h);

        expected.evaluate(masses);
        expected.kick(h);
        expected.rub_masses(masses, h);
        expected.rub_contacts(h);
        const auto same = [&](const effects::vector<double>& a, const effects::vector<double>& b) {
            CHECK(bits_as<uint64_t>(a.x) == bits_as<uint64_t>(b.x));
            CHECK(bits_as<uint64_t>(a.y) == bits_as<uint64_t>(b.y));
            CHECK(bits_as<uint64_t>(a.z) == bits_as<uint64_t>(b.z));
        };
        for (const int32_t site : body.sites) same(pushes[site], in(4, site));
        for (const auto& touch : touching) same(touch.after, in(2, touch.site));
        cuda::move_solid(record, laws, h, 0.5);
        expected.drift(h, true, 0.5);
        double of_kernel[13], of_cpu[13];
        solid::write_state(record.block, laws.inertia, origin, false, of_kernel);
        expected.write(origin, false, of_cpu);
        for (int i = 0; i < 13; ++i)
            CHECK(bits_as<uint64_t>(of_kernel[i]) == bits_as<uint64_t>(of_cpu[i]));
    }
    CHECK(met > 30);
    CHECK(corners.front().push > 0);
}
