--- experiments.lua: every file of scripts/experiments runs, reduced to two generations of a few
--- robots.

local evolution = require "support.evolution"
local host = require "limax.host"
local process = require "support.process"
local source = require "limax.base.source"

local suite = require("limax.test").suite "experiments"

local FOLDER = host.home .. "/scripts/experiments"

-- Arguments of scripts with a loop of their own; the others return an experiment.
local WORDS = {
  ["by_hand.lua"] = {}, ["own_forces.lua"] = {},
  -- generations, robots, seconds
  ["multi_fidelity.lua"] = { "2", "6", "0.3" },
  -- a minute
  ["supervision_study.lua"] = { "--quick" },
}
local TAGS = { ["supervision_study.lua"] = "full" }

-- Overrides that reduce an experiment, and replace a supervisor that needs an endpoint.
local SMALL = { "generations=2", "repetitions=1", "population=8", "simulation.duration=0.4",
  "simulation.settle=0.1" }
local CHANGED = { ["islands.lua"] = { "islands.count=2" },
  ["supervised.lua"] = { "supervisor=rules" },
  ["paper.lua"] = { "simulation.time_step=0.0002" } }

local function run_of(name)
  local words = { "run", FOLDER .. "/" .. name, "--out", "run", "-q" }
  for _, changes in ipairs { SMALL, CHANGED[name] or {} } do
    for _, change in ipairs(changes) do
      words[#words + 1] = "--set"
      words[#words + 1] = change
    end
  end
  return words
end

for _, name in ipairs(host.file.list(FOLDER)) do
  suite:test(name, { tags = TAGS[name] }, function(t)
    local folder, own = t:folder(), WORDS[name]
    local words = own and { FOLDER .. "/" .. name, unpack(own) } or run_of(name)
    local done = process.completes(t, folder, words)
    if own then
      t:ok(#done.stdout > 0)
      return
    end
    t:ok(not done.stderr:find "variables of a script", done.stderr)
    local lines = 0
    for line in source.read(folder .. "/run/r01/metrics.jsonl"):gmatch "[^\n]+" do
      lines = lines + 1
      local generation = host.json.decode(line, "r01/metrics.jsonl")
      t:equal({ generation.generation, generation.scored > 0 }, { lines - 1, true })
    end
    t:equal(lines, 2)
    t:equal(evolution.state(folder .. "/run"), "done")
  end)
end
