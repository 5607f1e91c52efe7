--- supervise.lua: the library of supervisors, which set the next generation's parameters. Each is a
--- pure function of (history, random, limits) that returns a proposal, or nil to change nothing,
--- and a reason.

local choice = require "limax.base.choice"
local proposals = require "limax.supervise.proposals"
local strict = require "limax.engine.strict"

local supervise = strict.module "limax.supervise"

---@class limax.proposal what a supervisor may ask for; the ledger records what became of it
---@field mutation_rate? number per gene
---@field mutation_scale? number
---@field crossover_rate? number per gene
---@field elite_fraction? number of the population
---@field control_mutation_rate? number per gene, with genes of control, as the next
---@field control_mutation_scale? number
---@field materials? table<string, { stiffness?: number, amplitude?: number, phase?: number }>

-- `limits` are the run's, as `proposals.limits` gives them: narrowed by the experiment's ranges.
---@alias limax.supervisor.law
---| fun(history: limax.generation[], random: table, limits: limax.limit[]): limax.proposal?,string?

--- An entry of the library. Required are `options` and either `make` or `start`.
---@class limax.supervisor.entry
---@field options table<string, schema.rule> the rule of each option; {} for none
---@field make? fun(options: table): limax.supervisor.law a function of a history that is not empty
---@field start? fun(options: table, run: limax.run, fallback: limax.supervisor|nil):
--- limax.supervisor.session for supervisors with state between generations
---@field reads_robots? boolean does `make`'s law read robots, and not only how many there are?
---@field by_generation? boolean does `make`'s law read only the newest generation's number?
---@field unfit? fun(options: table, config: table): string|nil why it cannot serve this experiment
---@field changes? fun(options: table): string[] the fields that it may set; all that an experiment
--- allows if left out

---@class limax.supervisor.session
---@field decide fun(self: any, step: limax.supervision.step): table, table, table, table

-- Each is one file in supervise/.
--- Options of each supervisor, by its name.
---@type table<string, limax.supervisor.entry>
supervise.entries = {
  bandit = require "limax.supervise.bandit",
  constant_median = require "limax.supervise.constant_median",
  fixed = require "limax.supervise.fixed",
  llm = require "limax.supervise.llm",
  one_fifth = require "limax.supervise.one_fifth",
  random = require "limax.supervise.random",
  replay = require "limax.supervise.replay",
  rules = require "limax.supervise.rules",
  schedule = require "limax.supervise.schedule",
  self_adaptive = require "limax.supervise.self_adaptive",
  shuffled = require "limax.supervise.shuffled",
  yoked = require "limax.supervise.yoked",
}

--- Names of the parameters; the last two only exist with genes of control.
supervise.parameters = proposals.parameters

---@class limax.supervisor
---@field name string a library name, or "function"
---@field call limax.supervisor.law|nil
---@field start (fun(run: limax.run): limax.supervisor.session)|nil instead of `call`
---@field own boolean|nil is it the user's own function?
---@field reads_robots boolean|nil may it read robots, and not only how many there are?
---@field by_generation boolean|nil does it read only the newest generation's number?
---@field unfit? fun(config: table): string|nil why it cannot serve this experiment
---@field note? fun(config: table): string|nil what is probably unintended in this experiment
---@field changes string[]|nil the fields that it may set; nil for all that an experiment allows

--- The supervisor that an experiment names: a name, { name, option = value }, or a function.
---@param spec string|table|limax.supervisor.law
---@return limax.supervisor
function supervise.get(spec)
  if type(spec) == "function" then
    return { name = "function", call = spec, own = true, reads_robots = true }
  end
  local name, options = choice.read("supervisor", spec, supervise.entries)
  local entry = supervise.entries[name]
  local supervisor = { name = name, unfit = entry.unfit and function(config)
    return entry.unfit(options, config)
  end, note = entry.note and function(config)
    return entry.note(options, config)
  end, changes = entry.changes and entry.changes(options),
    reads_robots = entry.reads_robots or entry.start ~= nil,
    by_generation = entry.by_generation }
  local fallback = options.fallback
  if fallback == "keep" then fallback = nil end
  fallback = fallback and supervise.get(fallback)
  if entry.start then
    supervisor.start = function(run) return entry.start(options, run, fallback) end
  else
    local law = entry.make(options)
    supervisor.call = function(history, random, limits)
      if #history == 0 then return nil, "nothing is scored yet" end
      return law(history, random, limits)
    end
  end
  return supervisor
end

return strict.close("limax.supervise", supervise)
