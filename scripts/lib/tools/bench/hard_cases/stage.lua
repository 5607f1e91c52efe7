--- stage.lua: what a hard case is given: `c`, its device, precision and integrator, a way to put
--- robots into a scene, and checks. Every run is also held to the general checks: all numbers are
--- finite, robots end as the case says, the energy of a passive scene never rises, and where
--- nothing outside pushes, the centre of mass goes where Newton says and angular momentum stays. SI
--- units.

local engine = require "limax.engine"
local general = require "limax.tools.bench.hard_cases.general"

local stage = {}

---@class limax.hard_cases.context
---@field device limax.device
---@field precision string
---@field integrator string
---@field full boolean the long version of the case is wanted
---@field fraction number|nil of the step's bound where the case names neither step nor fraction
---@field notes string[] what the case wants to be known besides its verdict
local methods = {}
local class = { __index = methods }

-- ---- checks -------------------------------------------------------------------------------------

local function fail(pattern, ...) error(pattern:format(...), 0) end

--- Fails unless |got - expected| <= atol + rtol |expected|. NaN is near nothing.
---@param what string
---@param got number
---@param expected number
---@param tolerance { rtol: number|nil, atol: number|nil }
function methods:near(what, got, expected, tolerance)
  local allowed = (tolerance.atol or 0) + (tolerance.rtol or 0) * math.abs(expected)
  if not (math.abs(got - expected) <= allowed) then
    fail("%s is %.9g; expected %.9g, %.2g off where %.2g is allowed", what, got, expected,
      math.abs(got - expected), allowed)
  end
end

--- Fails unless got <= most.
---@param what string
---@param got number
---@param most number
function methods:at_most(what, got, most)
  if not (got <= most) then fail("%s is %.6g; at most %.6g is allowed", what, got, most) end
end

--- Fails unless got >= least.
---@param what string
---@param got number
---@param least number
function methods:at_least(what, got, least)
  if not (got >= least) then fail("%s is %.6g; at least %.6g is expected", what, got, least) end
end

--- Fails unless both have the same bits; tables, number by number.
---@param what string
---@param got any
---@param expected any
function methods:same_bits(what, got, expected)
  if type(expected) ~= "table" then
    if not (got == expected or (got ~= got and expected ~= expected)) then
      fail("%s: %s where the same bits as %s are expected", what, tostring(got),
        tostring(expected))
    end
    return
  end
  if #got ~= #expected then fail("%s: %d values, expected %d", what, #got, #expected) end
  for i = 1, #expected do self:same_bits(("%s[%d]"):format(what, i), got[i], expected[i]) end
end

--- Fails unless `call` raises a message that contains `pattern`.
---@param pattern string
---@param call fun()
function methods:raises(pattern, call)
  local fine, message = pcall(call)
  if fine then fail("nothing was raised where %q was expected", pattern) end
  if not tostring(message):find(pattern) then fail("%q is not in: %s", pattern, message) end
end

--- The tolerance of this precision, from a table that has one for each, or `fp32` for the three
--- that round forces to fp32. Plain sums round at every step: that of `single` is for 0.9 of the
--- bound and grows as `--fraction` makes steps shorter.
---@param by_precision { double: number, fp32: number|nil, single: number|nil, mixed: number|nil }
---@return number
function methods:by_precision(by_precision)
  local tolerance = by_precision[self.precision] or by_precision.fp32
  if self.precision ~= "single" or not self.fraction then return tolerance end
  return tolerance * math.max(1, 0.9 / self.fraction)
end

--- Something to print beside the verdict.
---@param pattern string
function methods:note(pattern, ...) self.notes[#self.notes + 1] = pattern:format(...) end

-- ---- bodies -------------------------------------------------------------------------------------

--- The paper's materials with some fields of some letters changed.
---@param changes table<string, table<string, number>>|nil { b = { stiffness = 1e6 } }
---@return limax.materials
function methods:materials(changes)
  local materials = engine.materials "paper"
  for letter, fields in pairs(changes or {}) do
    for field, value in pairs(fields) do materials:set(materials:index(letter), field, value) end
  end
  return materials
end

-- One value for each voxel, x first, from a constant or a function of x, y, z and the robot.
local function each_voxel(lattice, given, robot)
  local list = {}
  for z = 1, lattice[3] do
    for y = 1, lattice[2] do
      for x = 1, lattice[1] do
        list[#list + 1] = type(given) == "function" and given(x, y, z, robot) or given
      end
    end
  end
  return list
end

--- A population of bodies described by letters.
---@param spec { lattice: integer[], voxels: string|fun(x,y,z,robot): string, count: integer|nil,
--- weights: table|nil }
---@param materials limax.materials
---@return limax.population
function methods:population(spec, materials)
  local population = engine.population { lattice = spec.lattice, count = spec.count or 1 }
  for robot = 1, population.count do
    local weights = {}
    for name, given in pairs(spec.weights or {}) do
      weights[name] = type(given) == "number" and given or each_voxel(spec.lattice, given, robot)
    end
    population:set_body(robot, each_voxel(spec.lattice, spec.voxels or "b", robot), weights,
      materials)
  end
  population:check(materials, { require_muscle = false })
  return population
end

-- ---- runs ---------------------------------------------------------------------------------------

---@class limax.hard_cases.run
---@field simulation limax.simulation
---@field spec table
local Run = {}
Run.__index = Run

--- Positions and velocities of a robot's masses, as tables.
---@param robot integer|nil 1 if left out
---@return number[][] m
---@return number[][] m/s
function Run:state(robot)
  local positions, velocities = self.simulation:state(robot or 1)
  return positions:table(), velocities:table()
end

--- Speed of a robot's fastest mass.
---@param robot integer|nil
---@return number m/s
function Run:fastest(robot)
  local _, velocities = self:state(robot)
  local most = 0
  for _, v in ipairs(velocities) do
    most = math.max(most, math.sqrt(v[1] ^ 2 + v[2] ^ 2 + v[3] ^ 2))
  end
  return most
end

--- What became of a robot.
---@param robot integer|nil
---@return limax.outcome
function Run:outcome(robot) return self.simulation:outcome(robot or 1) end

--- A trace of a robot as a table.
---@param kind string
---@param robot integer|nil
---@return number[][]
function Run:trace(kind, robot) return self.simulation:trace(robot or 1, kind):table() end

--- Steps further, and holds the state to what must always hold.
---@param steps integer
function Run:advance(steps) self.simulation:advance(1e6, steps) end

-- Places robots as the spec says: `place(robot, positions, velocities)` changes the tables.
local function place(run)
  local spec = run.spec
  if not spec.place then return end
  for robot = 1, spec.count or 1 do
    local positions, velocities = run:state(robot)
    if spec.place(positions, velocities, robot) ~= false then
      run.simulation:place(robot, positions, velocities)
    end
  end
end

-- fields of a spec that are the simulation's own options
local OPTIONS = {
  "duration", "settle", "time_step", "bound_fraction", "edge", "position", "velocity",
  "max_speed", "max_stretch", "sharing", "integrator", "precision",
}

--- Prepares robots in a scene and places them, without a step.
---@param spec table see `run`
---@return limax.hard_cases.run
function methods:prepare(spec)
  local materials = spec.table_of_materials or self:materials(spec.materials)
  local population = self:population(spec, materials)
  local record = {}
  for kind, rate in pairs(spec.record or {}) do record[kind] = rate end
  if general.wants_energy(spec) and not record.energy then record.energy = 100 end
  local options = { record = record, integrator = self.integrator, precision = self.precision,
    settle = 0, duration = 1, time_step = "auto", bound_fraction = self.fraction }
  for _, name in ipairs(OPTIONS) do
    if spec[name] ~= nil then options[name] = spec[name] end
  end
  local simulation = engine.simulation(population, materials, engine.scene(spec.scene or {}),
    options, self.device)
  local run = setmetatable({ simulation = simulation, spec = spec, options = options }, Run)
  -- robots are made when they are first asked for their state: their outcome knows the step then
  if simulation.masses[1] > 0 then simulation:state(1) end
  place(run)
  run.start = general.start(run)
  return run
end

--- Prepares robots, runs them to the end and holds them to the general checks.
---
--- A spec has a body (lattice, voxels, weights, count, materials), a `scene`, options of the
--- simulation, `place(positions, velocities, robot)`, and what the general checks need to know:
--- `diverges`, the reason or reasons for which robot 1 must be reported (by default robots end
--- well), `may_diverge`, reasons that are an honest answer too, and `energy = false` where the
--- energy may rise.
---@param spec table
---@return limax.hard_cases.run
function methods:run(spec)
  local run = self:prepare(spec)
  run.simulation:run()
  general.check(self, run)
  return run
end

--- Makes the context of one case in one combination.
---@param fields { device: limax.device, precision: string, integrator: string, full: boolean,
--- fraction: number|nil }
---@return limax.hard_cases.context
function stage.context(fields)
  return setmetatable({ device = fields.device, precision = fields.precision,
    integrator = fields.integrator, full = fields.full or false, fraction = fields.fraction,
    notes = {} }, class)
end

return stage
