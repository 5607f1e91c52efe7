// scripted_test.cpp: the reader of scripted effects: programs that stay within their registers, and
// an end, in a program or an error, for any text.
#include <doctest/doctest.h>

#include "base/error.h"
#include "physics/scene.h"

using namespace limax;
using scripted::parameter;

namespace {

const std::vector<parameter> parameters = {{"centre", 3, {0, 0, 1}}, {"k", 1, {2, 0, 0}}};

// Operands precede their result, and the force is among the registers.
void check_registers(const scripted::program& law) {
    int next = scripted::force_inputs + int(law.constants.size());
    for (const scripted::instruction& step : law.instructions) {
        for (const int operand : {step.a, step.b, step.c}) {
            CHECK(operand >= 0);
            CHECK(operand < next);
        }
        CHECK(int(step.what) < scripted::operation_count);
        ++next;
    }
    CHECK(next == law.registers());
    for (const int at : law.results) {
        CHECK(at >= 0);
        CHECK(at < next);
    }
}

}  // namespace

TEST_CASE("any text gives a program or an error that names a line") {
    const std::string pieces[] = {
        "f",  "x", "v",    "m",  "t",  "k",   "centre", "=",  "+=", ";",   "(",    ")",
        ".x", ",", "+",    "-",  "*",  "/",   "1",      "?",  ":",  "vec", "real", "<",
        "&&", "!", "dot(", "\n", "//", "1e9", "sqrt(",  "\"", "\\", "#",   "\x80", "q"};
    const auto count = uint32_t(std::size(pieces));
    int programs = 0, errors = 0;
    uint64_t state = 1;
    for (int i = 0; i < 20000; ++i) {
        // half of them begin as laws do
        std::string text = i % 2 ? "f = x" : "";
        const int length = i % 12;
        for (int k = 0; k < length; ++k) {
            state = state * 6364136223846793005u + 1442695040888963407u;
            text += " " + pieces[(state >> 33) % count];
        }
        try {
            check_registers(scripted::compile("law", text, parameters));
            ++programs;
        } catch (const error& problem) {
            CHECK(problem.status() == LIMAX_INVALID_ARGUMENT);
            CHECK(std::string(problem.what()).rfind("law, line ", 0) == 0);
            ++errors;
        }
    }
    CHECK(programs > 100);
    CHECK(errors > 100);
}
