--- robot_in_motion.lua: a robot that is simulated step by step.

return {
  title = "A robot in motion",
  text = "What `robot:begin` gives.",
  file = "scripts/lib/robot/robot_in_motion.lua", class = "limax.robot_in_motion", prefix = "walk:",
  holder = "Moving:",
  stage = 'walk = limax.robot { voxels = "ecs\\nece\\n\\nsbs\\ncec" }:begin { duration = 0.2 }',
  entries = {
    { "step", "steps", "walk:step(10)" },
    { "go", "s", "walk:go(0.05)" },
    { "finish", false, "walk:finish()" },
    { "center", "m", "walk:center()" },
    { "positions", "m", "walk:positions()" },
    { "velocities", "m/s", "walk:velocities()" },
    { "time", "s", "walk.time" },
    { "steps", "steps", "walk.steps" },
    { "status", false, "walk.status",
      what = "Whether it goes on." },
    { "simulation", false, "walk.simulation:outcome(1).time_step",
      what = "The engine's simulation of this one robot." },
  },
}
