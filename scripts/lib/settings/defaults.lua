--- defaults.lua: every field of an experiment that is a number or a switch: default, unit, range
--- and note. Fields that the engine has too are its own (engine/base/fields.h).

local fields = require "limax.engine.fields"
local names = require "limax.engine.names"
local strict = require "limax.engine.strict"

local defaults = {}

---@class defaults.field: limax.range
---@field value any the default
---@field unit string "1" for a pure number
---@field note string what it is, or why the default is what it is

-- The engine's fields of a group, with those of `own` added.
local function with_engine(group, own)
  local all = fields.of(group)
  for name, field in pairs(own) do all[name] = field end
  return all
end

---@type table<string, table<string, defaults.field>>
defaults.fields = {
  experiment = {
    lattice = { value = 5, unit = "voxels", minimum = 1, integer = true,
      note = "the paper's robot size, along each axis" },
    seed = { value = 1, unit = "1", minimum = 0, maximum = 2 ^ 53, integer = true,
      note = "any seed is as good" },
    population = { value = 30, unit = "robots", minimum = 2, maximum = 1e6, integer = true,
      note = "the paper's table; two parents need two robots" },
    generations = { value = 100, unit = "generations", minimum = 1, maximum = 1e6, integer = true,
      note = "the paper's table; numbered from 0, the initial population" },
    repetitions = { value = 3, unit = "repetitions", minimum = 1, maximum = 1e6, integer = true,
      note = "the paper's table" },
  },
  genome = with_engine("genome", {
    require_muscle = { value = true, unit = "",
      note = "a body without a muscle cannot walk, and simulating it costs as much" },
  }),
  simulation = with_engine("simulation", {}),
  breeding = with_engine("breeding", {
    elite_fraction = { value = 0.3, unit = "of the population", above = 0, below = 1,
      note = "the paper's table; at least one robot is kept, and at least one is bred" },
  }),
  islands = {
    count = { value = 5, unit = "islands", minimum = 2, maximum = 5e5, integer = true,
      note = "six robots each in the default population" },
    every = { value = 10, unit = "generations", minimum = 1, maximum = 1e6, integer = true,
      note = "from one exchange to the next: time to become different" },
    migrants = { value = 2, unit = "robots", minimum = 0, maximum = 1e6, integer = true,
      note = "that each island receives in an exchange: the best, which also stay at home" },
  },
  supervision = {
    hyperparameters = { value = true, unit = "", note = "the purpose of a supervisor" },
    materials = { value = false, unit = "",
      note = "it changes what a score means, so an experiment must ask for it" },
  },
  record = {},
  -- the client of a language model
  llm = {
    budget = { value = 180, unit = "s", above = 0, maximum = 86400,
      note = "per generation, all attempts and waits together: a remote answer takes 1 to 60 s" },
    budget_loopback = { value = 900, unit = "s", above = 0, maximum = 86400,
      note = "per generation: a first request to a local server also loads the model" },
    timeout = { value = 120, unit = "s", above = 0, maximum = 86400,
      note = "per attempt: twice what a slow remote answer takes" },
    timeout_loopback = { value = 600, unit = "s", above = 0, maximum = 86400,
      note = "per attempt: some thousand tokens at the speed of a CPU" },
    max_tokens = { value = 4096, unit = "tokens", minimum = 1, maximum = 1e6, integer = true,
      note = "an answer takes some hundred, thinking before it some thousand; always sent,"
        .. " because llama.cpp's server has no limit of its own" },
  },
}

local simulation = defaults.fields.simulation
simulation.settle.value = 0.5 -- s: a soft body comes to rest in about 0.3 s
simulation.time_step.value = "auto"
defaults.fields.record.rate, simulation.record = simulation.record, nil

-- A sorted copy.
local function sorted(list)
  local copy = { unpack(list) }
  table.sort(copy)
  return copy
end

--- The kinds of trace, in the engine's order.
defaults.traces = names.trace.names
defaults.integrators = sorted(names.integrator.names)
defaults.precisions = sorted(names.precision.names)
defaults.sharings = names.sharing.names
defaults.bounds = names.bound.names
--- Which islands send robots to an island; the first is the default.
defaults.topologies = { "ring", "complete", "random" }

--- The effects of an experiment that names no scene: a world in which a soft body can walk.
defaults.scene = { gravity = true, ground = true, friction = true, damping = true,
  actuation = true }

--- Samples of the centre of mass per second, Hz: ten per period of the fastest usual gait (5 Hz).
defaults.record = { center_of_mass = 50 }

--- The robots of each generation that a run folder keeps; the first is the default.
defaults.kept_robots = { "all", "best" }

defaults.materials = "paper"
defaults.encoding = "fourier"
defaults.selection = { "tournament", size = 3 }
defaults.survival = "elitist"
defaults.supervisor = "rules"

--- Named sets of integrator, precision and time step. A step is `auto` with a cap (s) where the
--- tier has one, so that it still falls on whole samples and never passes a body's own bound.
defaults.tiers = {
  preview = { integrator = "leapfrog", precision = "single", time_step = "auto",
    bound = "voxels", bound_fraction = 0.9, time_step_most = 0 },
  evolve = { integrator = "leapfrog", precision = "compensated", time_step = "auto",
    bound_fraction = 0.45, time_step_most = 2e-4 },
  publish = { integrator = "leapfrog", precision = "compensated", time_step = "auto",
    bound_fraction = 0.9, time_step_most = 5e-5 },
  reference = { integrator = "leapfrog", precision = "double", time_step = "auto",
    bound_fraction = 0.9, time_step_most = 1e-5 },
}
defaults.accuracy = "evolve"

return setmetatable(defaults, { __newindex = strict.read_only("limax.defaults",
  "an experiment sets the fields that differ") })
