--- cases.lua: simulations that run without end, a slice at a time, for timing. Wall time includes
--- everything that `advance` does: limits, origin, centre of mass at 50 Hz.

local bodies = require "limax.tools.bench.bodies"
local engine = require "limax.engine"

local cases = {}

--- s: well below the bound of these bodies with every integrator, and a divisor of the sample
--- interval.
cases.TIME_STEP = 1e-4

-- s of simulated time: longer than all slices, with traces of at most a gigabyte
local function duration_of(count) return math.min(1e4, math.max(20, math.floor(1e6 / count))) end

---@class limax.bench.how
---@field lattice integer[]
---@field count integer robots
---@field scene table
---@field integrator string
---@field precision string
---@field device limax.device
---@field seconds number of one slice

---@class limax.bench.case
---@field run fun(): number a slice; returns springs times steps done
---@field springs integer of one robot
---@field masses integer of one robot
---@field facts table of simulation:describe()
---@field free fun()

--- Creates a case and warms it up.
function cases.endless(materials, how)
  local population = bodies.population(materials, how.lattice, how.count)
  local simulation = engine.simulation(population, materials, engine.scene(how.scene), {
    integrator = how.integrator, precision = how.precision, time_step = cases.TIME_STEP,
    duration = duration_of(how.count), settle = 0, record = { center_of_mass = 50 } }, how.device)
  population:free()
  -- creates kernels and measures the time of a step
  simulation:advance(0.02)
  local before = simulation:advance(0.02).spring_steps
  local outcome = simulation:outcome(1)
  return {
    springs = outcome.springs, masses = outcome.masses, facts = simulation:describe(),
    run = function()
      local progress = simulation:advance(how.seconds)
      assert(not progress.finished, "the robots ended while they were timed")
      local done = progress.spring_steps - before
      before = progress.spring_steps
      return done
    end,
    free = function() simulation:free() end,
  }
end

return cases
