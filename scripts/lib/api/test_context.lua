--- test_context.lua: what a test is given.

return {
  title = "A test's t",
  text = "What the function of `suite:test` is given.",
  file = "scripts/lib/test/context.lua", class = "limax.test_context", prefix = "t:",
  holder = "methods:",
  stage = 't = require("limax.test.context").new { name = "a test", suite = "a suite", '
    .. 'file = "suite.lua", goldens = {}, update = false }',
  internal = { "close" },
  entries = {
    { "near", "of what is compared", "t:near(0.1 + 0.2, 0.3, { rtol = 1e-12 })" },
    { "equal", false, "t:equal({ 1, 2 }, { 1, 2 })" },
    { "same_bits", false, "t:same_bits(0.5, 0.5)" },
    { "ok", false, 't:ok(1 < 2, "one should be less than two")' },
    { "raises", false, 't:raises("boo", function() error "boo" end)' },
    { "golden", "of what is compared", 'pcall(t.golden, t, "height", { z = 1 }, { rtol = 1e-3, '
      .. 'why = "before contact" })' },
    { "skip", false, 'pcall(t.skip, t, "no GPU")' },
    { "note", false, 't:note "took three tries"' },
    { "folder", false, "t:folder(); t:close()" },
    { "name", false, "t.name" },
    { "suite", false, "t.suite",
      what = "Name of the suite." },
    { "file", false, "t.file" },
    { "device", false, "t.device" },
    { "threads", "threads", "t.threads" },
  },
}
