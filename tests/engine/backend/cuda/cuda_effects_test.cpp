// cuda_effects_test.cpp: the kernel of a scene holds what its effects need and nothing of the
// others. Read off the PTX: what the text became before a GPU's own optimiser, which merges and
// reorders, so that counts are exact. No GPU is needed.
#include <cstdlib>
#include <cstring>
#include <map>
#include <set>
#include <sstream>

#include "cuda_sets.h"

using namespace limax;
using namespace limax::test;
using cuda::compiler;
using cuda::kernel_set;

namespace {

constexpr lattice cube{5, 5, 5};

// What a kernel computes in fp32 and loads.
struct work {
    int fma = 0, product = 0, sum = 0, root = 0, inverse_root = 0;
    int loads = 0;  // values from global memory

    friend work operator-(const work& a, const work& b) {
        return {a.fma - b.fma,   a.product - b.product,           a.sum - b.sum,
                a.root - b.root, a.inverse_root - b.inverse_root, a.loads - b.loads};
    }
    bool operator==(const work&) const = default;
    bool nowhere_below(const work& other) const {
        return fma >= other.fma && product >= other.product && sum >= other.sum &&
               root >= other.root && inverse_root >= other.inverse_root && loads >= other.loads;
    }
};

doctest::String toString(const work& w) {
    return format("fma %d, products %d, sums %d, roots %d, inverse roots %d, loads %d", w.fma,
                  w.product, w.sum, w.root, w.inverse_root, w.loads)
        .c_str();
}

struct kernel_content {
    work all;
    int argument_bytes = 0;
    std::set<int> read;  // bytes of the argument
};

// "ld.param.v2.f32" has a vector of 2 and elements of 4 bytes.
int vector_of(const std::string& opcode) {
    const std::size_t at = opcode.find(".v");
    return at == std::string::npos ? 1 : opcode[at + 2] - '0';
}
int element_bytes(const std::string& opcode) {
    return std::atoi(opcode.c_str() + opcode.find_last_of("bfsu") + 1) / 8;
}

// Reads a kernel's PTX. Its argument is read at constant offsets from an address that registers
// keep, each set once.
kernel_content content_of(const std::string& ptx) {
    kernel_content content;
    const std::string argument = "limax_advance_param_0";
    std::map<std::string, int> offsets{{argument, 0}};  // of what points into the argument
    const auto offset_of = [&](const std::string& address) {
        const std::size_t plus = address.find('+');
        const auto base = offsets.find(address.substr(0, plus));
        CAPTURE(address);
        REQUIRE(base != offsets.end());
        return base->second +
               (plus == std::string::npos ? 0 : std::atoi(address.c_str() + plus + 1));
    };
    std::istringstream lines(ptx);
    for (std::string line; std::getline(lines, line);) {
        for (char& c : line)
            if (std::strchr("{}[],;()", c)) c = ' ';
        std::istringstream in(line);
        std::vector<std::string> words;
        for (std::string word; in >> word;)
            if (word[0] != '@') words.push_back(word);
        if (words.empty()) continue;
        const std::string& opcode = words.front();
        const auto is = [&](const char* name) { return opcode.rfind(name, 0) == 0; };
        work& all = content.all;
        if (opcode.size() > 4 && opcode.substr(opcode.size() - 4) == ".f32") {
            all.fma += is("fma.");
            all.product += is("mul.");
            all.sum += is("add.") || is("sub.");
            all.root += is("sqrt.");
            all.inverse_root += is("rsqrt.");
        }
        if (is("ld.global")) all.loads += vector_of(opcode);
        // .param .align 8 .b8 NAME[BYTES]
        if (is(".param") && words.size() == 6 && words[4] == argument)
            content.argument_bytes = std::atoi(words[5].c_str());
        if (words.size() > 2 && offsets.count(words[2])) {
            if (is("mov.") || is("cvta.")) offsets[words[1]] = offsets[words[2]];
            if (is("add.s64") && words.size() > 3 && words[3][0] != '%')
                offsets[words[1]] = offsets[words[2]] + std::atoi(words[3].c_str());
        }
        if (is("ld.param")) {
            const int begin = offset_of(words.back());
            const int bytes = vector_of(opcode) * element_bytes(opcode);
            for (int i = 0; i < bytes; ++i) content.read.insert(begin + i);
        }
    }
    return content;
}

std::string names_of(unsigned mask) {
    std::string names;
    for (std::size_t i = 0; i < effect_entries().size(); ++i)
        if (mask >> i & 1u)
            names += (names.empty() ? "" : ", ") + std::string(effect_entries()[i].name);
    return names;
}

template <class E>
constexpr unsigned bit = effects::bit<E>;
using effects::actuation, effects::damping, effects::friction, effects::gravity, effects::ground;

// Springs with at most one effect, and with all; friction, which needs a contact, does not count.
std::vector<unsigned> scenes() {
    constexpr unsigned all = every_local_effect & ~bit<effects::springs>;
    std::vector<unsigned> masks;
    for (unsigned mask = 0; mask <= all; ++mask) {
        const unsigned counted = mask & ~bit<friction>;
        const bool wanted = __builtin_popcount(counted) <= 1 || counted == (all & ~bit<friction>);
        if (wanted && (mask & ~all) == 0 &&
            (!(mask & bit<friction>) || mask & effects::contact_bits))
            masks.push_back(mask | bit<effects::springs>);
    }
    return masks;
}

// Bytes of the kernel's argument that hold the parameters of an effect: those of its laws on
// masses, and its fields as the scene has them.
template <class R, class E>
std::set<int> parameter_bytes() {
    static const cuda::step_launch<R> launch{};
    std::set<int> bytes;
    const auto add = [&](const auto& part) {
        const auto begin =
            reinterpret_cast<const char*>(&part) - reinterpret_cast<const char*>(&launch);
        for (std::size_t i = 0; i < sizeof part; ++i) bytes.insert(int(begin) + int(i));
    };
    if constexpr (effects::acts_on_masses<E> && !effects::repeatable<E>)
        add(launch.params.template of<E>());
    const double* values = launch.scene.of(effects::index_of<E>);
    for (int i = 0; i < effects::components<E> * effects::most_instances<E>; ++i) add(values[i]);
    return bytes;
}

// A kernel reads the parameters of its effects on masses, and none of another's. Those along
// springs come with the springs, the muscles' clock with the robot's record.
template <class R>
void check_parameters(const kernel_content& content, unsigned mask) {
    effects::for_each([&]<class E>(E) {
        CAPTURE(std::string(E::name));
        bool read = false;
        for (const int byte : parameter_bytes<R, E>()) read |= content.read.count(byte) > 0;
        CHECK(read == (effects::acts_on_masses<E> && (mask & bit<E>) != 0));
    });
}

// The same, but for a sum and a product of each mass: whether a term or its negative is kept, and
// so whether two effects can share it, is the compiler's choice, which depends on what else
// needs either.
void check_same(work one, const work& other, int masses) {
    CHECK(std::abs(one.sum - other.sum) <= masses);
    CHECK(std::abs(one.product - other.product) <= masses);
    one.sum = other.sum;
    one.product = other.product;
    CHECK(one == other);
}

// What `effect` adds to a scene that lacks it.
work added(const std::map<unsigned, kernel_content>& kernels, unsigned mask, unsigned effect) {
    return kernels.at(mask | effect).all - kernels.at(mask).all;
}

}  // namespace

TEST_CASE("an effect adds to a kernel what its law needs, and leaves no trace where it is absent") {
    const compiler* nvrtc = found_compiler();
    if (!nvrtc) return;
    asking_machine machine;
    // Symplectic Euler: forces read the velocity that the mass has, so that no effect's need of a
    // prediction is met by another's.
    std::map<unsigned, kernel_content> kernels;
    for (const unsigned mask : scenes()) {
        CAPTURE(names_of(mask));
        const kernel_set set =
            machine.step_of(setup_of(mask, LIMAX_SINGLE, LIMAX_SYMPLECTIC_EULER, cube));
        REQUIRE(set.entry == "step");
        const kernel_content& content = kernels[mask] =
            content_of(compiled(*nvrtc, set, "compute_90"));
        CHECK(content.argument_bytes == int(sizeof(cuda::step_launch<float>)));
        check_parameters<float>(content, mask);
    }

    // Every spring in the text has one inverse length; every mass three components of its weight.
    const unsigned only_springs = bit<effects::springs>;
    const int springs = kernels.at(only_springs).all.inverse_root;
    const int masses = added(kernels, only_springs, bit<gravity>).fma / 3;
    REQUIRE(springs > 0);
    REQUIRE(masses > 0);
    const work of_damping = added(kernels, only_springs, bit<damping>),
               of_actuation = added(kernels, only_springs, bit<actuation>),
               of_gravity = added(kernels, only_springs, bit<gravity>),
               of_ground = added(kernels, only_springs, bit<ground>),
               of_friction = added(kernels, only_springs | bit<ground>, bit<friction>);
    // dr/dt of three differences, and c dr/dt, less what springs of a class shared without it
    CHECK(of_damping == work{of_damping.fma, 2 * springs, 3 * springs, 0, 0, of_damping.loads});
    CHECK(of_damping.fma > 2 * springs);
    CHECK(of_damping.fma <= 3 * springs);
    CHECK(of_damping.loads > 0);
    // A and B, both loaded, once for a class of springs
    CHECK(of_actuation.fma >= springs);
    CHECK(of_actuation.fma < 3 * springs);
    CHECK(of_actuation.sum == 0);
    CHECK(of_actuation.root == 0);
    CHECK(of_actuation.inverse_root == 0);
    CHECK(of_actuation.loads > 0);
    CHECK(of_gravity == work{3 * masses, 0, 0, 0, 0, 0});
    CHECK(of_ground.product >= masses);
    CHECK(of_ground.sum >= 3 * masses);
    CHECK(of_ground.inverse_root == 0);
    CHECK(of_ground.loads == 0);
    CHECK(of_friction.fma == 6 * masses);
    CHECK(of_friction.product >= 4 * masses);
    CHECK(of_friction.inverse_root == masses);
    CHECK(of_friction.loads == 0);

    // and adds the same to whatever else is there: without an effect, none of its code is there.
    // Friction acts at each contact, so what it and a second contact add depends on the others.
    effects::for_each([&]<class E>(E) {
        for (const unsigned mask : scenes()) {
            if (mask & bit<E> || !kernels.count(mask | bit<E>)) continue;
            CAPTURE(std::string(E::name));
            CAPTURE(names_of(mask));
            const unsigned contacts = mask & effects::contact_bits;
            const bool slips = same_type<E, friction>;
            const bool rubs = effects::is_contact<E> && (mask & bit<friction>) != 0;
            const work more = added(kernels, mask, bit<E>);
            if (rubs || (slips && __builtin_popcount(contacts) > 1))
                CHECK(more.nowhere_below(rubs ? added(kernels, only_springs, bit<E>) : work{}));
            else
                check_same(more,
                           added(kernels, slips ? only_springs | contacts : only_springs, bit<E>),
                           masses);
        }
    });
}
