// control_test.cpp: the language of controllers: what it refuses, with the line, its limits, the
// layout of genes, and a perceptron against a plain loop.
#include <doctest/doctest.h>

#include <cmath>

#include "backend/cpu/passes.h"
#include "base/error.h"
#include "physics/scene.h"
#include "physics/sensors.h"

using namespace limax;
using scripted::operation;
using scripted::program;

namespace {

program compiled(const std::string& text) {
    return scripted::compile_controller("signal", text, {{"k", 1, {2, 0, 0}}});
}

// The results for one voxel.
template <class S>
std::vector<double> results_of(const program& law, const std::vector<double>& inputs,
                               const std::vector<float>& genes) {
    std::vector<S> registers(std::size_t(law.registers()) * cpu::scripted_block);
    for (std::size_t i = 0; i < inputs.size(); ++i)
        registers[i * cpu::scripted_block] = S(inputs[i]);
    cpu::passes_of<S>(cpu::choose_passes(nullptr))
        .controller({law, genes.data(), registers.data()}, 1);
    std::vector<double> results;
    for (const int at : law.results)
        results.push_back(double(registers[std::size_t(at) * cpu::scripted_block]));
    return results;
}

std::string repeated(int count, const std::string& text) {
    std::string all;
    for (int i = 0; i < count; ++i) all += text;
    return all;
}

// Operands precede their result, and inputs of layers their layer.
void check_registers(const program& law) {
    int next = law.inputs + int(law.constants.size());
    for (const scripted::instruction& step : law.instructions) {
        if (step.what == operation::gene) {
            CHECK(step.a < law.genes);
        } else if (step.what == operation::layer) {
            const scripted::layer& own = law.layers.at(std::size_t(step.a));
            for (const int input : own.inputs) CHECK(input < next);
            CHECK(own.first +
                      scripted::genes_of_layer(int(own.inputs.size()), own.hidden, own.outputs) <=
                  law.genes);
        } else if (step.what != operation::of_layer) {
            for (const int operand : {step.a, step.b, step.c}) {
                CHECK(operand >= 0);
                CHECK(operand < next);
            }
        }
        ++next;
    }
    CHECK(next == law.registers());
    CHECK(int(law.results.size()) == 1 + law.states + law.messages);
    for (const int at : law.results) {
        CHECK(at >= 0);
        CHECK(at < next);
    }
}

}  // namespace

TEST_CASE("control: other text is refused, with its line") {
    const struct {
        std::string text, problem;
    } cases[] = {
        {"", "line 1: the text never sets the activation a"},
        {"\nb = 1;", "line 2: unknown name 'b'"},
        {"a = f;", "unknown name 'f'"},
        {"a = 1 + a;", "line 1: 'a' is read before it is set"},
        {"a = 1;\na = 2;", "line 2: 'a' is set again before its value is read"},
        {"say[1] = 1;\nsay[1] = t; a = heard[6];", "line 2: 'say[1]' is set again"},
        {"s[0] = 1;\ns[0] = s[1];", "line 2: 's[0]' is set again"},
        {"a =\nstrian.x;", "line 2: unknown name 'strian'; there are "},
        {"a = strain;", "'a' is a number; this is a vector"},
        {"contact = 1;", "'contact' is an input and cannot be changed"},
        {"real contact = 1;", "the name 'contact' is taken"},
        {"real heard = 1;", "the name 'heard' is taken"},
        {"k = 1;", "'k' is an input"},
        {"g[0] = 1;", "genes are inputs and cannot be changed"},
        {"heard[0] = 1;", "unknown name 'heard'"},
        {"a = g;", "expected '[', got ';'"},
        {"a = g[k];", "an index of g is a whole number from 0 to 4095, not 'k'"},
        {"a = g[0.5];", "from 0 to 4095, not '0.5'"},
        {"a = 1;\na = g[4096];", "line 2: an index of g is a whole number from 0 to 4095"},
        {"a = s[16];", "an index of s is a whole number from 0 to 15, not '16'"},
        {"say[4] = 1;", "an index of say is a whole number from 0 to 3, not '4'"},
        {"a = heard[24];", "an index of heard is a whole number from 0 to 23, not '24'"},
        {"s[0] = strain;", "s takes numbers, not vectors"},
        {"say[0] - 1;", "expected '=', got '-'"},
        {"a = clamp(1, 2);", "clamp takes 3 values, not 2"},
        {"a = tanh(strain);", "tanh takes numbers, not vectors"},
        {"real y[2] = 3;", "an array is what a perceptron gives"},
        {"real y[0] = perceptron(1, g[0], t);", "an array has at least one element"},
        {"real y[65] = perceptron(1, g[0], t);", "the size of an array is a whole number from 0"},
        {"real y[k] = perceptron(1, g[0], t);", "the size of an array is a number"},
        {"vec y[3] = perceptron(1, g[0], t);", "expected '=' after 'y', got '['"},
        {"real y[1] = perceptron(0, g[0], t);", "at least one hidden unit"},
        {"real y[1] = perceptron(65, g[0], t);", "the number of hidden units is a whole number"},
        {"real y[1] = perceptron(1, t);", "the second value of a perceptron is its first gene"},
        {"real y[1] = perceptron(1, g[2], t);",
         "the first gene of a perceptron is a multiple of 4"},
        {"real y[1] = perceptron(1, g[0]);", "a perceptron has 1 to 64 inputs, not 0"},
        {"real y[1] = perceptron(1, g[0]" + repeated(22, ", strain") + ");", "not 66"},
        {"real y[1] = perceptron(64, g[0]" + repeated(21, ", strain") + ");",
         "this perceptron's genes end at g[4160]; there are at most 4096 genes"},
        {"real y[1] = perceptron(1, g[4092], t);", "end at g[4097]"},
        {"real y[1] = perceptron(1, g[0], t);\na = y;", "line 2: expected '[', got ';'"},
        {"real y[1] = perceptron(1, g[0], t); a = y[1];", "an index of y is a whole number"},
        {"a = 1" + repeated(4000, " + t") + ";", "more than 4000"},
    };
    for (const auto& each : cases) {
        CAPTURE(each.text.substr(0, 80));
        std::string message;
        try {
            compiled(each.text);
        } catch (const error& problem) {
            message = problem.what();
        }
        CAPTURE(message);
        CHECK(message.rfind("signal, line ", 0) == 0);
        CHECK(message.find(each.problem) != std::string::npos);
    }
    std::string layers;
    for (int i = 0; i < 9; ++i)
        layers += "real y" + std::to_string(i) + "[1] = perceptron(1, g[0], t);\n";
    CHECK_THROWS_WITH(compiled(layers), "signal, line 9: at most 8 perceptrons are possible");
    CHECK_THROWS_WITH(scripted::compile_controller("signal", "a = 0;", {{"heard", 1, {0, 0, 0}}}),
                      "signal: no parameter can be called 'heard': the name is taken");
}

TEST_CASE("control: a program states what it reads and needs") {
    const program law = compiled(
        "s[1] = 0; s[2] = contact; say[0] = heard[6] + gravity.y; say[1] = 0; a = g[7] + s[1];"
        "real y[2] = perceptron(5, g[8], s, strain);");
    check_registers(law);
    const uint64_t one = 1;
    CHECK(law.sensors ==
          (one << sensors::contact | one << (sensors::gravity + 1) | one << sensors::strain |
           one << (sensors::strain + 1) | one << (sensors::strain + 2)));
    // the perceptron reads all 16 states; heard[6] is of the second message
    CHECK(law.states == 16);
    CHECK(law.messages == 2);
    // 19 inputs and 2 outputs in rows of 24, 5 and 2 biases
    CHECK(law.genes == 8 + 5 * 24 + 5 + 2);
    CHECK(compiled("a = 1;").genes == 0);
}

TEST_CASE("control: a perceptron is a loop over its genes, states and messages are results") {
    constexpr int hidden = 3, outputs = 2, row = 8;
    const program law = compiled(
        "real y[2] = perceptron(3, g[4], strain, k * contact, s[0], 0.25);"
        "s[0] = y[1]; s[1] += soft(y[0]); say[0] = clamp(y[0], -0.1, 0.1); a = y[0];");
    std::vector<float> genes(4 + hidden * row + hidden + outputs);
    CHECK(law.genes == int(genes.size()));
    for (std::size_t i = 0; i < genes.size(); ++i) genes[i] = float(std::sin(3.0 * double(i)));
    std::vector<double> in(sensors::inputs);
    for (std::size_t i = 0; i < in.size(); ++i) in[i] = std::cos(2.0 * double(i));
    const double x[] = {in[0], in[1], in[2], 2 * in[sensors::contact], in[sensors::first_state],
                        0.25};
    const float* const c = genes.data() + 4 + hidden * row;
    double y[outputs] = {c[hidden], c[hidden + 1]};
    for (int unit = 0; unit < hidden; ++unit) {
        const float* const w = genes.data() + 4 + unit * row;
        double z = c[unit];
        for (int k = 0; k < 6; ++k) z += double(w[k]) * x[k];
        for (int o = 0; o < outputs; ++o) y[o] += double(w[6 + o]) * std::tanh(z);
    }
    const double expected[] = {y[0], y[1],
                               in[sensors::first_state + 1] + y[0] / std::sqrt(1 + y[0] * y[0]),
                               std::fmin(0.1, std::fmax(-0.1, y[0]))};
    const auto in_double = results_of<double>(law, in, genes);
    const auto in_float = results_of<float>(law, in, genes);
    REQUIRE(in_double.size() == 4);
    for (std::size_t i = 0; i < 4; ++i) {
        CHECK(std::fabs(in_double[i] - expected[i]) < 1e-14);
        CHECK(std::fabs(in_float[i] - expected[i]) < 2e-6);
    }
}

TEST_CASE("control: any text gives a program or an error that names a line") {
    const std::string pieces[] = {
        "a",     "s[0]",        "say[1]", "heard[7]", "g[3]",        "g",    "=", "+=",   ";",
        "(",     ")",           "[",      "]",        ",",           "+",    "-", "*",    "1",
        "4",     "k",           "strain", ".x",       "real y[2] =", "real", "y", "y[1]", "\n",
        "tanh(", "perceptron(", "g[4],",  "s",        "clamp",       "?",    ":", "3.5",  "say"};
    const std::string begins[] = {"", "a = t", "real y[2] = perceptron(4, g[0], t", "s[1] ="};
    int programs = 0, errors = 0;
    uint64_t state = 1;
    for (int i = 0; i < 20000; ++i) {
        std::string text = begins[i % 4];
        for (int k = i % 12; k > 0; --k) {
            state = state * 6364136223846793005u + 1442695040888963407u;
            text += " " + pieces[(state >> 33) % std::size(pieces)];
        }
        if (i % 3 == 0) text += "; a = 0;";
        try {
            check_registers(compiled(text));
            ++programs;
        } catch (const error& problem) {
            CHECK(problem.status() == LIMAX_INVALID_ARGUMENT);
            CHECK(std::string(problem.what()).rfind("signal, line ", 0) == 0);
            ++errors;
        }
    }
    CHECK(programs > 100);
    CHECK(errors > 100);
}
