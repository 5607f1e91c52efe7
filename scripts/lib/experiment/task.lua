--- task.lua: tasks: experiments with a score that others can reach for. A task is an experiment
--- with three fields more: a `version`, which changes when scores are no longer comparable, what it
--- is `about`, and a `small` budget. Worlds that differ are its `trials`.

local choice = require "limax.base.choice"
local experiments = require "limax.experiment.experiment"
local failure = require "limax.base.failure"
local host = require "limax.host"
local robot = require "limax.robot.robot"
local schema = require "limax.engine.schema"
local scoring = require "limax.robot.scoring"
local source = require "limax.base.source"
local strict = require "limax.engine.strict"

local task = strict.module "limax.task"

---@class limax.task
---@field version integer
---@field about { measured: string, passive: string, fixed: string } a sentence each: what the score
--- is, what a body without muscles gets, what a gait that senses nothing can get
---@field small string[] changes as `--set` takes them

local WORLDS = 32
-- The last repetition that random numbers have: worlds of it and those before are of no run.
local FRESH = 2 ^ 24 - 1

-- by experiment
local facts = setmetatable({}, { __mode = "k" })

local sentence = schema.required(schema.string)
local check = schema.fields {
  version = schema.whole(1, 1e6, 1),
  about = schema.required(schema.fields { measured = sentence, passive = sentence,
    fixed = sentence }),
}

--- A task, as an experiment.
---@param spec table as for limax.experiment, with `version`, `about { measured, passive, fixed }`
--- and `small`, changes by their path: `small = { population = 12, ["simulation.duration"] = 2 }`
---@return limax.experiment
function task.new(spec)
  local function required(rule, value, path)
    local result, message = rule(value, path)
    if not result then
      -- a script ends in `return limax.task { ... }`, which leaves no line
      failure.raise(2, message, (source.caller() or "limax.task") .. ": ")
    end
    return result
  end
  local fields = {}
  for name, value in pairs(required(schema.table, spec, "limax.task")) do fields[name] = value end
  local own = required(check, { version = spec.version, about = spec.about or {} }, "limax.task")
  fields.version, fields.about, fields.small, own.small = nil, nil, nil, {}
  local small = required(schema.table, spec.small or {}, "limax.task: small")
  for _, path in ipairs(choice.sorted_keys(small)) do
    table.insert(own.small, ("%s=%s"):format(path, host.json.encode(small[path])))
  end
  local experiment = experiments.new(fields)
  facts[experiment] = own
  return experiment
end

--- What makes an experiment a task; nil for any other.
---@param experiment limax.experiment
---@return limax.task|nil
function task.of(experiment) return facts[experiment] end

--- The worlds of an experiment, or at least 32 that no run has seen if it draws them.
---@return limax.trial[]
function task.worlds(experiment)
  if type(experiment.spec.trials) ~= "function" then return experiment.trials.list end
  local worlds, lists = {}, 0
  while #worlds < WORLDS do
    local list = experiment.trials:of(FRESH - lists)(0)
    for _, world in ipairs(list) do worlds[#worlds + 1] = world end
    lists = lists + 1
  end
  return worlds
end

--- The score of a robot in each world at `publish`; nil and a message if it has none in one.
---@param description limax.robot.description
---@param worlds limax.trial[]
---@param device limax.device|string
---@return number[]|nil scores
---@return string|nil message
function task.scores(experiment, description, worlds, device)
  description = source.copy(description)
  description.trials = {}
  for k, world in ipairs(worlds) do
    description.trials[k] = { scene = world.scene, simulation = world.options,
      materials = world.engine_materials and world.engine_materials:table() }
  end
  local scores = {}
  local walked = robot.of(description):simulate { accuracy = "publish", device = device }
  for k, trial in ipairs(walked.trials) do
    local wrong
    if trial.status == "done" then
      local value, _, message = scoring.call(experiment.fitness.call, trial)
      scores[k], wrong = value, message
    end
    if not scores[k] then return nil, wrong or trial.reason end
  end
  return scores
end

return strict.close("limax.task", task)
