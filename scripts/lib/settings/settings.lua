--- settings.lua: how a robot is simulated. Checks the fields of `simulation` and `record`, replaces
--- the named tier by its parts, and rounds times up to whole samples. Experiments and
--- `robot:simulate` share it.

local defaults = require "limax.settings.defaults"
local failure = require "limax.base.failure"
local schema = require "limax.base.schema"

local settings = {}

local fields = defaults.fields.simulation

--- What a tier sets, and a newly named tier sets anew.
settings.of_tier = { "integrator", "precision", "time_step", "bound_fraction", "time_step_most" }

local function three(field)
  return schema.list(schema.number(field), { count = 3,
    default = { field.value, field.value, field.value },
    expected = ("a list { x, y, z } in %s"):format(field.unit) })
end

-- A choice that a tier makes when the script does not: absent stays absent.
local function optional(rule)
  return function(given, path)
    if given == nil then return nil end
    return rule(given, path)
  end
end

local function choice(words, default)
  local rule = schema.choice(words)
  return function(given, path) return rule(given == nil and default or given, path) end
end

--- The rule of an experiment's `simulation`.
settings.simulation = schema.fields {
  accuracy = choice({ "preview", "evolve", "publish", "reference" }, defaults.accuracy),
  integrator = optional(schema.choice(defaults.integrators)),
  precision = optional(schema.choice(defaults.precisions)),
  sharing = choice(defaults.sharings, defaults.sharings[1]),
  time_step = optional(schema.word_or_number("auto", fields.time_step)),
  bound_fraction = optional(schema.number(fields.bound_fraction)),
  time_step_most = optional(schema.number(fields.time_step_most)),
  duration = schema.number(fields.duration),
  settle = schema.number(fields.settle),
  edge = schema.number(fields.edge),
  position = three(fields.position),
  velocity = three(fields.velocity),
  max_speed = schema.number(fields.max_speed),
  max_stretch = schema.number(fields.max_stretch),
}

local rates = {}
for _, kind in ipairs(defaults.traces) do
  rates[kind] = schema.number(defaults.fields.record.rate)
end

--- The rule of an experiment's `record`: samples per second of each trace, 0 for none.
settings.record = schema.fields(rates)

-- The parts of a tier, each replaced by the field that the script states itself.
local function apply_tier(simulation)
  local tier = defaults.tiers[simulation.accuracy]
  -- a script that says `auto` means the plain rule: 0.9 of the bound and no cap
  local plain = simulation.time_step == "auto"
  local fraction = plain and fields.bound_fraction.value or tier.bound_fraction
  local most = plain and fields.time_step_most.value or tier.time_step_most
  simulation.integrator = simulation.integrator or tier.integrator
  simulation.precision = simulation.precision or tier.precision
  simulation.time_step = simulation.time_step or tier.time_step
  if simulation.time_step == "auto" then
    simulation.bound_fraction = simulation.bound_fraction or fraction
    simulation.time_step_most = simulation.time_step_most or most
  else
    simulation.bound_fraction, simulation.time_step_most = nil, nil
  end
end

local function greatest_divisor(a, b)
  while b ~= 0 do a, b = b, a % b end
  return a
end

--- Samples per second that all times are whole multiples of: the least common multiple of the
--- rates, raised to a multiple of at least 20 Hz. The engine's schedule follows the same rule.
---@param record table<string, integer>
---@return integer Hz
function settings.base_rate(record)
  local rate, least = 1, 20
  for _, kind in ipairs(defaults.traces) do
    local hertz = record[kind] or 0
    if hertz > 0 then rate = rate / greatest_divisor(rate, hertz) * hertz end
  end
  return rate < least and rate * math.ceil(least / rate) or rate
end

--- Finishes checked tables in place: tier and rounding. Returns what a user should know of it.
---@param simulation table
---@param record table<string, integer>
---@return string[] notes
function settings.finish(simulation, record)
  apply_tier(simulation)
  local notes, rate = {}, settings.base_rate(record)
  for _, name in ipairs { "settle", "duration" } do
    local given = simulation[name]
    -- 1e-12: a whole number of samples that division left a rounding above
    local rounded = math.ceil(given * rate * (1 - 1e-12)) / rate
    if math.abs(rounded - given) > 1e-9 * given then
      notes[#notes + 1] = ("simulation.%s is rounded up from %.9g s to %.9g s, whole samples"
        .. " at %d Hz"):format(name, given, rounded, rate)
    end
    simulation[name] = rounded
  end
  return notes
end

--- What `engine.simulation` takes, from finished tables.
---@param simulation table
---@param record table<string, integer>
---@return table
function settings.engine_options(simulation, record)
  local options = { record = record }
  for key, value in pairs(simulation) do
    if key ~= "accuracy" then options[key] = value end
  end
  return options
end

--- Checks, completes and converts in one go; what is wrong raises at `level` (1 is the caller of
--- this function).
---@param simulation? table as in an experiment
---@param record? table<string, integer>
---@param level? integer
---@return table options for engine.simulation
function settings.simulation_options(simulation, record, level)
  local checked, message = settings.simulation(simulation, "simulation")
  local traces
  if checked then traces, message = settings.record(record or defaults.record, "record") end
  if message then failure.raise(2, message, (level or 1) + 1) end
  settings.finish(checked, traces)
  return settings.engine_options(checked, traces)
end

return settings
