--- engine_others.lua: the engine's devices, encodings and scenes.

local function entry(name, units, example, file)
  return { name, units, example, file = "bindings/engine/" .. file .. ".lua",
    at = "methods:" .. name:match "[^:]*$" }
end

return {
  title = "Devices, encodings, scenes",
  text = "What `limax.engine.device`, `.encoding` and `.scene` give; each has `:free()`.",
  file = "bindings/engine/device.lua", prefix = "",
  stage = 'device = limax.engine.device "cpu"\n'
    .. "encoding = limax.engine.encoding { lattice = { 2, 2, 2 } }\n"
    .. "scene = limax.engine.scene { gravity = true }",
  entries = {
    entry("device:describe", false, "device:describe().kind", "device"),
    entry("encoding:matrix", "1", "encoding:matrix()", "encoding"),
    entry("encoding:features", "1", "encoding:features()", "encoding"),
    entry("scene:table", "each field's own", "scene:table()", "scene"),
    { "object:free", false, "device:free()", file = "bindings/engine/object.lua",
      at = "shared:free" },
  },
}
