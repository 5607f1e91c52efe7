// program.h: the law of a scripted effect as straight-line code: no branches, loops or addresses,
// so that it always ends and accesses only its own registers. SI units.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "physics/scripted/operations.h"

namespace limax::scripted {

// Numbers and operations of a law. Operands are 16 bits wide; the limit is far above the size of
// hand-written laws.
inline constexpr int most_registers = 2000;

// Registers hold the inputs, then the constants, then one result after the other.
struct program {
    std::vector<double> constants;
    std::vector<instruction> instructions;
    int16_t force[3];  // registers of the force, N

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

// Reads a law, a few assignments in the manner of C; README.md has the language. `place` names it
// in messages, which state the line and refuse every word that is not in the language.
program compile(const std::string& place, const std::string& text,
                const std::vector<parameter>& parameters);

// Programs as a kernel's text has them (backend/cuda/kernels/scripted.h): calls of macros, without
// a blank. `registers` becomes the most that any of them needs.
std::string kernel_text(const std::vector<const program*>& laws, int& registers);

}  // namespace limax::scripted
