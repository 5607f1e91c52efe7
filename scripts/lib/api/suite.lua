--- suite.lua: a suite of tests.

return {
  title = "A suite",
  text = "What `limax.test.suite` gives.",
  file = "scripts/lib/test.lua", class = "limax.suite", prefix = "suite:", holder = "methods:",
  stage = 'suite = limax.test.suite "of the reference"',
  entries = {
    { "test", "limit in s",
      'suite:test("adds", { limit = 5 }, function(t) t:equal(1 + 1, 2) end)' },
    { "name", false, "suite.name",
      what = "Its name." },
    { "cases", false, "#suite.cases" },
  },
}
