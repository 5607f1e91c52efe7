// program.h: a scripted force or a controller as straight-line code: no branches and no addresses,
// and only loops of a fixed length over genes, so that it always ends and accesses only its own
// registers. SI units.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "physics/scripted/operations.h"

namespace limax::scripted {

// Numbers and operations of a force and of a controller. Operands are 16 bits wide; the limits are
// far above the size of hand-written laws.
inline constexpr int most_registers = 2000, most_registers_of_controller = 4000;
// Limits of a controller.
inline constexpr int most_genes = 4096, most_states = 16, most_messages = 4, most_hidden = 64,
                     most_layers = 8;

// A perceptron whose weights are genes: out = b + sum over hidden units of w tanh(c + v in). From
// gene `first` on: v and w of each hidden unit, filled up to a multiple of `layer_alignment`; then
// the c of all; then the b.
struct layer {
    int first, hidden;
    std::vector<int16_t> inputs;  // registers
    int outputs;
};

// Registers hold the inputs, then the constants, then one result after the other. Of the constants
// those from `first_parameter` on, `parameters` of them, are the text's parameters: programs that
// differ in nothing else share a kernel.
struct program {
    static constexpr int first_parameter = 1;
    int inputs = 0, parameters = 0;
    std::vector<double> constants;
    std::vector<instruction> instructions;
    std::vector<layer> layers;
    // registers of the results: of a force its components, N; of a controller the activation, the
    // states, the messages
    std::vector<int16_t> results;
    // of a controller: how many it uses, and a bit for each input that it reads
    int genes = 0, states = 0, messages = 0;
    uint64_t sensors = 0;

    int registers() const { return inputs + int(constants.size() + instructions.size()); }
};

// A number or a vector that the text may name. `components` is 1 or 3.
struct parameter {
    std::string name;
    int components;
    double value[3];
};

// Whether a text can name an effect or a parameter of one: letters, digits and _, no digit first.
bool is_name(const std::string& text);

// Reads a force or a controller, assignments in the manner of C; README.md has the language.
// `place` names it in messages, which state the line and refuse every word that is not in the
// language. The inputs of a controller are those of physics/sensors.h.
program compile(const std::string& place, const std::string& text,
                const std::vector<parameter>& parameters);
program compile_controller(const std::string& place, const std::string& text,
                           const std::vector<parameter>& parameters);

// Programs as a kernel's text has them (backend/cuda/kernels/scripted.h): calls of macros, without
// a blank. `registers` becomes the most that any of them needs. Parameters are numbered on, from
// `first_parameter` on for the controller.
std::string kernel_text(const std::vector<const program*>& laws, int& registers);
std::string kernel_text(const program& controller, int first_parameter);

}  // namespace limax::scripted
