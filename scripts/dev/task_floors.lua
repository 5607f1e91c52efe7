--- task_floors.lua: scores a passive body, all of soft tissue, on the worlds of every task. Their
--- texts state these scores. Run it with: limax scripts/dev/task_floors.lua

local engine = require "limax.engine"
local experiments = require "limax.experiment.experiment"
local host = require "limax.host"
local limax = require "limax"
local sample = require "limax.base.statistics.sample"
local script = require "limax.base.script"
local task = require "limax.experiment.task"

for _, file in ipairs(host.file.list(host.home .. "/scripts/tasks")) do
  local experiment = script.run(host.home .. "/scripts/tasks/" .. file)
  local lattice = experiment.config.lattice
  local row = ("s"):rep(lattice[1]) .. "\n"
  local body = limax.robot { voxels = (row:rep(lattice[2]) .. "\n"):rep(lattice[3]),
    materials = experiment.config.materials }
  local scores, wrong = task.scores(experiment, { body:table() }, task.worlds(experiment),
    engine.device "auto")
  assert(not wrong[1], wrong[1])
  print(("%-12s %7.3f in the mean of %d worlds"):format(file, sample.mean(scores[1]), #scores[1]))
end
experiments.idle = false -- none of them is to be run
