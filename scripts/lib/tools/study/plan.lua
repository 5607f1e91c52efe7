--- plan.lua: the arms of a study of supervision, and its cells: each arm in each repetition. Arms
--- differ in who sets the next generation's parameters; experiment, seed, repetitions, first
--- populations and the budget of evaluations are the same in all.

local failure = require "limax.base.failure"
local model_arms = require "limax.tools.study.model_arms"
local suggest = require "limax.base.suggest"

local plan = {}

---@class limax.study.arm
---@field name string
---@field supervisor? any as in an experiment
---@field supervision? { hyperparameters: boolean, materials: boolean } the first alone if left out
---@field reads? string name of the supervisor that reads the donor's run
---@field tuned? boolean breeding is tuned first, from the same budget
---@field asks? boolean asks a language model
---@field blind? boolean is told of the donor's history in the place of its own

---@class limax.study.cell
---@field arm limax.study.arm
---@field repetition integer
---@field path string of its run folder, below the study's
---@field donor? limax.study.cell

-- Elites fall from the most that is legal to one, mutations to a tenth, as in EvoGym's genetic
-- algorithm and in annealing; `horizon` is the last generation.
local function schedule(given, horizon)
  local scale = given.breeding.mutation_scale
  return { "schedule", mutation_scale = { { 0, scale }, { horizon, scale / 10 } },
    elite_fraction = { { 0, 0.5 }, { horizon, 1 / given.population } }, shape = "geometric" }
end

--- The arms, in the order in which they are run and told. Materials may be changed in `random` and
--- `llm` arms alone, without and with hyperparameters: a 2 x 2 with `fixed` and the plain arm.
---@param config table of the experiment
---@param with_model boolean
---@return limax.study.arm[]
function plan.arms(config, with_model)
  -- a whole population each time: no arm has fewer generations
  local horizon = math.max(1, math.floor(config.evaluations / config.population) - 1)
  local materials = { hyperparameters = false, materials = true }
  local both = { hyperparameters = true, materials = true }
  local list = {
    { name = "fixed", supervisor = "fixed" },
    { name = "tuned_fixed", supervisor = "fixed", tuned = true },
    { name = "schedule", supervisor = schedule(config, horizon) },
    { name = "random", supervisor = "random" },
    { name = "random_materials", supervisor = "random", supervision = materials },
    { name = "random_both", supervisor = "random", supervision = both },
    { name = "one_fifth", supervisor = "one_fifth" },
    { name = "self_adaptive", supervisor = "self_adaptive" },
    { name = "bandit", supervisor = "bandit" },
    { name = "rules", supervisor = "rules" },
  }
  if with_model then
    for _, arm in ipairs(model_arms.list(materials, both)) do list[#list + 1] = arm end
  end
  for _, name in ipairs { "constant_median", "yoked", "shuffled" } do
    list[#list + 1] = { name = name, reads = name }
  end
  return list
end

-- Whose trajectory the arms that read one are lent: the model's where there is one.
local function lender_of(arms)
  local lender
  for _, arm in ipairs(arms) do
    if arm.name == "llm" or arm.name == "rules" and not lender then lender = arm.name end
  end
  return lender
end

--- Some of the arms, by their names. Whatever reads another arm's runs needs that arm.
---@param arms limax.study.arm[]
---@param names string[]|nil all if left out
---@return limax.study.arm[]
function plan.choose(arms, names)
  if not names then return arms end
  local known, wanted, list = {}, {}, {}
  for k, arm in ipairs(arms) do known[k] = arm.name end
  for _, name in ipairs(names) do wanted[name] = true end
  for _, arm in ipairs(arms) do
    if wanted[arm.name] then list[#list + 1], wanted[arm.name] = arm, nil end
  end
  local unknown = next(wanted)
  if unknown then
    failure.raise(2, ("study: unknown arm %s%s"):format(unknown, suggest.ending(unknown, known)))
  end
  local lender = lender_of(list)
  for _, arm in ipairs(list) do
    if arm.reads and not lender or arm.blind and lender ~= "llm" then
      failure.raise(2, ("study: %s reads the runs of %s, which is not among the arms"):format(
        arm.name, arm.blind and "llm" or "llm or rules"))
    end
  end
  return list
end

--- The repetition whose trajectory a repetition is lent: the next one, the first for the last. No
--- repetition is its own.
---@param repetition integer
---@param repetitions integer 2 at least
---@return integer
function plan.donor_of(repetition, repetitions) return repetition % repetitions + 1 end

--- All cells, donors before those that read them; repetition after repetition, so that a study that
--- is stopped has whole repetitions.
---@param arms limax.study.arm[]
---@param repetitions integer
---@return limax.study.cell[]
function plan.cells(arms, repetitions)
  local list, cell_of, lender = {}, {}, lender_of(arms)
  for _, arm in ipairs(arms) do cell_of[arm.name] = {} end
  for _, reading in ipairs { false, true } do
    for repetition = 1, repetitions do
      for _, arm in ipairs(arms) do
        if reading == (arm.reads ~= nil or arm.blind == true) then
          local cell = { arm = arm, repetition = repetition,
            path = ("%s/r%02d"):format(arm.name, repetition) }
          if reading then
            local from = arm.blind and "llm" or lender
            cell.donor = cell_of[from][plan.donor_of(repetition, repetitions)]
          end
          cell_of[arm.name][repetition] = cell
          list[#list + 1] = cell
        end
      end
    end
  end
  return list
end

return plan
