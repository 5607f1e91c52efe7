--- test_context.lua: what a test is given.

return {
  title = "A test's t",
  text = "What the function of `suite:test` is given.",
  file = "scripts/lib/tools/test/context.lua", class = "limax.test_context", prefix = "t:",
  holder = "methods:",
  stage = 'local context, witness = require "limax.tools.test.context", require "limax.tools.test.witness"; '
    .. 't = context.new { name = "a test", suite = "a suite", file = "suite.lua", '
    .. 'fixtures = { cube = { make = function() return 1 end } }, state = context.file_state(), '
    .. 'witness = witness.new {} }',
  internal = { "close" },
  entries = {
    { "near", "of what is compared", "t:near(0.1 + 0.2, 0.3, { rtol = 1e-12 })" },
    { "equal", false, "t:equal({ 1, 2 }, { 1, 2 })" },
    { "same_bits", false, "t:same_bits(0.5, 0.5)" },
    { "ok", false, 't:ok(1 < 2, "one should be less than two")' },
    { "raises", false, 't:raises("boo", function() error "boo" end)' },
    { "golden", "of what is compared", 'pcall(t.golden, t, "height", { z = 1 }, { rtol = 1e-3, '
      .. 'why = "before contact" })' },
    { "statistically", "of the mean", "t:statistically(function(seed) return seed end, "
      .. "{ seeds = 9, expected = 5 })" },
    { "fixture", false, 't:fixture "cube"' },
    { "with", "SI units", "t:with { duration = 2 }" },
    { "skip", false, 'pcall(t.skip, t, "no GPU")' },
    { "note", false, 't:note "took three tries"' },
    { "folder", false, "t:folder(); t:close()" },
    { "name", false, "t.name" },
    { "suite", false, "t.suite",
      what = "Name of the suite." },
    { "file", false, "t.file" },
    { "device", false, "t.device" },
    { "threads", "threads", "t.threads" },
    { "precision", false, "t.precision" },
    { "integrator", false, "t.integrator" },
    { "seed", false, "t.seed" },
  },
}
