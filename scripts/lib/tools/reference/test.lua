--- test.lua: what suites are written with.

return {
  title = "limax.test",
  text = "Suites of scripted regressions, run by `limax test FILE`.",
  file = "scripts/lib/tools/test/test.lua", prefix = "limax.test.", holder = "test.",
  internal = { "collect" },
  entries = {
    { "suite", false, 'limax.test.suite "my walker"' },
    { "DEVICES", false, "limax.test.DEVICES", signature = "limax.test.DEVICES",
      what = 'The devices that `devices = "all"` stands for.' },
  },
}
