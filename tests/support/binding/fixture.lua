--- fixture.lua: what the suites of the binding share: small populations, a short simulation, and a
--- check that an error names the line that caused it.

local engine = require "limax.engine"

local fixture = {}

fixture.MATERIALS = engine.materials "paper"
--- No two axes alike, so that a swapped one shows.
fixture.LATTICE = { 3, 2, 4 }
--- Every effect.
fixture.ALL = { gravity = true, ground = true, friction = true, damping = true, actuation = true }

--- A population with genomes and bodies.
function fixture.robots(count, seed)
  local encoding = engine.encoding { lattice = fixture.LATTICE, seed = seed or 1 }
  local population = engine.population { count = count, encoding = encoding }
  population:initialize()
  population:express(fixture.MATERIALS)
  return population
end

--- A full block of expanding muscle and its outcome after 0.2 s.
function fixture.simulated(record, device)
  local population = engine.population { lattice = fixture.LATTICE, count = 1 }
  local voxels = {}
  for i = 1, 24 do voxels[i] = "e" end
  population:set_body(1, voxels, nil, fixture.MATERIALS)
  population:check(fixture.MATERIALS)
  local simulation = engine.simulation(population, fixture.MATERIALS, engine.scene(fixture.ALL),
    { duration = 0.2, record = record }, device)
  simulation:run()
  return simulation
end

--- Like t:raises, and the message must begin with the line of `call`, a function of one line.
function fixture.raises_there(t, pattern, call)
  local message = t:raises(pattern, call)
  local info = debug.getinfo(call, "S")
  local place = ("%s:%d: "):format(info.short_src, info.linedefined)
  t:equal(message:sub(1, #place), place)
end

return fixture
