--- cells.lua: one cell of a study: a run folder that is made, gone on with, or found whole.

local evolve = require "limax.evolution.evolve"
local experiments = require "limax.experiment.experiment"
local failure = require "limax.base.failure"
local host = require "limax.host"
local model_arms = require "limax.tools.study.model_arms"
local resume = require "limax.run.resume"
local run_configuration = require "limax.run.run_configuration"
local run_folder = require "limax.run.run_folder"
local source = require "limax.base.source"

local cells = {}

--- Is this run folder whole?
---@param path string
---@return boolean
function cells.is_done(path)
  local text = source.read(path .. "/STATUS")
  local status = text and host.json.decode(text)
  return status ~= nil and status.state == "done"
end

-- Evaluations and the last best_standard of a run folder with one repetition.
local function result_of(path)
  local text, message = source.read(path .. "/metrics.jsonl")
  if not text then failure.raise(1, message) end
  local evaluations, generations, best = 0, 0, nil
  for line in text:gmatch "[^\n]+" do
    local entry = host.json.decode(line, path)
    evaluations, generations = evaluations + entry.evaluations, generations + 1
    best = entry.best_standard or best
  end
  return { evaluations = evaluations, generations = generations, best = best }
end

-- Refuses a run that another study, or another version of this one, has begun.
local function check(path, before, now)
  local first = resume.differences(before, now)[1]
  if not first then return end
  failure.raise(2, ("%s was begun by another study: %s was %s, is %s; name another --out")
    :format(path, first.path, first.before, first.now))
end

-- The folder of a run that was stopped, cut to its last whole generation.
local function reopen(path, config, scripts)
  local folder = run_folder.open(path)
  folder:continue(config, scripts, { changed = false })
  return folder
end

---@class limax.study.result
---@field evaluations integer
---@field generations integer
---@field best number|nil best_standard of the last generation

--- Runs one repetition of an experiment in `path`, from where it stands to its end.
---@param given { experiment: limax.experiment, repetition: integer, path: string,
--- device: limax.device, say: fun(text: string) }
---@return limax.study.result
function cells.run(given)
  local path, repetition = given.path, given.repetition
  local config, scripts = run_configuration.of(given.experiment, { repetition = repetition })
  local text = source.read(path .. "/config.json")
  local found = text and host.json.decode(text, path .. "/config.json")
  if found then check(path, found, config) end
  if cells.is_done(path) then return result_of(path) end
  local folder = found and reopen(path, config, scripts)
    or run_folder.create(path, given.experiment, { repetition = repetition })
  folder:write_environment(given.device)
  local run = evolve.start(given.experiment, { repetition = repetition, device = given.device,
    folder = folder, say = given.say })
  run:restore(folder, true)
  run:finish()
  folder:status "done"
  folder:close()
  return result_of(path)
end

-- The run of a whole cell with its history, to be read by another.
local function reread(path, experiment, repetition, device)
  local run = evolve.start(experiment, { repetition = repetition, device = device,
    say = function() end })
  local folder = run_folder.open(path)
  run:restore(folder, true)
  folder:close()
  return run
end

--- An experiment of a study. Its runs go on by the study alone: the script that began them returns
--- no experiment, and run again it would begin a study.
---@param given table
---@return limax.experiment
function cells.experiment_of(given)
  local experiment = experiments.new(given)
  experiment.origin = nil
  return experiment
end

--- The experiment of a cell.
---@param study limax.study
---@param cell limax.study.cell
---@return limax.experiment
function cells.experiment(study, cell)
  local given, arm = source.copy(study.given), cell.arm
  given.name, given.repetitions = arm.name, study.repetitions
  given.generations, given.evaluations = study.generations, study.evaluations
  given.supervision = arm.supervision or { hyperparameters = true, materials = false }
  given.supervisor = arm.supervisor
  if arm.reads then
    given.supervisor = { arm.reads, run = study.out .. "/" .. cell.donor.path,
      repetition = cell.donor.repetition }
  elseif arm.blind then
    local other = reread(study.out .. "/" .. cell.donor.path,
      cells.experiment(study, cell.donor), cell.donor.repetition, study.device)
    given.supervisor = source.copy(arm.supervisor)
    given.supervisor.context = model_arms.history_of(other)
  end
  local tuned = study.tuned[cell.repetition]
  if arm.tuned and tuned then
    given.breeding, given.evaluations = tuned.breeding, study.evaluations - tuned.evaluations
  end
  local experiment = cells.experiment_of(given)
  -- what one run learns of an endpoint holds for the next
  experiment.endpoints = study.endpoints
  return experiment
end

return cells
