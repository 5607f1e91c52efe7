// cuda_effects_test.cpp: the kernel of a scene reads the parameters of its effects and nothing of
// the others, read off its PTX. No GPU is needed.
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

struct kernel_content {
    int products = 0;  // in fp32, with sums or without
    int loads = 0;     // values from global memory
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
        content.products += opcode.size() > 4 && opcode.substr(opcode.size() - 4) == ".f32" &&
                            (is("fma.") || is("mul."));
        if (is("ld.global")) content.loads += vector_of(opcode);
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
using effects::actuation, effects::damping, effects::friction, effects::ground;

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

}  // namespace

TEST_CASE("an effect adds to a kernel, and leaves no trace where it is absent") {
    const compiler* nvrtc = found_compiler();
    if (!nvrtc) return;
    asking_machine machine;
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

    const auto& springs = kernels.at(bit<effects::springs>);
    for (const unsigned effect : {bit<damping>, bit<actuation>}) {
        // their numbers come with the springs
        CHECK(kernels.at(bit<effects::springs> | effect).loads > springs.loads);
    }
    CHECK(kernels.at(bit<effects::springs> | bit<ground>).loads == springs.loads);
    for (const auto& [mask, content] : kernels)
        CHECK(content.products + content.loads >= springs.products + springs.loads);
}
