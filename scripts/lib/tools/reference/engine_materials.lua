--- engine_materials.lua: tables of materials.

return {
  title = "Materials",
  text = "What `limax.engine.materials` gives, and `robot.materials`.",
  file = "bindings/engine/materials.lua", class = "limax.materials", prefix = "materials:",
  holder = "methods:",
  stage = 'materials = limax.engine.materials "paper"',
  entries = {
    { "get", "SI", "materials:get(3)" },
    { "index", false, 'materials:index "bone"' },
    { "set", "SI", 'materials:set(3, "stiffness", 6000)' },
    { "field", "SI", 'materials:field "stiffness"' },
    { "copy", false, "materials:copy()" },
    { "table", "SI", "materials:table().name" },
    { "count", "materials", "materials.count",
      what = "Materials, the empty one included." },
    { "name", false, "materials.name",
      what = "Name of the table." },
  },
}
