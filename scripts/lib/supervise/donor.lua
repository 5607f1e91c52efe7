--- donor.lua: the parameters of another run, for the controls `yoked`, `shuffled` and
--- `constant_median`: does a supervisor help by its answers, or only because parameters vary? They
--- read a finished run and propose what was applied there.

local choice = require "limax.base.choice"
local engine = require "limax.engine"
local host = require "limax.host"
local reader = require "limax.run.reader"
local schema = require "limax.engine.schema"

local donor = {}

---@class limax.donor
---@field run string folder
---@field repetition integer
---@field config table of that run
---@field supervisor string that gave the parameters
---@field settings table[] of generations 1, 2, ...: parameters and materials as they were applied

--- Options of every supervisor that reads another run.
donor.options = {
  run = function(value, path)
    if type(value) == "string" and value ~= "" then return value end
    return nil, ("%s.run: expected the folder of another run, got %s"):format(
      path:gsub("%.run$", ""), schema.show(value))
  end,
  repetition = schema.number { value = 1, unit = "of that run", minimum = 1, maximum = 1e6,
    integer = true, reason = "a run of one repetition has no other" },
}

local function fail(options, text) engine.fail(("supervisor: %s: %s"):format(options.run, text)) end

--- The run that `options` name; raises if it cannot be used.
---@param options { run: string, repetition: integer }
function donor.read(options)
  local from = reader.read(options.run)
  local state = from.journal:state()
  if state ~= "done" then fail(options, ("is not done (%s)"):format(state)) end
  if from:last(options.repetition) < 0 then
    fail(options, ("has no repetition %d"):format(options.repetition))
  end
  local settings = {}
  for k, line in ipairs(from:lines("metrics", options.repetition)) do
    settings[k - 1] = { parameters = line.parameters, materials = line.materials }
  end
  return { run = options.run, repetition = options.repetition, config = from.config,
    supervisor = from:line("ledger", options.repetition, 0).supervisor, settings = settings }
end

-- Runs must begin with equal values of these: changes per generation are limited.
local BEGINNING = { "breeding", "population", "materials" }

--- Why an experiment cannot use that run's parameters; nil if it can. The run needs as many
--- generations, or the same budget of evaluations, and the same limits and first values.
---@param config table of the experiment
function donor.unfit(options, config)
  local from = donor.read(options)
  local own = from.config
  local function differs(a, b) return host.json.encode { a } ~= host.json.encode { b } end
  if #from.settings + 1 < config.generations
    and (not config.evaluations or config.evaluations ~= own.evaluations) then
    return ("%s has %d generations, this experiment %d"):format(options.run, #from.settings + 1,
      config.generations)
  end
  for _, name in ipairs(BEGINNING) do
    if differs(own[name], config[name]) then
      return ("%s began with another %s"):format(options.run, name)
    end
  end
  for _, name in ipairs { "ranges", "hyperparameters", "materials" } do
    local mine = config.supervision[name]
    if differs(own.supervision[name], mine) and not (name ~= "ranges" and not mine) then
      return ("%s had other limits: supervision.%s"):format(options.run, name)
    end
  end
end

-- A setting as a proposal, as far as this experiment allows.
local function proposal_of(setting, limits)
  local proposal = {}
  for _, limit in ipairs(limits) do
    if limit.allowed and not limit.material then
      proposal[limit.field] = setting.parameters[limit.field]
    elseif limit.allowed then
      proposal.materials = proposal.materials or {}
      for _, name in ipairs(choice.sorted_keys(setting.materials)) do
        proposal.materials[name] = proposal.materials[name] or {}
        proposal.materials[name][limit.field] = setting.materials[name][limit.field]
      end
    end
  end
  return proposal
end

--- A supervisor that proposes settings of another run.
---@param begin fun(from: limax.donor, options: table): fun(generation: integer): table|nil, string
--- the setting for a generation, or nil; and the reason, with %s for the source
---@param options? table<string, schema.rule> besides those of every such supervisor
function donor.supervisor(begin, options)
  local all = options or {}
  for name, rule in pairs(donor.options) do all[name] = rule end
  return {
    options = all, unfit = donor.unfit,
    make = function(chosen)
      local from = donor.read(chosen)
      local source_name = ("repetition %d of %s (%s)"):format(from.repetition, from.run,
        from.supervisor)
      local setting_for = begin(from, chosen)
      return function(history, _, limits)
        local setting, reason = setting_for(history[#history].generation + 1)
        return setting and proposal_of(setting, limits), reason:format(source_name)
      end
    end,
  }
end

return donor
