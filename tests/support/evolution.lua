--- evolution.lua: a small experiment and its run, for the suites of the evolution loop.

local limax = require "limax"
local process = require "support.process"
local reader = require "limax.run.reader"
local source = require "limax.base.source"

local evolution = {}

--- A small experiment, whose generations take a few hundredths of a second; `fields` replace its
--- own.
function evolution.small(fields)
  local options = { fitness = "distance", lattice = { 2, 2, 2 }, population = 6, generations = 3,
    repetitions = 1, simulation = { duration = 0.4, settle = 0.1, accuracy = "preview" },
    supervisor = "fixed" }
  for name, value in pairs(fields or {}) do options[name] = value end
  return limax.experiment(options)
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

--- A finished run of three short generations of six robots.
---@param fields? table of the experiment
---@return string folder
function evolution.run(folder, fields)
  local options = { simulation = { duration = 0.2, settle = 0.05, accuracy = "preview" } }
  for name, value in pairs(fields or {}) do options[name] = value end
  limax.start(evolution.small(options), { out = folder, say = evolution.silent }):finish()
  return folder
end

--- The lines of a growing file of repetition 1.
---@param name? "metrics"|"ledger"|"timing"
---@return table[]
function evolution.metrics(folder, name) return reader.read(folder):lines(name or "metrics", 1) end

--- The state of a run.
---@return "running"|"done"|"stopped"|"failed"
function evolution.state(folder) return (reader.read(folder).journal:state()) end

--- Runs `limax report` with these words, which must succeed.
function evolution.report(t, base, words)
  return process.completes(t, base, { "report", unpack(words) })
end

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
  local function spec(generations)
    local all = { generations = generations }
    for name, value in pairs(fields) do all[name] = value end
    return evolution.small(all)
  end
  local folder = t:folder()
  local function check(name, options)
    limax.start(spec(5), options):finish()
    for _, files in ipairs { SAME, more or {} } do
      evolution.same_files(t, name, folder .. "/whole", files)
    end
  end
  local broken = folder .. "/broken"
  limax.start(spec(5), { out = folder .. "/whole", say = evolution.silent }):finish()
  limax.start(spec(3), { out = broken, say = evolution.silent }):finish()
  local options = { out = broken, resume = true, changed = true, say = evolution.silent }
  check(broken, options)
  options.from = 1
  check(broken, options)
end

return evolution
