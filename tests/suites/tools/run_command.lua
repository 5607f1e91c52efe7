--- run_command.lua: the output of `limax run`: warnings also with -q, failures by reason, and the
--- colours of the stream that it writes to.

local evolution = require "support.evolution"
local host = require "limax.host"
local process = require "support.process"
local tally = require "limax.tools.console.tally"

local suite = require("limax.test").suite "limax run"

local EXPERIMENT = [[
local limax = require "limax"
return limax.experiment {
  name = "try", lattice = { 2, 2, 2 }, population = 20, generations = 3, repetitions = 1,
  simulation = { duration = 0.5, settle = 0.1, accuracy = "preview" }, supervisor = "fixed",
  fitness = function(robot)
    if robot.generation > 0 and robot.id % 20 == 0 then error "lame" end
    return robot:distance()
  end,
}
]]

local function run(t, ...)
  local folder = t:folder()
  assert(host.file.write_atomic(folder .. "/try.lua", EXPERIMENT))
  local done = process.completes(t, folder, { "run", "try.lua", "--out", "r", ... })
  return done, folder
end

suite:test("-q silences progress and summary, not warnings, and draws the champion", function(t)
  local loud = "scene.friction={\"static\":0.1,\"kinetic\":0.8}"
  local done, folder = run(t, "-q", "--set", loud)
  t:equal(done.stdout, "")
  -- a GPU may compile a kernel first
  local warnings = done.stderr:gsub("limax: compiled the kernel [^\n]*\n", "")
  t:equal(warnings, "! scene.friction: static 0.1 is below kinetic 0.8; the law is then plain "
    .. "Coulomb friction at 0.8\n! robot 40 of generation 1 gets no score: the fitness failed: "
    .. "try.lua:6: lame\n")
  t:equal(host.file.exists(folder .. "/r/champion.svg"), "file")
  done = run(t, "-q", "--set", "simulation.time_step=0.001")
  t:ok(done.stderr:find "^! simulation.time_step = 0.001 s is above the limit", done.stderr)
end)

suite:test("progress is not written into data files where standard streams are closed", function(t)
  local _, expected = run(t, "--set", "supervisor=rules")
  local folder = t:folder()
  assert(host.file.write_atomic(folder .. "/try.lua", EXPERIMENT))
  process.completes(t, folder, { "run", "try.lua", "--out", "r", "--set", "supervisor=rules" },
    { before = "exec <&- >&- 2>&-;" })
  evolution.same_files(t, folder .. "/r", expected .. "/r", { "r01/metrics.jsonl",
    "r01/ledger.jsonl", "scripts/try.lua", "r01/robots/g0000.npy", "r01/genomes/g0000.npy" })
  process.completes(t, folder, { "list", "--check", "r" })
end)

suite:test("the champion is the best of all generations where survival forgets it", function(t)
  local done, folder = run(t, "--set", "survival=generational", "--set", "generations=6",
    "--set", "seed=2")
  local best, generation = -math.huge, nil
  for line in io.lines(folder .. "/r/r01/metrics.jsonl") do
    local of_line = host.json.decode(line)
    if of_line.best > best then best, generation = of_line.best, of_line.generation end
  end
  t:ok(generation < 5, "the last generation is not the best one")
  t:ok(done.stdout:find(("champions/g%04d.json"):format(generation), 1, true), done.stdout)
end)

suite:test("a supervisor that always fails is in summary, metrics, compare and report",
  { limit = 60 }, function(t)
    local folder = t:folder()
    local failing = EXPERIMENT:gsub('supervisor = "fixed"',
      'supervisor = function() error "no idea" end'):gsub("fitness = .*", 'fitness = "walk" }')
    assert(host.file.write_atomic(folder .. "/mine.lua", failing))
    local done = process.completes(t, folder, { "run", "mine.lua", "--out", "r" })
    local loud = "FAILED IN EVERY GENERATION (2 of 2)"
    t:ok(done.stdout:find(loud, 1, true), done.stdout)
    t:ok(done.stderr:find(loud, 1, true), done.stderr)
    local text = process.read(folder .. "/r/r01/metrics.jsonl")
    local _, count = text:gsub('"supervisor_failed":true', "")
    t:equal(count, 2)
    process.completes(t, folder, { "run", "mine.lua", "-q", "--out", "b", "--set",
      "supervisor=fixed" })
    done = process.completes(t, folder, { "compare", "b", "r" })
    t:ok(done.stdout:find("mine.lua: THE SUPERVISOR " .. loud, 1, true), done.stdout)
    t:ok(done.stdout:find("no claim: the supervisor of mine.lua failed", 1, true), done.stdout)
    process.completes(t, folder, { "report", "r", "--no-robots" })
    t:ok(process.read(folder .. "/r/report.html"):find(loud, 1, true))
  end)

suite:test("resuming a finished run prints the command that extends it", { limit = 60 }, function(t)
  local _, folder = run(t, "-q")
  local done = process.completes(t, folder, { "run", "--resume", "r" })
  t:ok(done.stderr:find("is finished", 1, true), done.stderr)
  local words = done.stderr:match "limax (run %-%-resume [^\n]+)"
  t:equal(words, "run --resume r --changed --set generations=6")
  process.completes(t, folder, { "run", "--resume", "r", "--changed", "--set", "generations=6" })
  t:equal(select(2, process.read(folder .. "/r/r01/metrics.jsonl"):gsub("\n", "")), 6)
end)

suite:test("the text of a tally", function(t)
  local total = tally.new()
  local function last() return total:text():match "([^\n]*)\n$" end
  total:add { evaluations = 10, failed = { invalid = 0, diverged = 0, fitness = 0 } }
  t:equal(last(), "None of 10 robots failed.")
  total:add_warning "robot 2 of generation 0 gets no score: the fitness returned nan"
  total:add_warning "robot 3 of generation 0 gets no score: the fitness returned inf"
  total:add { evaluations = 10, failed = { invalid = 1, diverged = 0, fitness = 2 } }
  t:equal(last(), "3 of 20 robots failed: 2 by fitness (first: the fitness returned nan), "
    .. "1 invalid.")
  total:add_times { simulate = 6, fitness = 3, breed = 0.5, write = 0.5 }
  t:equal(total:time_text { fitness = { ["function"] = { file = "mine.lua", first_line = 12 } },
    selection = "rank" }, "Time 10 s: 60 % simulation, 30 % fitness (mine.lua:12), "
    .. "5 % selection and breeding.\n")
end)

return suite
