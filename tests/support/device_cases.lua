--- device_cases.lua: scenes by which devices are compared: blocks, drag, self-collision, every
--- effect. SI units.

local bodies = require "limax.tools.bench.bodies"
local engine = require "limax.engine"
local evolution = require "support.evolution"

local device_cases = {}

local materials = engine.materials "paper"

---@class limax.device_case
---@field name string
---@field scene fun(size: number[]): table of a body of this size, m
---@field lattices integer[][] one for each kind of kernel: a block of threads, tiles, the grid
---@field options table of the simulation
---@field make nil|fun(lattice: integer[]): limax.population
---@field place nil|fun(simulation: limax.simulation)

local function with(more) return evolution.with(bodies.ALL, more) end

--- Three bodies with holes.
function device_cases.hollow(lattice)
  return bodies.population(materials, lattice, 3, { hollow = true })
end

-- The same bodies with genes for the controller below.
local function thinking(lattice)
  local population = engine.population { lattice = lattice, count = 3, encoding = engine.encoding
    { lattice = lattice, network = "none", genes = 0, control_genes = 102 } }
  local hollow = device_cases.hollow(lattice)
  for i = 1, 3 do
    population:set_body(i, hollow:voxels(i):table(), nil, materials)
    for k = 1, 102 do population:control_view(i)[k] = 0.3 * math.sin(40 * i + k) end
  end
  population:check(materials, { require_muscle = false })
  return population
end
local SIGNAL = "real y[3] = perceptron(3, g[0], strain, load, contact, gravity, velocity, spin,"
  .. " target, target_distance, ahead, activation, place, phase, clock_cosine, s[0]);"
  .. " s[0] = 0.9 * s[0] + 0.1 * y[1]; say[0] = tanh(y[2]);"
  .. " a = soft(y[0]) + 0.1 * heard[0] - 0.1 * heard[3] - 0.01 * strain_rate;"

-- One body of soft tissue of these letters, x fastest.
local function shaped(letters)
  return function(lattice)
    local population, voxels = engine.population { lattice = lattice, count = 1 }, {}
    for letter in letters:gmatch "[.s]" do voxels[#voxels + 1] = letter end
    population:set_body(1, voxels, nil, materials)
    population:check(materials, { require_muscle = false })
    return population
  end
end

-- Moves the two legs of a body towards each other, at 3 m/s.
local function clap(simulation)
  local positions, velocities = simulation:state(1)
  positions, velocities = positions:table(), velocities:table()
  for i, p in ipairs(positions) do
    if p[3] > 0.15 then velocities[i][1] = p[1] < 0.2 and 3 or -3 end
  end
  simulation:place(1, nil, velocities)
end

-- Puts everything within a few edges, so that masses have more partners than a list has room for.
local function crumple(simulation)
  local positions = (simulation:state(1)):table()
  for i, p in ipairs(positions) do
    positions[i] = { 0.3 * p[1] + 1e-3 * (i % 7), 0.3 * p[2] + 1e-3 * (i % 5),
      p[3] + 1e-3 * (i % 11) }
  end
  simulation:place(1, positions)
end

local FLAT = { 40, 15, 1 }

---@type limax.device_case[]
device_cases.list = {
  { name = "a body that hits a block", lattices = { { 3, 2, 2 }, { 5, 5, 5 }, { 10, 9, 8 }, FLAT },
    options = { velocity = { 2, 0.3, 0 }, duration = 0.03 }, scene = function(size)
      return with { block = { position = { size[1] + 0.01, -0.05, 0 },
        size = { 0.3, size[2], 0.2 }, velocity = { 0, 0.5, 0 } } }
    end },
  { name = "a block that lands on a body", lattices = { { 4, 3, 2 }, { 10, 9, 8 }, FLAT },
    options = { duration = 0.03 }, scene = function(size)
      return with { block = { position = { 0.05, 0.05, size[3] + 0.002 },
        size = { 0.35, 0.25, 0.1 }, velocity = { 0.4, 0.1, -1 }, spin = { 0.1, 0.2, 1 },
        mass = 3 } }
    end },
  { name = "a body among blocks that collide", lattices = { { 4, 3, 2 }, { 10, 9, 8 }, FLAT },
    options = { velocity = { 1, 0.3, 0 }, duration = 0.03 }, make = thinking,
    scene = function(size)
      local high = size[3] - 0.003
      return with { edges = true, patches = { from = { 0.2, -1, -1 }, factor = 0.5 },
        spheres = { center = { -0.4, 0, 0 }, radius = 0.2 },
        actuation = false, control = { rate = 200, signal = "a = block.x + block_velocity.y;" },
        block = { { position = { 0.02, 0.05, high }, size = { 0.2, 0.25, 0.1 } },
          { position = { 0.215, 0.05, high }, size = { 0.3, 0.2, 0.2 }, mass = 3,
            velocity = { -1, 0, 0 } },
          { position = { 0.1, 0.1, high + 0.095 }, size = { 0.1, 0.1, 0.1 }, spin = { 1, 2, 9 },
            stiffness = 5e3 },
          { position = { -0.3, 0, 0 }, size = { 0.2, 0.2, 0.2 } } } }
    end },
  -- the robot's own origin follows
  { name = "a block that is carried far", lattices = { { 3, 3, 2 }, FLAT },
    options = { velocity = { 150, 0, 0 }, duration = 0.04 }, scene = function(size)
      return { gravity = true, damping = true, block = { position = { 0.05, 0.05, size[3] - 1e-3 },
        size = { 0.2, 0.2, 0.2 }, velocity = { 150, 0, 0 }, spin = { 0, 1, 3 } } }
    end },
  { name = "every effect", lattices = { { 4, 4, 3 }, { 10, 10, 3 }, FLAT },
    options = { velocity = { 2, 0.3, 0.1 }, duration = 0.03 }, scene = function(size)
      return with { drag = { density = 10 }, self_collision = true,
        block = { position = { size[1] + 0.02, 0, 0.005 }, size = { 0.2, 0.3, 0.3 } },
        wind = { velocity = { 1, 0, 0 }, drag = 0.01 },
        planes = { { normal = { -1, 0, 0.3 }, offset = -6 },
          { normal = { 0, 1, 0 }, offset = -0.1 } },
        boxes = { from = { 0.2, -1, -1 }, to = { 0.6, 2, 0.01 } } }
    end },
  { name = "a body with a controller", lattices = { { 1, 1, 1 }, { 4, 3, 2 }, { 10, 9, 8 }, FLAT },
    options = { velocity = { 0.5, 0.3, -0.1 }, duration = 0.03 }, make = thinking,
    scene = function()
      return with { actuation = false, target = true,
        control = { rate = 200, noise = 0.05, delay = 0.005, signal = SIGNAL } }
    end },
  { name = "a swimming body", lattices = { { 1, 1, 1 }, { 4, 3, 2 }, { 5, 5, 5 }, { 12, 3, 9 } },
    options = { velocity = { 1.5, -0.5, 0.3 }, duration = 0.05 }, scene = function()
      return { damping = true, actuation = { frequency = 5 },
        gravity = { acceleration = { 0, 0, -0.5 } },
        drag = { density = 200, current = { 0.5, -0.3, 0.1 } } }
    end },
  { name = "legs that clap", lattices = { { 4, 1, 5 } }, options = { duration = 0.08 },
    scene = function() return { damping = true, self_collision = true } end, place = clap,
    make = shaped("ssss" .. ("s..s"):rep(4)) },
  { name = "a crumpled sheet", lattices = { { 6, 5, 1 } }, options = { duration = 0.01 },
    scene = function() return { damping = true, self_collision = true } end, place = crumple,
    make = shaped(("s"):rep(30)) },
}

--- A simulation of a case that records the traces in which devices are compared.
---@param case limax.device_case
---@param population limax.population
---@param how { precision: string|nil, integrator: string|nil }
---@param device limax.device
---@return limax.simulation
function device_cases.begin(case, population, how, device)
  local size = {}
  for axis = 1, 3 do size[axis] = 0.1 * population.lattice[axis] end
  local scene = case.scene(size)
  local simulation = engine.simulation(population, materials, engine.scene(scene),
    evolution.with({ time_step = 1e-4, settle = 0.01, precision = how.precision,
      integrator = how.integrator or "leapfrog", record = { center_of_mass = 100, position = 50,
        velocity = 50, energy = 100, strain = 100, contact = scene.ground and 100,
        block = scene.block and 200, activation = scene.control and 200 } }, case.options), device)
  if case.place then case.place(simulation) end
  return simulation
end

return device_cases
