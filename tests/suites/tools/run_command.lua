--- run_command.lua: the output of `limax run`, with -q, after failures and without streams; and of
--- `limax watch`.

local evolution = require "support.evolution"
local host = require "limax.host"
local process = require "support.process"
local progress = require "limax.tools.console.progress"
local reader = require "limax.run.reader"
local trial = require "support.trial"

local suite = require("limax.test").suite "limax run"

local LAME = [[population = 20, simulation = { duration = 0.5, settle = 0.1,
    accuracy = "preview" }, fitness = function(robot)
    if robot.generation > 0 and robot.id % 20 == 0 then error "lame" end
    return robot:distance()
  end]]

local function run(t, ...)
  local folder = t:folder()
  evolution.script(folder .. "/try.lua", LAME)
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
    .. "try.lua:7: lame\n")
  t:equal(host.file.exists(folder .. "/r/champion.svg"), "file")
  done = run(t, "-q", "--set", "simulation.time_step=0.001")
  t:ok(done.stderr:find "^! simulation.time_step = 0.001 s is above the limit", done.stderr)
end)

suite:test("progress is not written into data files where standard streams are closed", function(t)
  local _, expected = run(t, "--set", "supervisor=rules")
  local folder = t:folder()
  evolution.script(folder .. "/try.lua", LAME)
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

suite:test("a supervisor that always fails is in summary, metrics, compare and report", function(t)
  local folder = t:folder()
  evolution.script(folder .. "/mine.lua", 'supervisor = function() error "no idea" end')
  local done = process.completes(t, folder, { "run", "mine.lua", "--out", "r" })
  local loud = "FAILED IN EVERY GENERATION (2 of 2)"
  trial.contains(t, done.stdout, loud)
  trial.contains(t, done.stderr, loud)
  local text = process.read(folder .. "/r/r01/metrics.jsonl")
  t:equal(select(2, text:gsub('"supervisor_failed":true', "")), 2)
  process.completes(t, folder, { "run", "mine.lua", "-q", "--out", "b", "--set",
    "supervisor=fixed" })
  done = process.completes(t, folder, { "compare", "b", "r" })
  trial.contains(t, done.stdout, "mine.lua: THE SUPERVISOR " .. loud,
    "no claim: the supervisor of mine.lua failed")
  process.completes(t, folder, { "report", "r", "--no-robots" })
  t:ok(process.read(folder .. "/r/report.html"):find(loud, 1, true))
end)

suite:test("the first line names the supervisor", function(t)
  for name, expected in pairs { rules = "rules", fixed = "fixed" } do
    local done = run(t, "--set", "supervisor=" .. name, "--set", "generations=1")
    t:ok(done.stderr:find(("^[^\n]* robots, supervisor %s, on "):format(expected)), done.stderr)
  end
end)

suite:test("without a terminal a long generation has a line every 10 s", function(t)
  local written = {}
  local shown = progress.new { total = 4, repetitions = 1,
    write = function(text) written[#written + 1] = text end }
  shown.bar = false
  local state = { steps = 0.25, steps_total = 1, done = 7, robots = 30, time = 1250,
    duration = 5000, spring_rate = 1e8 }
  shown:robots(state)
  t:equal(written, {})
  shown.began, shown.written = shown.began - 100, shown.written - 10
  shown:robots(state)
  shown:robots(state)
  t:equal(written, { "generation 1/4  25 min 0 s left  7 of 30 simulations done, 1250 of 5000 s "
    .. "on average\n" })
end)

suite:test("resuming a finished run prints the command that extends it", function(t)
  local _, folder = run(t, "-q")
  local done = process.completes(t, folder, { "run", "--resume", "r" })
  t:ok(done.stderr:find("is finished", 1, true), done.stderr)
  local words = done.stderr:match "limax (run %-%-resume [^\n]+)"
  t:equal(words, "run --resume r --changed --set generations=6")
  process.completes(t, folder, { "run", "--resume", "r", "--changed", "--set", "generations=6" })
  t:equal(select(2, process.read(folder .. "/r/r01/metrics.jsonl"):gsub("\n", "")), 6)
end)

-- ---- watch --------------------------------------------------------------------------------------

-- The hashes of all files of a folder.
local function hashes(folder)
  return process.output(("cd %s && find . -type f -exec sha256sum {} + | sort"):format(
    process.quote(folder)))
end

suite:test("curves and the best are printed, and no file is changed", function(t)
  local base = t:folder()
  evolution.script(base .. "/twice.lua", "repetitions = 2")
  process.completes(t, base, { "run", "twice.lua", "-q", "--out", "r" })
  local before = hashes(base .. "/r")
  -- as the run itself locks it
  local lock = assert(host.file.lock(base .. "/r/journal.jsonl"))
  local done = process.ends(base, { "watch", "r" }, { before = "export TERM=dumb;" })
  lock:free()
  t:ok(done.status == 0, done.stderr)
  t:equal(hashes(base .. "/r"), before)
  local best = -math.huge
  for repetition = 1, 2 do
    best = math.max(best, reader.read(base .. "/r"):lines("metrics", repetition)[3].best)
  end
  trial.contains(t, done.stdout, "running   generation 6 of 6", ("best %.4g"):format(best),
    "fitness (m), the median of 2 repetitions", "** best   oo mean", "lowest layer first")
  t:ok(not done.stdout:find "[\128-\255\27]", "ASCII where the terminal is dumb")
end)

suite:test("a run without a generation, and a folder that is not a run", function(t)
  local base = t:folder()
  evolution.run(base .. "/r")
  local path = base .. "/r/journal.jsonl"
  process.write(path, process.read(path):match "^[^\n]*\n")
  local done = process.ends(base, { "watch", "r" })
  t:equal(done.status, 0)
  t:ok(done.stdout:find("no generation has been scored yet", 1, true), done.stdout)
  process.fails(t, base, 1, { "report", "r" }, "nothing to report")
  process.fails(t, base, 2, { "watch", "nothing" }, "nothing is not a run folder")
  process.fails(t, base, 2, { "run", "r" }, "run --resume r")
end)
