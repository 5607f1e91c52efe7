--- defaults.lua: every default of the library in one place, each with its unit, legal range and
--- reason. Values of the paper's tables are marked so; the rest is our choice. `limax.experiment`
--- takes a field's default from here when a script is silent.

local defaults = {}

---@class defaults.field
---@field value any the default
---@field unit string "1" for a pure number
---@field minimum? number inclusive
---@field above? number exclusive lower end
---@field maximum? number inclusive
---@field below? number exclusive upper end
---@field integer? boolean
---@field reason string

---@type table<string, table<string, defaults.field>>
defaults.fields = {
  experiment = {
    lattice = { value = 5, unit = "voxels", minimum = 1, integer = true,
      reason = "the paper's robot size, along each axis" },
    seed = { value = 1, unit = "1", minimum = 0, maximum = 2 ^ 53, integer = true,
      reason = "any seed is as good" },
    population = { value = 30, unit = "robots", minimum = 2, maximum = 1e6, integer = true,
      reason = "the paper's table; two parents need two robots" },
    generations = { value = 100, unit = "generations", minimum = 1, maximum = 1e6, integer = true,
      reason = "the paper's table; numbered from 0, the initial population" },
    repetitions = { value = 3, unit = "repetitions", minimum = 1, maximum = 1e6, integer = true,
      reason = "the paper's table" },
  },
  genome = {
    features = { value = 16, unit = "rows of B", minimum = 1, maximum = 1024, integer = true,
      reason = "32 inputs, as wide as the hidden layers" },
    sigma = { value = 1, unit = "1", minimum = 0, maximum = 100,
      reason = "periods of about one lattice; experiments/sigma_sweep.lua compares" },
    hidden = { value = 32, unit = "neurons", minimum = 1, maximum = 1024, integer = true,
      reason = "two layers of 32" },
    initial_scale = { value = 1, unit = "1", minimum = 0, maximum = 100,
      reason = "weights N(0, 1 / fan_in) as they are" },
    require_muscle = { value = true, unit = "",
      reason = "a body without a muscle cannot walk, and simulating it costs as much" },
  },
  simulation = {
    duration = { value = 5, unit = "s", above = 0, maximum = 1e6,
      reason = "ten periods of the default actuation" },
    settle = { value = 0.5, unit = "s", minimum = 0, maximum = 1e6,
      reason = "a soft body comes to rest in about 0.3 s" },
    bound_fraction = { value = 0.9, unit = "1", above = 0, maximum = 1,
      reason = "the bound is a linear result, muscles shorten springs to 3/4" },
    time_step = { value = "auto", unit = "s", above = 0, maximum = 1,
      reason = "each body's own closed-form bound, capped by the speed of start and drop" },
    time_step_most = { value = 0, unit = "s", minimum = 0, maximum = 1, reason = "0 is no cap" },
    edge = { value = 0.1, unit = "m", minimum = 1e-6, maximum = 1e3,
      reason = "the paper's rest length" },
    position = { value = 0, unit = "m", minimum = -1e6, maximum = 1e6,
      reason = "the lowest corner starts at the origin" },
    velocity = { value = 0, unit = "m/s", minimum = -1e4, maximum = 1e4, reason = "at rest" },
    max_speed = { value = 1000, unit = "m/s", above = 0, maximum = 1e9,
      reason = "three times the speed of sound is no gait" },
    max_stretch = { value = 10, unit = "L0", above = 1, maximum = 1e6,
      reason = "no muscle lengthens a spring past 2 L0" },
  },
  breeding = {
    mutation_rate = { value = 0.1, unit = "per gene", minimum = 0, maximum = 1,
      reason = "the paper's table" },
    mutation_scale = { value = 0.1, unit = "1", minimum = 0, maximum = 100,
      reason = "the paper's table" },
    crossover_rate = { value = 0.4, unit = "per gene", minimum = 0, maximum = 1,
      reason = "the paper's table" },
    elite_fraction = { value = 0.3, unit = "of the population", above = 0, below = 1,
      reason = "the paper's table; one robot at least is kept, and one at least is bred" },
  },
  supervision = {
    hyperparameters = { value = true, unit = "", reason = "what a supervisor is for" },
    materials = { value = false, unit = "",
      reason = "it changes what a score means, so an experiment asks for it" },
  },
  record = {
    rate = { value = 0, unit = "Hz", minimum = 0, maximum = 1e5, integer = true,
      reason = "a trace costs memory: none unless asked" },
  },
  -- the client of a language model
  llm = {
    budget = { value = 180, unit = "s", above = 0, maximum = 86400,
      reason = "per generation, all attempts and waits together: a remote answer takes 1 to 60 s" },
    budget_loopback = { value = 900, unit = "s", above = 0, maximum = 86400,
      reason = "per generation: a first request to a local server also loads the model" },
    timeout = { value = 120, unit = "s", above = 0, maximum = 86400,
      reason = "per attempt: twice what a slow remote answer takes" },
    timeout_loopback = { value = 600, unit = "s", above = 0, maximum = 86400,
      reason = "per attempt: some thousand tokens at the speed of a CPU" },
    max_tokens = { value = 4096, unit = "tokens", minimum = 1, maximum = 1e6, integer = true,
      reason = "an answer takes some hundred, thinking before it some thousand; always sent,"
        .. " because llama.cpp's server writes without end otherwise" },
  },
}

--- The kinds of trace, in the engine's order.
defaults.traces = { "center_of_mass", "position", "velocity", "contact", "energy", "strain",
  "ledger", "block" }

--- What acts when an experiment names no scene: a world in which a soft body can walk.
defaults.scene = { gravity = true, ground = true, friction = true, damping = true,
  actuation = true }

--- Samples of the centre of mass per second, Hz: ten per period of the fastest usual gait (5 Hz).
defaults.record = { center_of_mass = 50 }

defaults.materials = "paper"
defaults.selection = { "tournament", size = 3 }
defaults.supervisor = "rules"

defaults.integrators = { "leapfrog", "rk4", "symplectic_euler", "xpbd" }
defaults.precisions = { "compensated", "double", "mixed", "single" }
defaults.sharings = { "mean", "sum" }

--- Named sets of integrator, precision and time step. A step is `auto` with a cap (s) where the
--- tier has one, so that it still falls on whole samples and never passes a body's own bound.
defaults.tiers = {
  preview = { integrator = "leapfrog", precision = "single", time_step = "auto",
    bound_fraction = 0.9, time_step_most = 0 },
  evolve = { integrator = "leapfrog", precision = "compensated", time_step = "auto",
    bound_fraction = 0.45, time_step_most = 2e-4 },
  publish = { integrator = "leapfrog", precision = "compensated", time_step = "auto",
    bound_fraction = 0.9, time_step_most = 5e-5 },
  reference = { integrator = "leapfrog", precision = "double", time_step = "auto",
    bound_fraction = 0.9, time_step_most = 1e-5 },
}
defaults.accuracy = "evolve"

return defaults
