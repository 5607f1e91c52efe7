--- task.lua: tasks: experiments with a score that others can reach for. A task is an experiment
--- with three fields more: a `version`, which changes when scores are no longer comparable, what it
--- is `about`, and a `small` budget. Worlds that differ are its `trials`.

local choice = require "limax.base.choice"
local engine = require "limax.engine"
local experiments = require "limax.experiment.experiment"
local failure = require "limax.base.failure"
local host = require "limax.host"
local prepared = require "limax.robot.prepared"
local robot = require "limax.robot.robot"
local robot_file = require "limax.robot.robot_file"
local rows = require "limax.robot.rows"
local schema = require "limax.engine.schema"
local scored_robot = require "limax.robot.scored_robot"
local scoring = require "limax.robot.scoring"
local source = require "limax.base.source"
local steps = require "limax.robot.steps"
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

-- A simulation of robots in a world at `publish`, and what a scored robot of it is made of.
local function prepare(one, k, descriptions, device)
  local parts = prepared.parts(one, { accuracy = "publish", trial = k })
  local robots = robot_file.population(descriptions, one.description.lattice)
  for i, description in ipairs(descriptions) do
    robot_file.place(robots, i, description, parts.materials)
  end
  robots:check(parts.materials, { require_muscle = false })
  local simulation = engine.simulation(robots, parts.materials, parts.scene, parts.options, device)
  return simulation, { by_hand = true, population = robots, simulation = simulation,
    materials = parts.materials, scene = parts.scene:table(), options = parts.options }
end

-- The score of a robot in a world; nil and why if it has none.
local function score_of(experiment, row, context, i)
  if row.status ~= "done" then return nil, row.reason or row.status end
  local own = source.copy(context)
  own.index = i
  local score, _, message = scoring.call(experiment.fitness.call, scored_robot.new(row, own))
  return score, message
end

--- The scores of robots in each world at `publish`. All are simulated together.
---@param descriptions limax.robot.description[] of one lattice, with the same materials
---@param worlds limax.trial[]
---@param device limax.device
---@return number[][] scores [robot][world]
---@return table<integer, string> wrong why a robot has no score in a world
function task.scores(experiment, descriptions, worlds, device)
  local first = source.copy(descriptions[1])
  first.trials = {}
  for k, world in ipairs(worlds) do
    first.trials[k] = { scene = world.scene, simulation = world.options,
      materials = world.engine_materials and world.engine_materials:table() }
  end
  local one, simulations, contexts, scores, wrong = robot.of(first), {}, {}, {}, {}
  for k = 1, #worlds do
    simulations[k], contexts[k] = prepare(one, k, descriptions, device)
  end
  steps.finish(simulations)
  for i = 1, #descriptions do scores[i] = {} end
  for k, context in ipairs(contexts) do
    local all = rows.together(context.population, context.materials, context.simulation)
    for i, row in ipairs(all) do
      local score, message = score_of(experiment, row, context, i)
      scores[i][k], wrong[i] = score, wrong[i] or message
    end
  end
  return scores, wrong
end

return strict.close("limax.task", task)
