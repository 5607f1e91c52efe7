--- body.lua: what a robot is made of.

return {
  title = "A body",
  text = "`robot.body`.",
  file = "scripts/lib/robot/body.lua", class = "limax.robot.body", prefix = "body.",
  stage = 'body = limax.robot({ voxels = "ecs\\nece\\n\\nsbs\\ncec" }).body',
  entries = {
    { "size", "voxels", "body.size" },
    { "mass", "kg", "body.mass",
      what = "Mass." },
    { "count", "voxels", 'body.count["soft tissue"]' },
    { "voxels", "voxels", "body.voxels" },
    { "masses", "masses", "body.masses",
      what = "Mass points." },
    { "springs", "springs", "body.springs",
      what = "Springs." },
    { "hash", false, "body.hash",
      what = "Equal for equal bodies." },
    { "letters", false, "body.letters",
      what = "The whole lattice: layers parted by an empty line, the lowest first." },
    { "voxel", false, "body.voxel[1][2][1]" },
  },
}
