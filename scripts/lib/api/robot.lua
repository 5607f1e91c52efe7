--- robot.lua: a robot that was made by hand or read from a file.

return {
  title = "A robot by hand",
  text = "What `limax.robot` gives.",
  file = "scripts/lib/robot.lua", class = "limax.robot", prefix = "robot:", holder = "Robot:",
  stage = 'robot = limax.robot { voxels = "ecs\\nece\\n\\nsbs\\ncec" }',
  entries = {
    { "simulate", "s, m, m/s", "robot:simulate { duration = 0.2 }" },
    { "save", false, 'robot:save "robot.json"' },
    { "table", "as in a robot file", "robot:table().voxels" },
    { "body", "mass in kg", "robot.body.count" },
  },
}
