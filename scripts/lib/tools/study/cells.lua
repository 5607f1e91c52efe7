--- cells.lua: one cell of a study: a run folder that is created, resumed, or read if it is done.

local evolve = require "limax.evolution.evolve"
local experiments = require "limax.experiment.experiment"
local failure = require "limax.base.failure"
local resume = require "limax.run.resume"
local run_config = require "limax.run.config"
local run_folder = require "limax.run.folder"
local runs = require "limax.tools.report.runs"
local shell = require "limax.base.shell"
local source = require "limax.base.source"

local cells = {}

---@class limax.study.result
---@field evaluations integer
---@field generations integer
---@field best number|nil best_standard of the last generation

-- Is this the configuration of a run of a sweep?
local function is_planned(run, planned)
  local overrides, changes = run.overrides, planned.changes
  for k, change in ipairs(changes) do
    if overrides[#overrides - #changes + k] ~= change then return false end
  end
  return run.repetition == planned.repetition
end

--- Is this run folder done? Another process may be writing it.
---@param planned? limax.sweep.run of a sweep; a folder of another run, or of somebody else, is
--- refused
function cells.is_done(path, planned)
  local found = runs.is_folder(path) and run_folder.read(path)
  if not found or found.journal:state() ~= "done" then return false end
  if planned and not (found.owner == "own" and is_planned(found.config.run, planned)) then
    failure.raise(2, ("%s is not a run of this sweep, or is not sealed with your key: remove it, or"
      .. " look at it and trust it: limax trust %s"):format(path, shell.path(path)))
  end
  return true
end

--- The result of a run folder with one repetition.
function cells.result(path)
  local run = runs.read(path).runs[1]
  local result = { evaluations = run.evaluations, generations = #run.lines }
  for _, line in ipairs(run.lines) do result.best = line.best_standard or result.best end
  return result
end

-- Refuses a run folder of another configuration.
local function check(path, config)
  local difference = resume.differences(run_folder.read(path).config, config)[1]
  if difference then
    failure.raise(2, ("%s was started by another study: %s was %s, is %s; choose another --out")
      :format(path, difference.path, difference.before, difference.now))
  end
end

--- Runs one repetition of an experiment in `path`, from its last generation to its end.
---@param options { experiment: limax.experiment, repetition: integer, path: string,
--- device: limax.device, say: fun(text: string) }
function cells.run(options)
  local path, repetition, experiment = options.path, options.repetition, options.experiment
  local config, scripts = run_config.of(experiment, { repetition = repetition })
  local folder
  if not run_folder.is_run(path) then
    folder = run_folder.create(path, experiment, { repetition = repetition })
  else
    check(path, config)
    if cells.is_done(path) then return cells.result(path) end
    folder = run_folder.open(path)
    folder:continue(config, scripts, false)
  end
  folder:start(options.device)
  local run = evolve.start(experiment, { repetition = repetition, device = options.device,
    folder = folder, say = options.say })
  run:finish()
  folder:finish "done"
  folder:close()
  return cells.result(path)
end

--- An experiment of a study. It has no script of its own: only the study can resume its runs.
function cells.experiment_of(options)
  local experiment = experiments.new(options)
  experiment.origin = nil
  return experiment
end

--- The experiment of a cell.
function cells.experiment(study, cell)
  local options, arm, donor = source.copy(study.options), cell.arm, cell.donor
  options.name, options.repetitions = arm.name, study.repetitions
  options.generations, options.evaluations = study.generations, study.evaluations
  options.supervision = arm.supervision or { hyperparameters = true, materials = false }
  options.supervisor = arm.supervisor
  if arm.reads then
    options.supervisor = { arm.reads, run = study.out .. "/" .. donor.path,
      repetition = donor.repetition }
  end
  local tuned = arm.tuned and study.tuned[cell.repetition]
  if tuned then
    options.breeding, options.evaluations = tuned.breeding, study.evaluations - tuned.evaluations
  end
  return cells.experiment_of(options)
end

return cells
