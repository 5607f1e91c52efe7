--- named_parts.lua: the pieces of the library that an experiment names, each by a name, a table or
--- a function: fitness, selection, survival, archive, supervisor, encoding and variation.

local defaults = require "limax.settings.defaults"
local encodings = require "limax.encoding"
local engine = require "limax.engine"
local failure = require "limax.base.failure"
local fault = require "limax.engine.fault"
local given_body = require "limax.experiment.encodings.given_body"
local measures = require "limax.experiment.measures"
local schema = require "limax.engine.schema"
local source = require "limax.base.source"
local variation = require "limax.variation"

local named_parts = {}

--- Calls a piece of the library on a user's value; returns its error under the field's name.
local function resolved(field, call, value)
  local ok, result = failure.attempt(call, value)
  if ok then return result end
  -- without its place: the caller adds that of the experiment
  local message = fault.is(result) and result.text
    or tostring(result):gsub("^[^\n]-:%d+: ", "", 1)
  if message:find(field, 1, true) ~= 1 then message = field .. ": " .. message end
  return nil, message
end
named_parts.resolved = resolved

-- Adds the survival, the archive and their measures to the parts.
local function resolve_memory(spec, parts)
  local message
  parts.survival, message =
    resolved("survival", require("limax.survival").get, spec.survival or defaults.survival)
  if not message and spec.archive ~= nil then
    parts.archive, message = resolved("archive", require("limax.archive").get, spec.archive)
  end
  if message then return message end
  if not (parts.archive or parts.survival.objectives or parts.survival.needs) then return nil end
  parts.measured, message = measures.of(parts)
  return message
end

--- The named parts of the library: fitness, selection, survival, archive, supervisor; the state.
---@return table|nil
---@return string|nil message
function named_parts.of(spec)
  local fitness, wrong_fitness =
    resolved("fitness", require("limax.fitness").get, spec.fitness)
  if fitness and fitness.name ~= "function" and type(spec.fitness) == "function" then
    spec.fitness = fitness.name -- a function of the library
  end
  local parts = { fitness = fitness, state = spec.state }
  local wrong_memory = not wrong_fitness and resolve_memory(spec, parts) or nil
  parts.selection_named = spec.selection or (parts.survival or {}).selection or defaults.selection
  local selection, wrong_selection =
    resolved("selection", require("limax.selection").get, parts.selection_named)
  local supervisor, wrong_supervisor = resolved("supervisor", require("limax.supervise").get,
    spec.supervisor or defaults.supervisor)
  local message = wrong_fitness or wrong_selection or wrong_supervisor or wrong_memory
  if not message and spec.state ~= nil and type(spec.state) ~= "function" then
    message = ("state: expected a function that returns a table, got %s; write state = function()"
      .. " return { ... } end"):format(schema.show(spec.state))
  end
  if message then return nil, message end
  parts.selection, parts.supervisor = selection, supervisor
  return parts
end

local OF_CONTROL = { "control_mutation_rate", "control_mutation_scale" }

--- The rates that the mutation or the crossover "none" does not use, with its name.
---@param steps { mutation: limax.variation.step, crossover: limax.variation.step }
---@return table<string, string>
function named_parts.idle_rates(steps)
  local mutation = steps.mutation.none and 'the mutation "none"' or nil
  return { mutation_rate = mutation, mutation_scale = mutation,
    control_mutation_rate = mutation, control_mutation_scale = mutation,
    crossover_rate = steps.crossover.none and 'the crossover "none"' or nil }
end

--- Parameters of `breeding` that a script sets and that no part uses.
---@param steps { mutation: limax.variation.step, crossover: limax.variation.step }
---@param control_genes integer of a robot
---@return string[] notes
function named_parts.unused(spec, parts, steps, control_genes)
  local own, list = spec.breeding or {}, {}
  local function note(name, is_unused, what)
    if own[name] ~= nil and is_unused then
      list[#list + 1] = ("breeding.%s: %s does not use it"):format(name, what)
    end
  end
  local survival = parts.survival.name
  note("elite_fraction", survival ~= "elitist" and survival ~= "function",
    ("the survival %q"):format(survival))
  for name, step in pairs(named_parts.idle_rates(steps)) do note(name, true, step) end
  for _, name in ipairs(OF_CONTROL) do
    note(name, control_genes == 0, "a scene without genes of control")
  end
  return list
end

-- Why an experiment without genes of control cannot have a field of `genome`; nil if it can.
local function lacks_control(own, control_genes)
  if control_genes > 0 then return nil end
  local name = own.body ~= nil and "body" or own.control_spread ~= nil and "control_spread"
  return name and ("genome.%s: it varies genes of control, and no scene of this experiment has any;"
    .. " remove it, or add scene = { control = ... }"):format(name)
end

-- The encoding that an experiment names, and the fields of `genome` that it uses.
local function encoding_of(config, body, named)
  if body then
    return given_body.encoding(body, engine.materials(config.materials)), {}
  end
  local shape = { lattice = config.lattice, materials = #config.materials.materials }
  return encodings.get(named, shape), encodings.fields(named)
end

--- The encoding and the variation of an experiment; leaves in `genome` the fields that it uses, and
--- in `breeding` those of genes of control only if there are any.
---@param base string|nil folder of the script
---@param body limax.robot.description|nil of each robot, as `genome.body` names it
---@param control_genes integer of a robot
---@return limax.encoding.definition|nil
---@return string|nil message
---@return table|nil variation
function named_parts.genome(config, spec, base, body, control_genes)
  local genome, own = config.genome, spec.genome or {}
  local message = lacks_control(own, control_genes)
  if message then return nil, message end
  local named = own.encoding == nil and defaults.encoding or own.encoding
  local found
  found, message = resolved(body and "genome.body" or "genome.encoding", function()
    return { encoding_of(config, body, named) }
  end)
  if message then return nil, message end
  local definition, used = found[1], { control_spread = control_genes > 0 }
  for name in pairs(found[2]) do used[name] = true end
  definition.control_genes = control_genes
  for _, name in ipairs(control_genes == 0 and OF_CONTROL or {}) do config.breeding[name] = nil end
  for name in pairs(require("limax.engine.encoding").genome_rules) do
    if not used[name] then
      if own[name] ~= nil then
        return nil, ("genome.%s: the encoding %q does not use it; remove it, in a command by --set"
          .. " genome.%s=null"):format(name, definition.name, name)
      end
      genome[name] = nil
    end
  end
  local steps
  steps, message = resolved("genome", function() return variation.get(own, definition) end)
  if message then return nil, message end
  for _, name in ipairs { "encoding", "mutation", "crossover" } do
    local plain_default = name == "encoding" and named == defaults.encoding
    genome[name] = own[name] ~= nil and not plain_default and source.describe(own[name], base)
      or nil
  end
  return definition, nil, steps
end

return named_parts
