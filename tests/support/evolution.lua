--- evolution.lua: a small experiment and its run, for the suites of the evolution loop.

local limax = require "limax"
local process = require "support.process"
local reader = require "limax.run.reader"
local source = require "limax.base.source"

local evolution = {}

--- A table with fields replaced or added.
function evolution.with(fields, changes)
  local all = {}
  for _, part in ipairs { fields, changes or {} } do
    for name, value in pairs(part) do all[name] = value end
  end
  return all
end

--- A small experiment, whose generations take a few hundredths of a second; `fields` replace its
--- own.
function evolution.small(fields)
  return limax.experiment(evolution.with({ fitness = "distance", lattice = { 2, 2, 2 },
    population = 6, generations = 3, repetitions = 1, supervisor = "fixed",
    simulation = { duration = 0.4, settle = 0.1, accuracy = "preview" } }, fields))
end

-- Fields of its own replace these.
local SCRIPT = [[
local limax = require "limax"
local fields = { name = "try", lattice = { 2, 2, 2 }, population = 6, generations = 3,
  repetitions = 1, simulation = { duration = 0.1, settle = 0, accuracy = "preview" },
  supervisor = "fixed", fitness = "distance" }
for name, value in pairs { %s } do fields[name] = value end
return limax.experiment(fields)
]]

--- Writes the script of a tiny experiment.
---@param fields? string its fields as Lua text, from line 5 of the script
function evolution.script(path, fields) process.write(path, SCRIPT:format(fields or "")) end

function evolution.silent() end

--- The history of a finished run, and the run.
function evolution.finished(fields, options)
  options = options or {}
  options.say = options.say or evolution.silent
  local run = limax.start(evolution.small(fields), options)
  return run:finish(), run
end

--- The records of the robots of a generation that have a score.
function evolution.scored(population)
  local list = {}
  for _, robot in ipairs(population) do
    if robot.fitness then list[#list + 1] = robot.record end
  end
  return list
end

--- The ids of the first `count` robots of a generation, its survivors, as a set.
function evolution.survivors(entry, count)
  local ids = {}
  for place = 1, count do ids[entry.population[place].id] = true end
  return ids
end

--- A finished run of three short generations of six robots.
---@param fields? table of the experiment
---@return string folder
function evolution.run(folder, fields)
  evolution.finished(evolution.with({ simulation = { duration = 0.2, settle = 0.05,
    accuracy = "preview" } }, fields), { out = folder })
  return folder
end

--- The lines of a growing file of repetition 1.
---@param name? "metrics"|"ledger"|"timing"
---@return table[]
function evolution.metrics(folder, name) return reader.read(folder):lines(name or "metrics", 1) end

--- The state of a run.
---@return "running"|"done"|"stopped"|"failed"
function evolution.state(folder) return (reader.read(folder).journal:state()) end

--- Checks that these files of two run folders have the same bytes.
---@param names string[]
function evolution.same_files(t, got, expected, names)
  for _, name in ipairs(names) do
    t:ok(t:ok(source.read(got .. "/" .. name)) == source.read(expected .. "/" .. name),
      ("%s/%s differs"):format(got, name))
  end
end

-- Files that are the same after every interruption.
local SAME = { "r01/metrics.jsonl", "r01/ledger.jsonl", "r01/robots/g0004.npy",
  "r01/genomes/g0004.npy" }

--- Checks that a run of five generations has the same bytes as one that stopped after three and
--- went on, and as one that went on from an earlier generation.
---@param fields table of the experiment
---@param more? string[] further files
function evolution.resumes(t, fields, more)
  local whole, broken = t:folder() .. "/whole", t:folder() .. "/broken"
  local function run(generations, options)
    evolution.finished(evolution.with({ generations = generations }, fields), options)
  end
  run(5, { out = whole })
  run(3, { out = broken })
  for _, options in ipairs { {}, { from = 1 } } do
    run(5, evolution.with({ out = broken, resume = true, changed = true }, options))
    evolution.same_files(t, broken, whole, SAME)
    evolution.same_files(t, broken, whole, more or {})
  end
end

return evolution
