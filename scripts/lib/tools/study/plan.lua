--- plan.lua: the arms of a study of supervision, and its cells: each arm in each repetition. Arms
--- differ in who sets the parameters of the next generation; experiment, seed, repetitions, first
--- populations and the budget of evaluations are the same in all.

local failure = require "limax.base.failure"
local proposals = require "limax.supervise.proposals"
local source = require "limax.base.source"
local suggest = require "limax.engine.suggest"

local plan = {}

---@class limax.study.arm
---@field name string
---@field supervisor? any as in an experiment
---@field supervision? { hyperparameters: boolean, materials: boolean } only hyperparameters if left
--- out
---@field reads? string name of the supervisor that reads the donor's run
---@field tuned? boolean breeding is tuned first, from the same budget
---@field asks? boolean asks a language model

---@class limax.study.cell
---@field arm limax.study.arm
---@field repetition integer
---@field path string of its run folder, below the study's
---@field donor? limax.study.cell

--- Estimated tokens of one question and answer, with the default prompt.
plan.TOKENS = 3300

-- The arms that ask a language model. The fallback is `keep`, so that no other supervisor's work is
-- counted as the model's.
local function model_arms(materials, both)
  local function arm(name, supervision, options)
    local supervisor = source.copy(options or {})
    supervisor[1], supervisor.fallback = "llm", "keep"
    return { name = name, asks = true, supervisor = supervisor, supervision = supervision }
  end
  return { arm "llm", arm("llm_materials", materials), arm("llm_both", both),
    arm("llm_paper", nil, { prompt = "paper.md", context = "paper" }) }
end

-- Elites decrease from half of the population to one, mutations to a tenth, as in EvoGym's genetic
-- algorithm and in annealing; `last` is the last generation.
local function schedule(config, last)
  local scale, within = config.breeding.mutation_scale, {}
  for _, limit in ipairs(proposals.limits(config.population, config.supervision.ranges)) do
    within[limit.field] = function(value)
      return math.max(limit.minimum, math.min(limit.maximum, value))
    end
  end
  local scaled, elite = within.mutation_scale, within.elite_fraction
  return { "schedule", mutation_scale = { { 0, scaled(scale) }, { last, scaled(scale / 10) } },
    elite_fraction = { { 0, elite(0.5) }, { last, elite(0) } }, shape = "geometric" }
end

--- The arms in the order in which they run. Materials are changed by the `random` and `llm` arms
--- only, without and with hyperparameters: a 2 x 2 design with `fixed` and the plain arm.
function plan.arms(config, with_model)
  -- generations that simulate whole populations: no arm has fewer
  local last = math.max(1, math.floor(config.evaluations / config.population) - 1)
  local materials = { hyperparameters = false, materials = true }
  local both = { hyperparameters = true, materials = true }
  local list = {
    { name = "fixed", supervisor = "fixed" },
    { name = "tuned_fixed", supervisor = "fixed", tuned = true },
    { name = "schedule", supervisor = schedule(config, last) },
    { name = "random", supervisor = "random" },
    { name = "random_materials", supervisor = "random", supervision = materials },
    { name = "random_both", supervisor = "random", supervision = both },
    { name = "one_fifth", supervisor = "one_fifth" },
    { name = "self_adaptive", supervisor = "self_adaptive" },
    { name = "bandit", supervisor = "bandit" },
    { name = "rules", supervisor = "rules" },
  }
  if with_model then
    for _, arm in ipairs(model_arms(materials, both)) do list[#list + 1] = arm end
  end
  for _, name in ipairs { "constant_median", "yoked", "shuffled" } do
    list[#list + 1] = { name = name, reads = name }
  end
  return list
end

-- The arm whose parameters are read by others: the model's if there is one, else `rules`.
local function donor_arm(arms)
  local donor
  for _, arm in ipairs(arms) do
    if arm.name == "llm" or arm.name == "rules" and not donor then donor = arm.name end
  end
  return donor
end

--- Some of the arms, by their names. An arm that reads another arm's runs needs that arm.
---@param names string[]|nil all if left out
function plan.choose(arms, names)
  if not names then return arms end
  local all, wanted, chosen = {}, {}, {}
  for _, name in ipairs(names) do wanted[name] = true end
  for k, arm in ipairs(arms) do
    all[k] = arm.name
    if wanted[arm.name] then chosen[#chosen + 1], wanted[arm.name] = arm, nil end
  end
  local unknown = next(wanted)
  if unknown then
    failure.raise(2, ("study: unknown arm %s%s"):format(unknown, suggest.ending(unknown, all)))
  end
  local donor = donor_arm(chosen)
  for _, arm in ipairs(chosen) do
    if arm.reads and not donor then
      failure.raise(2, ("study: %s reads the runs of llm or rules, which is not among the arms")
        :format(arm.name))
    end
  end
  return chosen
end

--- All cells, donors before the cells that read them, repetition by repetition, so that a study
--- that is stopped has complete repetitions.
function plan.cells(arms, repetitions)
  local list, cell_of, donor = {}, {}, donor_arm(arms)
  for _, arm in ipairs(arms) do cell_of[arm.name] = {} end
  for _, reading in ipairs { false, true } do
    for repetition = 1, repetitions do
      for _, arm in ipairs(arms) do
        if reading == (arm.reads ~= nil) then
          local cell = { arm = arm, repetition = repetition,
            path = ("%s/r%02d"):format(arm.name, repetition) }
          -- the next repetition, the first for the last
          cell.donor = reading and cell_of[donor][repetition % repetitions + 1] or nil
          cell_of[arm.name][repetition] = cell
          list[#list + 1] = cell
        end
      end
    end
  end
  return list
end

return plan
