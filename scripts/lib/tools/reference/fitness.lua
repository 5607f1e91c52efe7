--- fitness.lua: the library's fitness functions.

return {
  title = "limax.fitness",
  text = 'Fitness functions: `fitness = "walk"`, or `{ "distance", axis = "x" }`.',
  file = "scripts/lib/experiment/fitness.lua", prefix = "limax.fitness.", holder = "fitness.",
  stage = 'robot = limax.robot { voxels = "ecs\\nece\\n\\nsbs\\ncec" }:simulate { duration = 0.2, '
    .. "scene = limax.scenes.land { block = true }, record = { center_of_mass = 50, energy = 50, "
    .. "block = 50 } }",
  entries = {
    { "walk", "m", "limax.fitness.walk(robot)" },
    { "distance", "m", 'limax.fitness.distance(robot, { axis = "x" })' },
    { "speed", "m/s, or body lengths per second", "limax.fitness.speed(robot)" },
    { "height", "m", "limax.fitness.height(robot)" },
    { "efficiency", "1", "limax.fitness.efficiency(robot)" },
    { "straightness", "1", "limax.fitness.straightness(robot)" },
    { "carry", "m", "limax.fitness.carry(robot)" },
    { "get", false, 'limax.fitness.get("walk").call(robot)' },
    { "entries", false, "limax.fitness.entries.walk.formula", signature = "limax.fitness.entries",
      what = "Unit, formula, options and traces of each function, by its name." },
  },
}
