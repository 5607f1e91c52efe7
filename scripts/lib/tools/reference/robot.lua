--- robot.lua: a robot that was made by hand, of a genome, or read from a file.

return {
  title = "A robot by hand",
  text = "What `limax.robot` gives.",
  file = "scripts/lib/robot/robot.lua", class = "limax.robot", prefix = "robot:", holder = "Robot:",
  stage = 'robot = limax.robot { voxels = "ecs\\nece\\n\\nsbs\\ncec" }',
  entries = {
    { "simulate", "s, m, m/s", "robot:simulate { duration = 0.2 }" },
    { "begin", "s, m, m/s", "robot:begin { duration = 0.2 }:step(10)" },
    { "edit", "voxels", 'robot:edit(1, 1, 2, "b")' },
    { "replay", false, "champion = robot:simulate { duration = 0.2 }; "
      .. "limax.robot(champion):replay()", file = "scripts/lib/experiment/replay.lua",
      at = "Robot:replay" },
    { "save", false, 'robot:save "robot.json"' },
    { "table", "as in a robot file", "robot:table().voxels" },
    { "body", "mass in kg", "robot.body.count",
      what = "What it is made of." },
    { "materials", false, "robot.materials",
      what = "The table that its letters refer to." },
    { "description", "as in a robot file", "robot.description.edge",
      what = "The plain table that a robot file holds." },
    { "population", false, "robot.population:body(1).springs" },
  },
}
