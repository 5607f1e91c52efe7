--- limax.lua: what `require "limax"` gives.

return {
  title = "limax",
  text = 'What `require "limax"` gives.',
  file = "scripts/lib/limax.lua", class = "limax", prefix = "limax.",
  entries = {
    { "robot", "edge in m", 'limax.robot { voxels = "ecs\\nece\\n\\nsbs\\ncec" }',
      file = "scripts/lib/robot/robot.lua", at = "robot.new" },
    { "experiment", "each field's own", 'limax.experiment { fitness = "walk", generations = 5 }',
      file = "scripts/lib/experiment/experiment.lua", at = "experiment.new" },
    { "start", false, 'limax.start(limax.experiment { fitness = "walk", generations = 2 })',
      file = "scripts/lib/evolution/evolve.lua", at = "evolve.start" },
    { "fitness", "each function's own", "limax.fitness" },
    { "selection", false, "limax.selection.entries" },
    { "supervise", false, "limax.supervise.parameters" },
    { "scenes", "m, rad", "limax.scenes.land()" },
    { "diversity", "shares, 0 to 1", "limax.diversity" },
    { "rescore", false, "limax.rescore" },
    { "defaults", "each field's own", "limax.defaults.fields.simulation.duration" },
    { "test", false, 'limax.test.suite "mine"' },
    { "engine", false, "limax.engine.version" },
    { "version", false, "limax.version",
      what = "Version of limax." },
    { "home", false, "limax.home" },
  },
}
