--- context.lua: what a hard case gets as `c`: its device, precision and integrator, a way to
--- simulate robots, and checks. invariants.lua checks every run too. SI units.

local compare = require "limax.tools.test.compare"
local engine = require "limax.engine"
local invariants = require "limax.tools.bench.hard_cases.invariants"
local source = require "limax.base.source"

local context = {}

---@class limax.hard_cases.context
---@field device limax.device
---@field precision string
---@field integrator string
---@field full boolean run the long version
---@field notes string[]
---@field reported string|nil reason of an expected divergence
local methods = {}
local class = { __index = methods }

--- The effects of a passive scene on flat ground.
context.LAND = { gravity = true, ground = true, friction = true, damping = true }

--- Defaults of the engine: m/s^2 and N/m.
context.GRAVITY, context.GROUND = 9.81, 1e5

local function fail(pattern, ...) error(pattern:format(...), 0) end

--- A tolerance: a number, or a table with one for each precision, `fp32` for those that round
--- forces to fp32.
function methods:tolerance(tolerance)
  if type(tolerance) ~= "table" then return tolerance or 0 end
  return tolerance[self.precision] or tolerance.fp32
end

--- Fails unless |got - expected| <= atol + rtol |expected|; always for NaN.
---@param allowed { rtol: number|table|nil, atol: number|table|nil } see `tolerance`
function methods:near(what, got, expected, allowed)
  local most = self:tolerance(allowed.atol) + self:tolerance(allowed.rtol) * math.abs(expected)
  if not (math.abs(got - expected) <= most) then
    fail("%s is %.9g; expected %.9g, %.2g off where %.2g is allowed", what, got, expected,
      math.abs(got - expected), most)
  end
end

--- Fails unless every number of two lists of vectors is near.
function methods:near_rows(what, got, expected, atol)
  if #got ~= #expected then fail("%s: %d rows, expected %d", what, #got, #expected) end
  for i, row in ipairs(expected) do
    for axis = 1, 3 do
      self:near(("%s: mass %d"):format(what, i), got[i][axis], row[axis], { atol = atol })
    end
  end
end

--- Fails unless got <= most, a number or a table; see `tolerance`.
function methods:at_most(what, got, most)
  most = self:tolerance(most)
  if not (got <= most) then fail("%s is %.6g; at most %.6g is allowed", what, got, most) end
end

--- Fails unless got >= least.
function methods:at_least(what, got, least)
  if not (got >= least) then fail("%s is %.6g; at least %.6g is expected", what, got, least) end
end

--- Fails unless both have the same bits; compares tables element by element.
function methods:same_bits(what, got, expected)
  local difference = compare.same_bits(expected, got)[1]
  if difference then fail("%s: %s", what, compare.text(difference)) end
end

--- Fails unless `call` raises a message that contains `pattern`.
function methods:raises(pattern, call)
  local fine, message = pcall(call)
  if fine then fail("nothing was raised where %q was expected", pattern) end
  if not tostring(message):find(pattern) then fail("%q is not in: %s", pattern, message) end
end

--- A text printed beside the verdict.
function methods:note(pattern, ...) self.notes[#self.notes + 1] = pattern:format(...) end

--- The paper's materials with some fields of some letters changed.
---@param changes table<string, table<string, number>>|nil { b = { stiffness = 1e6 } }
function methods:materials(changes)
  local materials = engine.materials "paper"
  for letter, fields in pairs(changes or {}) do
    for field, value in pairs(fields) do materials:set(materials:index(letter), field, value) end
  end
  return materials
end

-- One value per voxel, x fastest, from a constant or a function of x, y, z and the robot.
local function each_voxel(lattice, value, robot)
  local list, nx, ny = {}, lattice[1], lattice[2]
  for i = 0, nx * ny * lattice[3] - 1 do
    local x, y, z = i % nx + 1, math.floor(i / nx) % ny + 1, math.floor(i / nx / ny) + 1
    list[i + 1] = type(value) == "function" and value(x, y, z, robot) or value
  end
  return list
end

local function population_of(spec, materials)
  local population = engine.population { lattice = spec.lattice, count = spec.count or 1 }
  for robot = 1, population.count do
    local weights = {}
    for name, value in pairs(spec.weights or {}) do
      weights[name] = type(value) == "number" and value or each_voxel(spec.lattice, value, robot)
    end
    population:set_body(robot, each_voxel(spec.lattice, spec.voxels or "b", robot), weights,
      materials)
  end
  population:check(materials, { require_muscle = false })
  return population
end

---@class limax.hard_cases.run
---@field simulation limax.simulation
---@field spec table
---@field options table of the simulation
---@field verdict "holds"|"reported"
local Run = {}
Run.__index = Run

--- Positions (m) and velocities (m/s) of a robot's masses; of robot 1 if left out.
function Run:state(robot)
  local positions, velocities = self.simulation:state(robot or 1)
  return positions:table(), velocities:table()
end

--- Speed of the fastest mass of robot 1, m/s.
function Run:fastest()
  local _, velocities = self:state()
  local most = 0
  for _, v in ipairs(velocities) do
    most = math.max(most, math.sqrt(v[1] ^ 2 + v[2] ^ 2 + v[3] ^ 2))
  end
  return most
end

--- The least and largest coordinate of the masses of robot 1 along an axis, m.
function Run:extent(axis)
  local low, high = math.huge, -math.huge
  for _, p in ipairs((self:state())) do
    low, high = math.min(low, p[axis]), math.max(high, p[axis])
  end
  return low, high
end

--- Force of the ground's penalty springs on robot 1, N.
function Run:ground_force()
  local sum = 0
  for _, p in ipairs((self:state())) do sum = sum + context.GROUND * math.max(0, -p[3]) end
  return sum
end

function Run:outcome(robot) return self.simulation:outcome(robot or 1) end

--- Weight of robot 1 under the engine's gravity, N.
function Run:weight() return context.GRAVITY * self:outcome().mass end

--- The displacement of robot 1's centre of mass along an axis, m.
function Run:moved(axis)
  local outcome = self:outcome()
  return outcome.center_end[axis] - outcome.center_start[axis]
end

function Run:trace(kind, robot) return self.simulation:trace(robot or 1, kind):table() end

function Run:advance(steps) self.simulation:advance(1e6, steps) end

-- Fields of a spec that are options of the simulation.
local OPTIONS = { "duration", "settle", "time_step", "bound_fraction", "edge", "position",
  "velocity", "max_speed", "max_stretch" }

--- Creates the simulation of a spec and places its robots, without a step.
function methods:prepare(spec)
  local materials, record = self:materials(spec.materials), source.copy(spec.record or {})
  if invariants.passive(spec) and not record.energy then record.energy = 100 end
  local options = { record = record, integrator = self.integrator, precision = self.precision,
    settle = 0, duration = 1, time_step = "auto" }
  for _, name in ipairs(OPTIONS) do
    if spec[name] ~= nil then options[name] = spec[name] end
  end
  local simulation = engine.simulation(population_of(spec, materials), materials,
    engine.scene(spec.scene or {}), options, self.device)
  local run = setmetatable({ simulation = simulation, spec = spec, options = options }, Run)
  -- the first look at a state creates the robots; after it outcomes have the time step
  if simulation.masses[1] > 0 then simulation:state(1) end
  for robot = 1, spec.place and (spec.count or 1) or 0 do
    local positions, velocities = run:state(robot)
    if spec.place(positions, velocities, robot) ~= false then
      simulation:place(robot, positions, velocities)
    end
  end
  run.start = invariants.start(run)
  return run
end

--- Simulates robots to the end and checks the invariants.
---
--- A spec has a body (lattice, voxels, weights, count, materials), a `scene`, options of the
--- simulation, and `place(positions, velocities, robot)`, which changes the start. For the
--- invariants: `diverges`, reasons for which robot 1 must diverge; `may_diverge`, reasons for which
--- a robot may; `energy = false` where the energy may rise; `center = false` where the centre of
--- mass and the angular momentum are unknown.
function methods:run(spec)
  local run = self:prepare(spec)
  run.simulation:run()
  invariants.check(self, run)
  return run
end

--- The context of one case in one combination.
---@param fields table those of limax.hard_cases.context but for notes and reported
function context.new(fields)
  return setmetatable({ device = fields.device, precision = fields.precision,
    integrator = fields.integrator, full = fields.full or false, notes = {} }, class)
end

return context
