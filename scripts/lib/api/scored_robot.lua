--- scored_robot.lua: a robot that was simulated: what fitness functions get.

return {
  title = "A robot that was simulated",
  text = "What `robot:simulate` gives and what fitness, selection and supervisors see.",
  file = "scripts/lib/scored_robot.lua", class = "limax.scored_robot", prefix = "robot:",
  holder = "methods:",
  stage = 'robot = limax.robot { voxels = "ecs\\nece\\n\\nsbs\\ncec" }:simulate '
    .. '{ duration = 0.2, record = { center_of_mass = 50 } }',
  entries = {
    { "distance", "m", 'robot:distance { axis = "x" }' },
    { "trace", "m, m/s, J", 'robot:trace "center_of_mass"' },
    { "status", false, "robot.status" },
  },
}
