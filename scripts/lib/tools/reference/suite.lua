--- suite.lua: a suite of tests.

return {
  title = "A suite",
  text = "What `limax.test.suite` gives.",
  file = "scripts/lib/tools/test/test.lua", class = "limax.suite", prefix = "suite:", holder = "methods:",
  stage = 'suite = limax.test.suite "of the reference"',
  entries = {
    { "test", "limit in s",
      'suite:test("adds", { limit = 5 }, function(t) t:equal(1 + 1, 2) end)' },
    { "fixture", false,
      'suite:fixture("cube", function() return limax.robot { voxels = "s" } end)' },
    { "name", false, "suite.name",
      what = "Its name." },
    { "cases", false, "#suite.cases" },
    { "fixtures", false, "suite.fixtures",
      what = "What suite:fixture has named, by name." },
  },
}
