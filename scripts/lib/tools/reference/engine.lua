--- engine.lua: the objects below the library.

local function at(file, name) return { file = "bindings/engine/" .. file .. ".lua", at = name } end

-- An entry whose comment stands in another file.
local function entry(name, units, example, place)
  return { name, units, example, file = place.file, at = place.at }
end

return {
  title = "limax.engine",
  text = "The objects over the C interface; the library is written on top of them.",
  file = "bindings/engine/engine.lua", prefix = "limax.engine.", holder = "",
  stage = 'materials = limax.engine.materials "paper"\n'
    .. "robots = limax.engine.population { lattice = { 2, 1, 1 }, count = 1 }\n"
    .. 'robots:set_body(1, { "e", "c" }, nil, materials)\nrobots:check(materials)\n'
    .. "scene = limax.engine.scene { gravity = true, ground = true, damping = true }\n"
    .. "step = limax.engine.simulation(robots, materials, scene, { duration = 0.1 })",
  entries = {
    entry("device", "threads", 'limax.engine.device("cpu", { threads = 1 })',
      at("device", "device")),
    entry("materials", "SI", 'limax.engine.materials "paper"', at("materials", "materials")),
    entry("encoding", "voxels", "limax.engine.encoding { lattice = { 3, 3, 3 } }.genes",
      at("encoding", "encoding")),
    entry("population", "voxels", "limax.engine.population { lattice = { 2, 1, 1 }, count = 1 }",
      at("population", "population")),
    entry("effects", "each field's own", "limax.engine.effects()[1].summary",
      at("scene", "effects")),
    entry("scene", "each field's own", "limax.engine.scene { gravity = true }",
      at("scene", "scene")),
    entry("simulation", "s, m, m/s",
      "limax.engine.simulation(robots, materials, scene, { duration = 0.1 })",
      at("simulation", "simulation")),
    entry("advance_together", "s", "limax.engine.advance_together({ step }, 0.01)",
      at("simulation", "advance_together")),
    entry("limit_time", "s", "limax.engine.limit_time(nil)", at("simulation", "limit_time")),
    entry("reconstruction", "s, m", "pcall(limax.engine.reconstruction, robots, materials, scene, "
      .. '{ integrator = "symplectic_euler", precision = "single" }, 10)',
      at("reconstruction", "reconstruction")),
    entry("random", false, 'limax.engine.random(1, 1, "user"):uniform()', at("random", "random")),
    entry("is_view", false, "limax.engine.is_view(robots:voxels(1))", at("view", "view.is_view")),
    entry("bytes_held", "bytes", "limax.engine.bytes_held()", at("memory", "memory.bytes_held")),
    entry("collect", false, "limax.engine.collect()", at("memory", "memory.collect")),
    entry("fail", false, 'pcall(limax.engine.fail, "boo")', at("fault", "fault.raise")),
    entry("where", false, "limax.engine.where()", at("fault", "fault.where")),
    entry("place", false, "limax.engine.place()", at("fault", "fault.place")),
    { "version", false, "limax.engine.version", signature = "limax.engine.version: string",
      what = "Version of the engine's library." },
    { "names", false, "limax.engine.names.trace.names", signature = "limax.engine.names: table",
      what = "Every name of the C interface's enumerations: traces, integrators, states." },
  },
}
