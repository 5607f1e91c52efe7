--- cases.lua: simulations that run without end, a slice at a time, and their best rates on a busy
--- machine. Wall time includes everything that `advance` does: limits, origin, centre of mass at
--- 50 Hz.

local bodies = require "limax.tools.bench.bodies"
local engine = require "limax.engine"
local host = require "limax.host"

local cases = {}

--- s: well below the bound of these bodies with every integrator, and a divisor of the sample
--- interval.
cases.TIME_STEP = 1e-4

-- s of simulated time: longer than all slices, with traces of at most a gigabyte
local function duration_of(count) return math.min(1e4, math.max(20, math.floor(1e6 / count))) end

--- Creates a case and warms it up.
---@param how { lattice: integer[], count: integer, scene: table, integrator: string,
--- precision: string, device: limax.device, seconds: number } `count` robots, `seconds` of a slice
---@return { run: (fun(): number), springs: integer, masses: integer, facts: table, free: fun() }
--- `run` does a slice and returns springs times steps done; `springs` and `masses` of one robot
function cases.endless(materials, how)
  local population = bodies.population(materials, how.lattice, how.count)
  local simulation = engine.simulation(population, materials, engine.scene(how.scene), {
    integrator = how.integrator, precision = how.precision, time_step = cases.TIME_STEP,
    duration = duration_of(how.count), settle = 0, record = { center_of_mass = 50 },
    max_speed = 1e6 }, how.device) -- m/s: without a ground the robots fall all the time
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

--- Runs every case once per round, so that other work on the machine affects all alike, and returns
--- the best rate of each.
---@param list { run: fun(): number }[] run does its work and returns how much it was
---@param clock? fun(): number s, of the wall if left out
function cases.best_rates(list, rounds, clock)
  clock = clock or host.clock
  local best = {}
  for _ = 1, rounds do
    for i, case in ipairs(list) do
      local start = clock()
      local work = case.run()
      best[i] = math.max(best[i] or 0, work / (clock() - start))
    end
  end
  return best
end

return cases
