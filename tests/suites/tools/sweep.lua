--- sweep.lua: `limax sweep`: its grid, its runs, what it prints for a cluster, and that it goes on
--- without running anything twice.

local at_once = require "limax.tools.study.at_once"
local evolution = require "support.evolution"
local host = require "limax.host"
local process = require "support.process"
local reader = require "limax.run.reader"

local suite = require("limax.test").suite "sweep"

local function begin(t, generations)
  local folder = t:folder()
  evolution.script(folder .. "/try.lua", ("generations = %d"):format(generations or 2))
  return folder
end

local function sweep(t, folder, ...)
  return process.completes(t, folder, { "sweep", "--device", "cpu", ... })
end

-- How many processes computed each run of a sweep, by its path.
local function sessions(folder)
  local counts = {}
  for _, run in ipairs(host.json.decode(process.read(folder .. "/study.json")).runs) do
    local text = process.read(("%s/%s/journal.jsonl"):format(folder, run.path))
    counts[run.path] = select(2, text:gsub('"kind":"begin"', ""))
  end
  return counts
end

local function same_metrics(t, a, b, repetition)
  local place = ("/r%02d/metrics.jsonl"):format(repetition)
  t:ok(process.read(a .. place) ~= "", a)
  t:equal(process.read(a .. place), process.read(b .. place))
end

suite:test("every combination runs once, as limax run runs it; a sweep can be extended", function(t)
  local folder = begin(t)
  local rates, sizes = "breeding.mutation_rate=0.05,0.1", "lattice=[2,2,2],[2, 2, 3]"
  sweep(t, folder, "try.lua", "--out", "s", "--set", rates, "--set", sizes, "--repetitions", "2")
  local rate, size = "breeding.mutation_rate=0.1", "lattice=[2, 2, 3]"
  process.completes(t, folder, { "run", "try.lua", "-q", "--device", "cpu", "--out", "one",
    "--set", rate, "--set", size, "--set", "repetitions=2", "--repetition", "2" })
  same_metrics(t, folder .. "/one", folder .. "/s/mutation_rate=0.1,lattice=2,2,3/r02", 2)
  -- lattices cannot be compared; the report has an arm for each combination
  process.completes(t, folder, { "report", "s", "--no-robots" })
  local page = process.read(folder .. "/s/report.html")
  t:ok(page:find("mutation_rate=0.1, la", 1, true), "names of arms")

  local done = sweep(t, folder, "try.lua", "--out", "s", "--set", rates .. ",0.2", "--set", sizes,
    "--repetitions", "3")
  t:ok(done.stderr:find("^! limax compare cannot compare runs that differ in lattice[^\n]*;"
    .. " limax report shows them\n10 of 18 runs left"), done.stderr)
  t:ok(done.stdout:find "^all runs are done", done.stdout)
  local runs = 0
  for path, count in pairs(sessions(folder .. "/s")) do
    t:equal(count, 1, path)
    runs = runs + 1
  end
  t:equal(runs, 18)
  done = sweep(t, folder, "--resume", "s")
  t:equal(done.stderr, "")
end)

suite:test("seeds are repetitions of an arm, which compare reads", function(t)
  local folder = begin(t)
  sweep(t, folder, "try.lua", "--out", "s", "--set", "breeding.mutation_rate=0.05,0.1", "--set",
    "seed=1,2", "--quiet")
  process.fails(t, folder, 2, { "watch", "s" }, "it is a sweep or a study: name one of its runs")
  local done = process.completes(t, folder, { "compare", "s" })
  for _, rate in ipairs { "0.05", "0.1" } do
    t:ok(done.stdout:find(("\nmutation_rate=%s +2 "):format(rate)), done.stdout)
  end
end)

-- ---- going on -----------------------------------------------------------------------------------

-- Starts a sweep of four runs and stops it by a signal while some run is on its way.
local function stopped(t, signal)
  local folder = begin(t, 40)
  local child = process.start(folder, { "sweep", "try.lua", "--device", "cpu", "--out", "s",
    "--set", "seed=1,2,3,4", "--jobs", "2" })
  child:signal_when(signal, function()
    return #process.read(folder .. "/s/seed=2/r01/r01/metrics.jsonl") > 5000
  end)
  return folder, child:finish()
end

-- Goes on with the sweep by two processes at a time, and looks for work that was done twice.
local function continue(t, folder)
  local before = sessions(folder .. "/s")
  local other = process.start(folder, { "sweep", "--resume", "s", "--device", "cpu" })
  local done = sweep(t, folder, "--resume", "s")
  t:equal(other:finish(), 0)
  t:ok(done.stdout:find "^all runs" or done.stdout:find "other processes compute", done.stdout)
  for path, count in pairs(sessions(folder .. "/s")) do
    t:ok(count <= before[path] + 1, ("%s: %d processes"):format(path, count))
  end
  process.completes(t, folder, { "run", "try.lua", "-q", "--device", "cpu", "--out", "r", "--set",
    "seed=2" })
  same_metrics(t, folder .. "/r", folder .. "/s/seed=2/r01", 1)
end

suite:test("Ctrl-C ends the runs, and two sweeps go on where it stopped", function(t)
  local folder, status, output, seconds = stopped(t, "INT")
  t:equal(status, 130)
  t:ok(output:find "interrupted.*\ncontinue with: [^\n]* sweep %-%-resume s\n", output)
  t:ok(seconds < 3 + process.LATE, seconds)
  t:equal(reader.read(folder .. "/s/seed=2/r01").journal:state(), "stopped")
  continue(t, folder)
end)

suite:test("a killed sweep takes its runs with it, and goes on", function(t)
  local folder = stopped(t, "KILL")
  local began = host.clock()
  for _, seed in ipairs { 1, 2 } do
    while host.file.is_locked(("%s/s/seed=%d/r01/journal.jsonl"):format(folder, seed)) do
      t:ok(host.clock() - began < 6 + process.LATE, "a run goes on")
      host.wait(0.05)
    end
  end
  continue(t, folder)
end)

suite:test("a run that is done or in use is skipped; one that fails is reported", function(t)
  local folder = begin(t)
  sweep(t, folder, "try.lua", "--out", "s", "--set", "seed=1,2", "--list")
  local lock = assert(host.file.lock(folder .. "/s/.locks/1"))
  local done = sweep(t, folder, "--resume", "s", "--jobs", "1")
  t:ok(done.stderr:find("[1/2] seed=1/r01: in use by another process", 1, true), done.stderr)
  t:ok(done.stdout:find "^1 of 2 runs are done; other processes", done.stdout)
  done = sweep(t, folder, "--resume", "s", "--run", "2")
  t:equal(done.stderr, "run 2, s/seed=2/r01, is done\n")
  lock:free()
  assert(host.file.mkdir(folder .. "/s/seed=1/r01/mine"))
  done = process.ends(folder, { "sweep", "--resume", "s", "--device", "cpu" })
  t:equal(done.status, 1)
  t:ok(done.stderr:find "%[1/2%] seed=1/r01: FAILED with status 2\n.-limax: [^\n]*is used",
    done.stderr)
  t:ok(done.stderr:find "1 run failed\ncontinue with: ", done.stderr)
end)

-- ---- clusters -----------------------------------------------------------------------------------

suite:test("--slurm and --list print what computes the runs that are left", function(t)
  local folder = begin(t)
  local words = { "try.lua", "--out", "it's", "--set", "seed=1,2,3" }
  local lines = sweep(t, folder, "--list", unpack(words)).stdout
  t:equal(select(2, lines:gsub("\n", "")), 3)
  -- as GNU parallel does; the second one twice
  local second = lines:match "\n([^\n]+)\n"
  for _ = 1, 2 do t:equal(os.execute(second .. " -q >/dev/null 2>&1"), 0) end
  t:equal(sessions(folder .. "/it's")["seed=2/r01"], 1)

  local script = sweep(t, folder, "--slurm", "--threads", "2", unpack(words)).stdout
  t:ok(script:find("^#!/bin/sh\n#SBATCH"), script)
  t:ok(script:find("\n#SBATCH --array=1,3\n#SBATCH --cpus-per-task=2\n", 1, true), script)
  process.write(folder .. "/array.sh", script)
  for _, task in ipairs { 1, 3 } do
    t:equal(os.execute(("SLURM_ARRAY_TASK_ID=%d sh %s >/dev/null 2>&1"):format(task,
      process.quote(folder .. "/array.sh"))), 0)
  end
  local done = sweep(t, folder, "--slurm", unpack(words))
  t:equal(done.stdout .. done.stderr, "all runs are done\n")
  for _, option in ipairs { "--slurm", "--list" } do
    process.fails(t, folder, 2, { "sweep", "try.lua", "--out", 'a"\ntouch x', "--set",
      "seed=1,2", option }, "need a folder without control characters")
  end
end)

suite:test("runs at a time share the GPUs", function(t)
  for expected, case in pairs { ["0,3 1 2"] = { 3, 4 }, ["0 1 0 1 0"] = { 5, 2 },
    ["0 1"] = { 2, 2 }, ["0,1,2"] = { 1, 3 } } do
    local places, gpus, shares = case[1], {}, {}
    for k = 1, case[2] do gpus[k] = tostring(k - 1) end
    for place = 1, places do shares[place] = at_once.share(place, places, gpus) end
    t:equal(table.concat(shares, " "), expected)
  end
end)

-- ---- bad input ----------------------------------------------------------------------------------

suite:test("bad input ends with one message before anything is written", function(t)
  local folder = begin(t)
  local rate = "breeding.mutation_rate"
  for expected, words in pairs {
    [rate .. ": expected a number from 0 to 1 (per gene), got 2"] = { "--set", rate .. "=0.1,2" },
    ["--set seed: expected PATH=VALUE,VALUE"] = { "--set", "seed" },
    ["a value is missing; expected PATH=VALUE,VALUE"] = { "--set", "seed=1,,2" },
    ["a bracket, brace or quotation mark has no counterpart"] = { "--set", "lattice=[2,2" },
    ["are the same, or only differ in"] = { "--set", rate .. "=0.1,0.10" },
    ["--set repetitions: its number is that of --repetitions N"] = { "--set", "repetitions=3" },
    ["expected --out DIR"] = {},
    ["--run belongs to --resume"] = { "--run", "1" },
  } do
    if expected ~= "expected --out DIR" then words = { "--out", "s", unpack(words) } end
    local done = process.fails(t, folder, 2, { "sweep", "try.lua", unpack(words) }, expected)
    t:ok(not done.stderr:find "\n.", done.stderr)
    t:equal(host.file.exists(folder .. "/s"), nil)
  end
end)

suite:test("values that the supervisor would change are refused", function(t)
  local folder = begin(t)
  local rate, scale = "breeding.mutation_rate=0.1,0.2", "breeding.mutation_scale=0.1,0.2"
  local function planned(...)
    return process.ends(folder, { "sweep", "try.lua", "--out", "s", "--list", "--set", ... })
  end
  for _, case in ipairs {
    { rate, "supervisor=rules" }, { "supervisor=fixed,rules", rate }, { rate, "supervisor=random" },
    { "materials.bone.stiffness=300,400", "supervisor=random", "supervision.materials=true" },
  } do
    local done = planned(case[1], "--set", case[2], case[3] and "--set", case[3])
    t:equal(done.status, 2)
    t:ok(done.stderr:find("changes it from generation to generation", 1, true)
      and done.stderr:find("add --set supervisor=fixed", 1, true), done.stderr)
    t:equal(host.file.exists(folder .. "/s"), nil)
  end
  evolution.script(folder .. "/try.lua", 'supervisor = { "schedule", mutation_rate = {{0, 0.5}} }')
  t:equal(planned(rate).status, 2)
  t:equal(planned(scale).status, 0)
  -- what other supervisors leave alone
  for k, case in ipairs {
    { "breeding.crossover_rate=0.1,0.2", "supervisor=rules" }, { rate, "supervisor=one_fifth" },
    { rate, "supervisor=rules", "--set", "supervision.hyperparameters=false" },
    { "materials.bone.stiffness=300,400", "supervisor=random" },
  } do
    local done = process.ends(folder, { "sweep", "try.lua", "--out", "s" .. k, "--list", "--set",
      case[1], "--set", unpack(case, 2) })
    t:equal({ done.status, (done.stderr:gsub("^! limax compare [^\n]*\n", "")) }, { 0, "" })
  end
end)

suite:test("a sweep with other lists or another script is refused", function(t)
  local folder = begin(t)
  sweep(t, folder, "try.lua", "--out", "s", "--set", "seed=1,2", "--list")
  process.completes(t, folder, { "run", "try.lua", "-q", "--device", "cpu", "--out", "r" })
  local function refused(expected, ...)
    process.fails(t, folder, 2, { "sweep", "--device", "cpu", ... }, expected)
  end
  refused("holds another sweep, with seed=1/r01 (seed=1)", "try.lua", "--out", "s", "--set",
    "seed=2,3")
  refused("there is no study.json", "--resume", "nothing")
  refused("r is a run folder; name another --out", "try.lua", "--out", "r")
  refused("--run 3: the sweep has 2 runs", "--resume", "s", "--run", "3")
  process.write(folder .. "/try.lua", process.read(folder .. "/try.lua") .. "-- changed\n")
  for _, words in ipairs { { "--resume", "s" }, { "--resume", "s", "--run", "1" },
    { "try.lua", "--out", "s", "--set", "seed=1,2" } } do
    refused("has changed since the sweep in", unpack(words))
  end
end)
