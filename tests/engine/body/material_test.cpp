// material_test.cpp: the paper's table to the digit, every way a table can be wrong, and changes at
// run time.
#include "body/material.h"

#include <doctest/doctest.h>

#include <cmath>
#include <cstring>

#include "failure.h"

namespace {

using limax::material_table;
using limax::test::failure;

// A correct table of four materials, to be spoilt in one place at a time.
const std::string correct = R"({
  "schema": "limax.materials/1",
  "name": "test",
  "fields": {
    "stiffness": { "unit": "N/m", "minimum": 10, "maximum": 1e6, "source": "test" },
    "mass_per_site": { "unit": "kg", "minimum": 1e-3, "maximum": 10, "source": "test" },
    "damping_ratio": { "unit": "1", "minimum": 0, "maximum": 1, "source": "test" },
    "amplitude": { "unit": "1", "minimum": 0, "maximum": 0.5, "source": "test" },
    "phase": { "unit": "rad", "minimum": 0, "maximum": 3, "source": "test" },
    "stiffness_floor": { "unit": "1", "minimum": 0, "maximum": 1, "source": "test" }
  },
  "materials": [
    { "name": "empty", "letter": ".", "kind": "empty" },
    { "name": "push", "letter": "e", "kind": "expanding", "stiffness": 2000, "mass_per_site": 0.1,
      "damping_ratio": 0.1, "amplitude": 0.25, "phase": 3, "stiffness_floor": 0.2 },
    { "name": "pull", "letter": "c", "kind": "contracting", "stiffness": 2000, "mass_per_site": 0.1,
      "damping_ratio": 0.1, "amplitude": 0.25, "phase": 3, "stiffness_floor": 0.2 },
    { "name": "soft", "letter": "s", "kind": "passive", "stiffness": 1000.5, "mass_per_site": 0.1,
      "damping_ratio": 0.1, "stiffness_floor": 0.2 }
  ]
})";

std::string spoilt(const std::string& from, const std::string& to) {
    std::string text = correct;
    const std::size_t at = text.find(from);
    REQUIRE_MESSAGE(at != std::string::npos, from);
    return text.replace(at, from.size(), to);
}

}  // namespace

TEST_CASE("the paper's table contains the paper's values exactly") {
    const material_table table = material_table::load(LIMAX_SOURCE_DIR "/materials/paper.json");
    CHECK(table.name() == "paper");
    REQUIRE(table.count() == 5);
    const char* const letters[5] = {".", "e", "c", "s", "b"};
    const int32_t kinds[5] = {LIMAX_EMPTY, LIMAX_EXPANDING, LIMAX_CONTRACTING, LIMAX_PASSIVE,
                              LIMAX_PASSIVE};
    const double stiffness[5] = {0, 2e3, 2e3, 1e3, 1e4};
    for (int32_t i = 0; i < 5; ++i) {
        const limax_material& material = table.at(i);
        const bool muscle = i == 1 || i == 2, solid = i > 0;
        CHECK(std::strcmp(material.letter, letters[i]) == 0);
        CHECK(material.kind == kinds[i]);
        CHECK(limax::is_muscle(material) == muscle);
        CHECK(material.stiffness == stiffness[i]);
        CHECK(material.mass_per_site == (solid ? 0.1 : 0.0));
        CHECK(material.damping_ratio == (solid ? 0.1 : 0.0));
        CHECK(material.stiffness_floor == (solid ? 0.2 : 0.0));
        CHECK(material.amplitude == (muscle ? 0.25 : 0.0));
        CHECK(material.phase == (muscle ? 3.141592653589793 : 0.0));
    }
}

TEST_CASE("zeros are accepted in fields that a kind does not use") {
    const material_table full = material_table::parse(
        spoilt("\"kind\": \"empty\"", "\"kind\": \"empty\", \"stiffness\": 0, \"phase\": 0"),
        "my.json");
    CHECK(full.at(0).stiffness == 0);
}

TEST_CASE("a wrong table is refused with file, place, value and range") {
    std::string many = correct;
    for (int i = 0; i < 13; ++i)
        many.insert(many.find("    { \"name\": \"push\""),
                    "{ \"name\": \"x\", \"letter\": \"x\", \"kind\": \"passive\" },\n");
    const std::pair<std::string, const char*> wrong[] = {
        {spoilt("1000.5", "-5"),
         "material 4 \"soft\": stiffness is -5; it must be 10 to 1000000 N/m"},
        {spoilt("\"stiffness\": 1000.5, ", ""),
         "material 4 \"soft\": the field stiffness is missing"},
        {spoilt("\"stiffness\": 1000.5", "\"stiffness\": 1000.5, \"amplitude\": 0.1"),
         "material 4 \"soft\": amplitude is 0.1; a material of kind passive has none, so it must "
         "be "
         "0 or absent"},
        {spoilt("\"stiffness\": 1000.5", "\"stifness\": 1000.5"), "unknown field \"stifness\""},
        {spoilt("\"name\": \"pull\"", "\"name\": \"push\""), "has the same name"},
        {spoilt("\"letter\": \"s\"", "\"letter\": \"c\""), "letter \"c\" is already used"},
        {spoilt("\"kind\": \"passive\"", "\"kind\": \"active\""), "kind is \"active\""},
        {spoilt("\"kind\": \"empty\"", "\"kind\": \"passive\""), "must be the empty one"},
        {spoilt("materials/1", "materials/9"), "schema is \"limax.materials/9\""},
        {spoilt("\"unit\": \"N/m\"", "\"unit\": \"kN/m\""), "unit is \"kN/m\""},
        {spoilt("\"maximum\": 0.5", "\"maximum\": 1.5"), "the engine allows 0 to 0.95"},
        {many, "materials has 17 entries"},
        {"[]", "expected an object"},
        {spoilt("\"name\": \"test\",", "\"name\": test,"), "line 3, column 12: broken JSON: "},
        {spoilt("1000.5", "1e999"), "broken JSON"},
        {spoilt("\"test\"", "\"\xff\""), "broken JSON"},
        {spoilt("\"stiffness\": 1000.5", "\"stiffness\": 1000.5, \"stiffness\": 5"),
         "the field \"stiffness\" occurs twice"}};
    for (const auto& [text, part] : wrong) {
        const std::string message =
            failure(LIMAX_INVALID_FILE, [&] { material_table::parse(text, "my.json"); });
        CAPTURE(message);
        CHECK(message.find("my.json: ") == 0);
        CHECK(message.find(part) != std::string::npos);
    }
}

TEST_CASE("an unreadable file is refused with the reason") {
    CHECK(failure(LIMAX_IO, [] { material_table::load("/no/such/table.json"); }) ==
          "/no/such/table.json: No such file or directory");
    CHECK(failure(LIMAX_IO, [] { material_table::load("/"); }) == "/: Is a directory");
}

TEST_CASE("numbers can be set within their ranges, on copies of their own") {
    const material_table table = material_table::parse(correct, "my.json");
    material_table copy = table;
    copy.set(1, "amplitude", 0.5);
    copy.set(3, "stiffness", 10);
    CHECK(copy.at(1).amplitude == 0.5);
    CHECK(copy.at(3).stiffness == 10);
    CHECK(table.at(1).amplitude == 0.25);

    const auto refused = [&](int32_t index, const char* field, double value) {
        return failure(LIMAX_INVALID_ARGUMENT, [&] { copy.set(index, field, value); });
    };
    CHECK(refused(1, "amplitude", 0.6) ==
          "material \"push\": amplitude is 0.6; it must be 0 to 0.5");
    CHECK(refused(1, "stiffness", std::nan("")).find("stiffness is nan") != std::string::npos);
    CHECK(refused(3, "phase", 1).find("must be 0 or absent") != std::string::npos);
    CHECK(refused(4, "stiffness", 100) == "material 5 does not exist; there are 4");
    CHECK(refused(1, "weight", 100).find("unknown material field \"weight\"") == 0);
    CHECK(copy.at(1).amplitude == 0.5);
    CHECK(copy.at(1).stiffness == 2000);
}
