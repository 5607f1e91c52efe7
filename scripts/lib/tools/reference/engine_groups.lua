--- engine_groups.lua: the groups of public names of `limax.engine`, as in groups.lua; `genomes` is
--- the stage of those that need genomes.

local SIMULATION = 'materials = limax.engine.materials "paper"\n'
  .. "robots = limax.engine.population { lattice = { 2, 1, 1 }, count = 1 }\n"
  .. 'robots:set_body(1, { "e", "c" }, nil, materials)\nrobots:check(materials)\n'
  .. "scene = limax.engine.scene { gravity = true, ground = true, block = true }\n"
  .. "simulation = limax.engine.simulation(robots, materials, scene, { duration = 0.1, "
  .. "record = { center_of_mass = 50 } })"
local GENOMES = 'materials = limax.engine.materials "paper"\n'
  .. "coder = limax.engine.encoding { lattice = { 2, 2, 2 } }\n"
  .. "robots = limax.engine.population { count = 4, encoding = coder }\n"
  .. "robots:initialize()\nrobots:express(materials)\nrates = { mutation_rate = 0.1, "
  .. "mutation_scale = 0.1, crossover_rate = 0.4, seed = 1, repetition = 1, generation = 1 }"

local function engine_files(...)
  local files = {}
  for i, name in ipairs { ... } do files[i] = "bindings/engine/" .. name .. ".lua" end
  return files
end

return {
  genomes = GENOMES,
  { title = "limax.engine", prefix = "limax.engine.", stage = SIMULATION, class = "limax.engine",
    text = "The objects over the C interface; the library is written on top of them.",
    files = engine_files("engine", "device", "materials", "encoding", "population", "scene",
      "simulation", "modes", "script_slopes", "random", "pareto", "view", "memory", "fault"),
    examples = [[
device  limax.engine.device("cpu", { threads = 1 })
materials  limax.engine.materials "paper"
encoding  limax.engine.encoding { lattice = { 3, 3, 3 } }.genes
population  limax.engine.population { lattice = { 2, 1, 1 }, count = 1 }
effects  limax.engine.effects()[1].summary
scene  limax.engine.scene { gravity = true }
sensors  limax.engine.sensors()[1].range
simulation  limax.engine.simulation(robots, materials, scene, { duration = 0.1 })
begin_together  limax.engine.begin_together({ simulation }, 0.01)
advance_together  limax.engine.advance_together({ simulation }, 0.01)
modes  limax.engine.modes(robots, 1, materials, scene, {}, nil, 3)[1].frequency
script_slopes  limax.engine.script_slopes(robots, 1, materials, scene, {}, simulation)
random  limax.engine.random(1, 1, "user"):uniform()
pareto  limax.engine.pareto { { 3, 1 }, { 2, 2 }, { 1, 1 } }
is_view=view.is_view  limax.engine.is_view(robots:voxels(1))
bytes_held=memory.bytes_held  limax.engine.bytes_held()
collect=memory.collect  limax.engine.collect()
fail=fault.raise  pcall(limax.engine.fail, "boo")
where=fault.where  limax.engine.where()
place=fault.place  limax.engine.place()
]] },
  { title = "A simulation", class = "limax.simulation", prefix = "simulation:",
    text = "What `limax.engine.simulation` gives: many robots in one scene over time.",
    files = engine_files "simulation", holder = "methods:", stage = SIMULATION,
    examples = [[
place  simulation:place(1, simulation:state(1))
advance  simulation:advance(0.01, 5)
run  simulation:run()
overlap  simulation:overlap()
outcome  simulation:outcome(1).status
trace  simulation:trace(1, "center_of_mass")
sites  simulation:sites(1)
state  simulation:state(1)
block  simulation:block(1)
set_state  pcall(simulation.set_state, simulation, 1, 0, { 0.5, -0.5 })
describe  simulation:describe().device
]] },
  { title = "Genomes and bodies", text = "What `limax.engine.population` gives.",
    class = "limax.population", files = engine_files("population", "bodies"), prefix = "robots:",
    holder = "methods:", stage = GENOMES,
    examples = [[
initialize  robots:initialize()
express  robots:express(materials)
check  robots:check(materials)
breed  limax.engine.population({ count = 1, encoding = coder }):breed(robots, { { 1, 2 } }, rates)
genome  robots:genome(1)
genome_view  robots:genome_view(1)[5] = 0.5
control_view  #robots:control_view(1)
control  robots:control(1)
genomes_array  robots:genomes_array()
genomes_bytes  #robots:genomes_bytes()
set_genomes  robots:set_genomes(robots:genomes_bytes()); robots:express(materials)
voxels  robots:voxels(1)
voxels_view  robots:voxels_view(1)[8] = 3
text  robots:text(1, ".ecsb")
weights  robots:weights(1)
weights_view  robots:weights_view(1)[2][8] = 0.75
body  robots:body(1)
set_body  robots:set_body(1, { "e", "c", "s", "b", "e", "c", "s", "b" }, nil, materials)
diversity  robots:diversity { 2, 3, 4 }
]] },
  { title = "Materials", text = "What `limax.engine.materials` gives, and `robot.materials`.",
    class = "limax.materials", files = engine_files "materials", prefix = "materials:",
    holder = "methods:", stage = 'materials = limax.engine.materials "paper"',
    examples = [[
get  materials:get(3)
index  materials:index "bone"
set  materials:set(3, "stiffness", 6000)
field  materials:field "stiffness"
copy  materials:copy()
table  materials:table().name
]] },
  { title = "Devices, encodings, scenes", prefix = "",
    text = "What `limax.engine.device`, `.encoding` and `.scene` give; each has `:free()`.",
    files = engine_files("device", "encoding", "scene", "object"),
    stage = 'device = limax.engine.device "cpu"\n'
      .. "encoding = limax.engine.encoding { lattice = { 2, 2, 2 } }\n"
      .. "scene = limax.engine.scene { gravity = true }",
    examples = [[
device:describe=methods:describe  device:describe().kind
encoding:matrix=methods:matrix  encoding:matrix()
scene:table=methods:table  scene:table()
object:free=shared:free  device:free()
]] },
}
