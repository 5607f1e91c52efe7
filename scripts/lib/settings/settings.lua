--- settings.lua: the fields `simulation` and `record` of experiments and `robot:simulate`: checks,
--- tiers, and durations rounded up to whole samples.

local defaults = require "limax.settings.defaults"
local failure = require "limax.base.failure"
local schema = require "limax.engine.schema"

local settings = {}

local fields = defaults.fields.simulation

--- The fields that a tier sets, and that an override which names a tier resets.
settings.of_tier = { "integrator", "precision", "time_step", "bound", "bound_fraction",
  "time_step_most" }
--- The fields that only an automatic step uses.
settings.of_auto = { "bound", "bound_fraction", "time_step_most" }

local function forget_auto(simulation)
  for _, name in ipairs(settings.of_auto) do simulation[name] = nil end
end

--- The rule of a field that may be absent.
function settings.optional(rule)
  return function(value, path)
    if value == nil then return nil end
    return rule(value, path)
  end
end

--- The rule of a lattice.
function settings.lattice(default)
  return schema.list(schema.number(defaults.fields.experiment.lattice), { count = 3,
    default = default, expected = "a list { nx, ny, nz } of voxels" })
end

local optional = settings.optional

local function choice(words, default)
  local rule = schema.choice(words)
  return function(value, path) return rule(value == nil and default or value, path) end
end

local rules = {
  -- a tier sets those that the script does not
  accuracy = choice({ "preview", "evolve", "publish", "reference" }, defaults.accuracy),
  integrator = optional(schema.choice(defaults.integrators)),
  precision = optional(schema.choice(defaults.precisions)),
  bound = optional(schema.choice(defaults.bounds)),
  sharing = choice(defaults.sharings, defaults.sharings[1]),
}
for name, field in pairs(fields) do rules[name] = schema.field(field) end
rules.time_step = schema.word_or_number("auto", fields.time_step)
rules.bound_fraction = optional(rules.bound_fraction)
rules.time_step_most = optional(rules.time_step_most)

--- The rule of an experiment's `simulation`.
settings.simulation = schema.fields(rules)
--- The names of its fields.
settings.names = {}
for name in pairs(rules) do table.insert(settings.names, name) end
table.sort(settings.names)

--- The rules of the fields that a trial may replace: those of `simulation` that do not make bodies.
settings.of_trial = {}
for name, rule in pairs(rules) do
  if name ~= "edge" and name ~= "sharing" then settings.of_trial[name] = optional(rule) end
end

--- Replaces some settings: an accuracy replaces the whole tier, and a fixed step removes the fields
--- of an automatic one.
---@param changes table other fields of it are ignored
---@param names string[] the settings
function settings.replaced(own, changes, names)
  local result = {}
  for _, name in ipairs(names) do result[name] = own[name] end
  for _, name in ipairs(changes.accuracy and settings.of_tier or {}) do result[name] = nil end
  for _, name in ipairs(names) do
    if changes[name] ~= nil then result[name] = changes[name] end
  end
  if type(changes.time_step) == "number" then forget_auto(result) end
  return result
end

local rates = {}
for _, kind in ipairs(defaults.traces) do
  rates[kind] = schema.number(defaults.fields.record.rate)
end

--- The rule of the traces in `record`: samples per second of each, 0 for none.
settings.record = schema.fields(rates)

local of_experiment = { population = schema.choice(defaults.kept_robots) }
for kind, rule in pairs(rates) do of_experiment[kind] = rule end
--- The rule of an experiment's `record`: also which robots its folder keeps.
settings.record_of_experiment = schema.fields(of_experiment)

local own_rates = {}
for kind, rule in pairs(rates) do own_rates[kind] = optional(rule) end
--- The rule of a trial's `record`: rates that replace the experiment's.
settings.of_trial.record = optional(schema.fields(own_rates))

-- Fills in the parts of the tier that the script does not set itself.
local function apply_tier(simulation)
  local tier = defaults.tiers[simulation.accuracy]
  -- `auto` in a script is the plain rule: 0.9 of the bound and no cap
  local auto = simulation.time_step == "auto" and { time_step_most = fields.time_step_most.value,
    bound_fraction = fields.bound_fraction.value } or tier
  simulation.integrator = simulation.integrator or tier.integrator
  simulation.precision = simulation.precision or tier.precision
  simulation.time_step = simulation.time_step or tier.time_step
  if simulation.time_step == "auto" then
    for _, name in ipairs(settings.of_auto) do
      simulation[name] = simulation[name] or auto[name]
    end
  else
    forget_auto(simulation)
  end
end

local function greatest_divisor(a, b)
  while b ~= 0 do a, b = b, a % b end
  return a
end

--- The base rate: the least common multiple of the record rates, raised to a multiple of at least
--- 20 Hz. A duration is a whole number of its samples, as in the engine's schedule.
---@return integer Hz
function settings.base_rate(record)
  local rate, least = 1, 20
  for _, kind in ipairs(defaults.traces) do
    local hertz = record[kind] or 0
    if hertz > 0 then rate = rate / greatest_divisor(rate, hertz) * hertz end
  end
  return rate < least and rate * math.ceil(least / rate) or rate
end

-- Notes of traces whose last sample is before the end of a run.
local function short_traces(duration, record)
  local function ends(rate) return math.floor(duration * rate * (1 + 1e-12)) / rate end
  local notes = {}
  for _, kind in ipairs(defaults.traces) do
    local rate = record[kind] or 0
    if rate > 0 and ends(rate) < duration * (1 - 1e-9) then
      notes[#notes + 1] = ("record.%s: at %d Hz its last sample is at %.4g s of %.4g s, and what it"
        .. " measures ends there; record at a rate that makes the duration whole samples"):format(
        kind, rate, ends(rate), duration)
    end
  end
  return notes
end

--- Completes checked tables in place: tier and rounding. Returns notes for the user.
function settings.finish(simulation, record)
  apply_tier(simulation)
  local rate, time = settings.base_rate(record), simulation.duration
  -- 1e-12: division may leave a whole number of samples slightly too large
  simulation.duration = math.ceil(time * rate * (1 - 1e-12)) / rate
  local notes = short_traces(simulation.duration, record)
  if math.abs(simulation.duration - time) > 1e-9 * time then
    table.insert(notes, 1, ("simulation.duration is rounded up from %.9g s to %.9g s, whole samples"
      .. " at %d Hz"):format(time, simulation.duration, rate))
  end
  return notes
end

--- Makes the options of `engine.simulation` from finished tables.
function settings.engine_options(simulation, record)
  local options = { record = record }
  for key, value in pairs(simulation) do
    if key ~= "accuracy" then options[key] = value end
  end
  return options
end

--- Checks, completes and converts; raises at `level` (1 is the caller of this function).
---@param simulation? table as in an experiment
---@return table options for engine.simulation
---@return string[] notes
function settings.simulation_options(simulation, record, level)
  local checked, message = settings.simulation(simulation, "simulation")
  local traces
  if checked then traces, message = settings.record(record or defaults.record, "record") end
  if message then failure.raise(2, message, (level or 1) + 1) end
  local notes = settings.finish(checked, traces)
  return settings.engine_options(checked, traces), notes
end

return settings
