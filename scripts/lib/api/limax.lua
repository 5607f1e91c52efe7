--- limax.lua: what `require "limax"` gives.

return {
  title = "limax",
  text = 'What `require "limax"` gives.',
  file = "bindings/limax.lua", class = "limax", prefix = "limax.",
  entries = {
    { "robot", "edge in m", 'limax.robot { voxels = "ecs\\nece\\n\\nsbs\\ncec" }',
      file = "scripts/lib/robot.lua", at = "robot.new" },
    { "experiment", "each field's own", 'limax.experiment { fitness = "walk", generations = 5 }',
      file = "scripts/lib/experiment.lua", at = "experiment.new" },
    { "start", false, 'limax.start(limax.experiment { fitness = "walk", generations = 2 })',
      file = "scripts/lib/evolve.lua", at = "evolve.start" },
    { "version", false, "limax.version" },
    { "home", false, "limax.home" },
  },
}
