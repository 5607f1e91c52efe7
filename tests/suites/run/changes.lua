--- changes.lua: a run that `--changed` continues with other fields that decide what a score means
--- is marked wherever it is shown, and not compared.

local evolution = require "support.evolution"
local forged = require "support.forged"
local process = require "support.process"
local reader = require "limax.run.reader"
local changes = require "limax.run.changes"
local trial = require "support.trial"

local suite = require("limax.test").suite "changes"

local completes, contains = process.completes, trial.contains

-- Continues the run r, with words like "generations=4".
local function continue(t, folder, ...)
  local words = { "run", "--resume", "r", "--changed" }
  for _, change in ipairs { ... } do
    words[#words + 1], words[#words + 2] = "--set", change
  end
  return completes(t, folder, words)
end

local function changes_of(folder, repetition) return changes.of(reader.read(folder), repetition) end

suite:test("another duration and fitness are marked, and refused by compare", function(t)
  local folder = t:folder()
  evolution.script(folder .. "/try.lua", "generations = 2")
  completes(t, folder, { "run", "try.lua", "-q", "--out", "pure", "--set", "seed=2" })
  completes(t, folder, { "run", "try.lua", "-q", "--out", "r" })
  -- these change no score
  local done = continue(t, folder, "generations=3", "name=other", "selection=rank")
  for _, shown in ipairs { done.stdout, done.stderr, completes(t, folder, { "list", "." }).stdout,
    completes(t, folder, { "watch", "--once", "r" }).stdout } do
    t:ok(not shown:find "cannot be compared" and not shown:find "from generation", shown)
  end
  t:equal(changes_of(folder .. "/r", 1), {})

  -- the run is complete: the configuration in force has no generation
  done = continue(t, folder, "fitness=height")
  contains(t, done.stderr, "cannot be compared, since fitness changed")
  t:equal(changes_of(folder .. "/r", 1), { { generation = 3, fields = { "fitness" } } })
  done = continue(t, folder, "generations=5", "simulation.duration=0.2",
    "simulation.accuracy=evolve")
  local text = "fitness, simulation.accuracy, simulation.duration from generation 3 on"
  contains(t, done.stdout, text, "generation 0, before the change", " 3 on\n")
  contains(t, completes(t, folder, { "list", "." }).stdout, text)
  contains(t, completes(t, folder, { "watch", "--once", "r" }).stdout, text)
  completes(t, folder, { "report", "r", "--out", "r.html" })
  -- the line is in every curve of the page
  contains(t, process.read(folder .. "/r.html"), text, ">fitness, simulation.a")
  for _, words in ipairs { { "compare", "pure", "r" }, { "compare", "r" } } do
    process.fails(t, folder, 2, words, "r: repetition 1", text)
  end

  -- a cut that removes all generations after the change removes its mark
  completes(t, folder, { "run", "--resume", "r", "-q", "--changed", "--from", "1", "--set",
    "fitness=distance", "--set", "simulation.duration=0.1", "--set",
    "simulation.accuracy=preview" })
  t:equal(changes_of(folder .. "/r", 1), {})
end)

suite:test("a function counts by its text, not by its place", function(t)
  local folder = t:folder()
  local function write(lines, factor)
    evolution.script(folder .. "/try.lua", ("%sgenerations = 2,\n"
      .. "fitness = function(robot) return %d * robot:distance() end"):format(lines, factor))
  end
  write("", 1)
  completes(t, folder, { "run", "try.lua", "-q", "--out", "r" })
  write("\n\n", 1)
  continue(t, folder, "generations=3")
  t:equal(changes_of(folder .. "/r", 1), {})
  write("\n\n", 2)
  continue(t, folder, "generations=4")
  t:equal(changes_of(folder .. "/r", 1), { { generation = 3, fields = { "fitness.function" } } })
end)

suite:test("a former configuration of a foreign folder is checked before it is shown", function(t)
  local folder = t:folder()
  evolution.script(folder .. "/try.lua", "generations = 2")
  completes(t, folder, { "run", "try.lua", "-q", "--out", "r" })
  continue(t, folder, "generations=3", "simulation.duration=0.2")
  forged.object(folder .. "/r", "config.json", function(config)
    config.scene["a\27[31m"] = 1
  end)
  local listed = completes(t, folder, { "list", "." }).stdout
  contains(t, listed, "scene.a\\u001b[31m, simulation.duration from generation 2 on")
  t:ok(not listed:find "\27")
  forged.object(folder .. "/r", "config.json", function(config) config.fitness = 7 end)
  contains(t, process.ends(folder, { "list", "." }).stderr, "r/config.json: fitness: ")
  process.write(folder .. "/r/config.json", process.read(folder .. "/r/config.json") .. " ")
  contains(t, process.ends(folder, { "list", "." }).stderr,
    "r/config.json does not match its hash in journal.jsonl")
end)
