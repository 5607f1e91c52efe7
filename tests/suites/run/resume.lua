--- resume.lua: a run gives the same bytes under all conditions: another number of threads, one
--- repetition only, SIGINT and SIGKILL at random moments, a resume with and without changes.

local check = require "limax.run.check"
local engine = require "limax.engine"
local evolution = require "support.evolution"
local host = require "limax.host"
local process = require "support.process"
local reader = require "limax.run.reader"
local source = require "limax.base.source"
local whole_runs = require "support.whole_runs"

local suite = require("limax.test").suite "resume"

local function write_experiment(folder, generations, repetitions)
  process.write(folder .. "/tiny.lua", whole_runs.experiment(generations, repetitions))
end

local run, completes = process.ends, process.completes
local files, same_run = whole_runs.files, whole_runs.same

local function state_of(folder) return (reader.read(folder).journal:state()) end

-- A killed process leaves all that its journal names, and files that grow are at any moment a
-- prefix of their final bytes.
local function check_whole(t, folder, whole)
  if not reader.is_run(folder) then return end
  t:equal(check.folder(reader.read(folder)), {})
  for _, path in ipairs(files(folder)) do
    local text = path:find "%.jsonl$" and source.read(folder .. path)
    local final = text and source.read(whole .. path)
    if text then t:ok(final:sub(1, #text) == text, path .. " is no prefix of its final bytes") end
    t:ok(not path:find "%.part$" or path:find "/%.", "a temporary file is not hidden: " .. path)
  end
end

suite:test("threads, and repetitions together or only one, change no byte", function(t)
  local folder = t:folder()
  write_experiment(folder, 4, 4)
  completes(t, folder, { "run", "tiny.lua", "-q", "--out", "apart", "--apart", "--threads", "1" })
  local done = completes(t, folder,
    { "run", "tiny.lua", "--out", "together", "--together", "--threads", "3" })
  t:ok(done.stderr:find("repetitions 1 to 4 together", 1, true), done.stderr)
  same_run(t, folder .. "/together", folder .. "/apart")
  -- the second repetition begins before the first ends
  local first, second = done.stderr:find "repetition 1  generation 3",
    done.stderr:find "repetition 2  generation 0"
  t:ok(second < first, done.stderr)

  completes(t, folder, { "run", "tiny.lua", "-q", "--repetition", "2", "--out", "only" })
  t:equal(files(folder .. "/only", "/r02"), files(folder .. "/apart", "/r02"))
  for _, path in ipairs(files(folder .. "/only", "/r02")) do
    t:ok(source.read(folder .. "/only" .. path) == source.read(folder .. "/apart" .. path), path)
  end
  t:ok(not host.file.exists(folder .. "/only/r01"))
end)

-- Ends runs by a signal at random moments, and resumes them each time, until `kills` signals have
-- hit. On the CPU, which is ready at once.
local function survives(t, signal, kills)
  local folder = t:folder()
  write_experiment(folder, 20, 2)
  local ways = { "--together", "--apart" }
  -- moments are shares of the time of a whole run, which adapts to the load of the machine
  local began = host.clock()
  completes(t, folder, { "run", "tiny.lua", "-q", "--device", "cpu", "--out", "whole" })
  local seconds = host.clock() - began
  local random = engine.random(7, 1, "user", signal == "INT" and 1 or 2, 1)
  local hit, attempt, size = 0, 0, 0
  while hit < kills do
    attempt = attempt + 1
    local name, done = "broken" .. attempt, nil
    local path = folder .. "/" .. name
    repeat
      local begun = host.file.exists(path .. "/config.json")
      if not begun and host.file.exists(path) then break end -- killed before it was a run
      local words = begun and { "--resume", name } or { "tiny.lua", "--out", name }
      done = run(folder, { "run", "-q", "--device", "cpu", ways[random:integer(2)], unpack(words) },
        { signal = signal, after = seconds * (0.1 + 0.35 * random:uniform()) })
      local grown = #(source.read(path .. "/journal.jsonl") or "")
      seconds = seconds * (done.status == 0 and 0.8 or grown == size and 1.3 or 1)
      size = grown
      if done.status ~= 0 then
        t:equal(done.status, signal == "INT" and 130 or 137)
        hit = hit + 1
        check_whole(t, path, folder .. "/whole")
        if reader.is_run(path) then
          -- a signal may come when all is done
          local state = state_of(path)
          t:ok(state == "stopped" or state == "done", state)
          t:ok(signal ~= "INT" or done.stderr:find("limax run --resume " .. name, 1, true),
            done.stderr)
        end
      end
    until done.status == 0
    if done and done.status == 0 then same_run(t, path, folder .. "/whole") end
  end
  t:note(("%d signals in %d runs"):format(hit, attempt))
end

for _, signal in ipairs { "INT", "KILL" } do
  suite:test(("SIG%s at random moments changes no byte"):format(signal),
    function(t) survives(t, signal, 6) end)
end

suite:test("a killed run is stopped, and not running, for every command", function(t)
  local folder = t:folder()
  evolution.script(folder .. "/hangs.lua", [[fitness = function(robot)
    if robot.generation == 1 then
      io.stderr:write "ready\n"
      require("limax.host").wait(3600)
    end
    return robot:distance()
  end]])
  local child = process.start(folder, { "run", "hangs.lua", "-q", "--out", "r" })
  child:wait_for "ready"
  for _, state in ipairs { "running", "stopped" } do
    for _, words in ipairs { { "list", "r" }, { "watch", "--once", "r" } } do
      local shown = completes(t, folder, words).stdout
      t:equal({ shown:find "running" ~= nil, shown:find "stopped" ~= nil },
        { state == "running", state == "stopped" })
    end
    if state == "running" then
      child:signal "KILL"
      child:finish()
    end
  end
end)

suite:test("a run that keeps the best robots goes on from its newest generations", function(t)
  local folder = t:folder()
  evolution.script(folder .. "/best.lua", [[generations = 6, supervisor = function(history)
    local old = history[math.max(1, #history - 2)].population
    return { mutation_scale = 0.1 + 0.01 * old[2].genome[3] }
  end]])
  completes(t, folder, { "run", "best.lua", "-q", "--out", "all" })
  completes(t, folder, { "run", "best.lua", "-q", "--out", "best", "--set", "generations=3",
    "--set", "record.population=best" })
  completes(t, folder, { "run", "--resume", "best", "-q", "--changed", "--set", "generations=6" })
  completes(t, folder, { "list", "--check", "best" })
  local place = folder .. "/best/r01/"
  t:ok(source.read(place .. "metrics.jsonl") == source.read(folder .. "/all/r01/metrics.jsonl"))
  for _, name in ipairs { "robots", "genomes" } do
    t:equal(host.file.list(place .. name), { "g0003.npy", "g0004.npy", "g0005.npy" })
  end
  t:equal(#host.file.list(place .. "champions"), 6)
  process.fails(t, folder, 2, { "run", "--resume", "best", "--from", "4" },
    'record.population = "best" keeps')
  assert(host.file.remove(place .. "genomes/g0004.npy"))
  t:ok(run(folder, { "list", "--check", "best" }).stdout:find "g0004.npy is missing")
end)

-- The device fails where its script asks for it: in generation 1 of the first repetition, or in
-- what the fitness simulates.
local BROKEN = [[
local limax, engine = require "limax", require "limax.engine"
local real, together = engine.simulation, engine.advance_together
local function fail()
  local text = "simulation:advance: CUDA: cuLaunchKernel failed: CUDA_ERROR_ILLEGAL_ADDRESS"
  require("limax.engine.fault").throw { kind = "device", text = text }
end
engine.advance_together = function(...)
  if engine.breaks == "generation" then fail() end
  return together(...)
end
engine.simulation = function(...)
  local simulation = real(...)
  if engine.breaks == "fitness" then rawset(simulation, "advance", fail) end
  return simulation
end
return limax.experiment { name = "own", lattice = { 2, 2, 2 }, population = 6, generations = 6,
  repetitions = 2, simulation = { duration = 0.5, settle = 0, accuracy = "preview" },
  supervisor = "fixed", genome = { require_muscle = false },
  fitness = function(robot)
    if robot.generation == 1 then
      require("limax.engine").breaks = os.getenv "LIMAX_TEST_BREAK"
      if os.getenv "LIMAX_TEST_BREAK" == "fitness" then robot:simulate { duration = 0.1 } end
    end
    return robot:distance()
  end }
]]

suite:test("a device that fails leaves whole generations and the command to continue", function(t)
  local folder = t:folder()
  process.write(folder .. "/own.lua", BROKEN)
  completes(t, folder, { "run", "own.lua", "-q", "--out", "whole" })
  for _, place in ipairs { "generation", "fitness" } do
    local done = run(folder, { "run", "own.lua", "-q", "--out", place, "--together" },
      { before = "LIMAX_TEST_BREAK=" .. place })
    t:equal(done.status, 1)
    -- no traceback: neither the script nor its fitness is at fault
    t:ok(done.stderr:find("^limax: simulation:advance: CUDA: [^\n]*_ILLEGAL_ADDRESS\n"
      .. "continue with: [^\n]*limax run %-%-resume " .. place .. "\n$"), done.stderr)
    local read = reader.read(folder .. "/" .. place)
    local state, message = read.journal:state()
    t:equal({ state, check.folder(read) }, { "failed", {} })
    t:ok(message:find("CUDA_ERROR_ILLEGAL_ADDRESS", 1, true), message)
    completes(t, folder, { "run", "--resume", place, "-q" })
    same_run(t, folder .. "/" .. place, folder .. "/whole")
  end
end)

suite:test("a changed script or configuration is refused with the difference", function(t)
  local folder = t:folder()
  write_experiment(folder, 4, 1)
  completes(t, folder, { "run", "tiny.lua", "-q", "--out", "r", "--set", "generations=2" })
  local path = folder .. "/tiny.lua"
  local text = source.read(path)
  text = text:gsub('selection = "rank"', 'selection = "roulette"')
  process.write(path, text)
  local refused = process.fails(t, folder, 2, { "run", "--resume", "r", "-q" }, "--changed")
  t:ok(refused.stderr:find("tiny.lua has changed: the run has r/scripts/tiny.lua", 1, true))
  local before = source.read(folder .. "/r/r01/metrics.jsonl")

  local continued =
    completes(t, folder, { "run", "--resume", "r", "--changed", "--set", "generations=3" })
  t:ok(continued.stderr:find "continuing with what has changed", continued.stderr)
  local after = source.read(folder .. "/r/r01/metrics.jsonl")
  t:equal(after:sub(1, #before), before)
  t:ok(#after > #before)
  t:ok(host.file.exists(folder .. "/r/config-2.json"))
  t:ok(source.read(folder .. "/r/scripts/tiny.lua"):find '"rank"')
  t:ok(source.read(folder .. "/r/scripts-2/tiny.lua"):find '"roulette"')
  -- a finished run has nothing left to do
  completes(t, folder, { "run", "--resume", "r", "-q" })
  t:equal(source.read(folder .. "/r/r01/metrics.jsonl"), after)
  t:equal(state_of(folder .. "/r"), "done")
end)

suite:test("a locked folder, and fields that can never change, are refused", function(t)
  local folder = t:folder()
  write_experiment(folder, 2, 1)
  completes(t, folder, { "run", "tiny.lua", "-q", "--out", "r" })
  for _, change in ipairs { "seed=2", "lattice.1=4", "population=8", "genome.sigma=2",
    "islands.count=2" } do
    process.fails(t, folder, 2, { "run", "--resume", "r", "--changed", "--set", change },
      "cannot be continued with another")
  end
  local handle = t:ok(host.file.lock(folder .. "/r/journal.jsonl"))
  process.fails(t, folder, 1, { "run", "--resume", "r" }, "in use by another process")
  handle:free()
end)

suite:test("a run continues with the copy of a script that is gone", function(t)
  local folder = t:folder()
  write_experiment(folder, 4, 1)
  completes(t, folder, { "run", "tiny.lua", "-q", "--out", "whole" })
  completes(t, folder, { "run", "tiny.lua", "-q", "--out", "r", "--set", "generations=2" })
  host.file.remove(folder .. "/tiny.lua")
  local words = { "run", "--resume", "r", "--changed", "--set", "generations=4" }
  local continued = completes(t, folder, words)
  t:ok(continued.stderr:find "is gone; continuing with the copy", continued.stderr)
  t:ok(source.read(folder .. "/r/r01/metrics.jsonl")
    == source.read(folder .. "/whole/r01/metrics.jsonl"))
  -- the copy is now the script's path
  words[6] = "generations=5"
  completes(t, folder, words)
end)

-- An own loop that ends with an error in generation `arg[2]`, before that is bred. Its fitness
-- reads a trace, and its elites are chosen by a measure. Fitness and loop write to the state.
local OWN_LOOP = [[
local limax = require "limax"
local experiment = limax.experiment {
  name = "own", lattice = { 2, 2, 2 }, population = 8, generations = 6, repetitions = 1,
  simulation = { duration = 0.3, settle = 0.1 }, record = { center_of_mass = 20 },
  state = function() return { scored = 0, rising = 0 } end,
  fitness = function(robot, state)
    local path = robot:trace "center_of_mass"
    state.scored = state.scored + 1
    return robot:distance() + 1e-6 * state.rising, { rise = path[path:size()][3] }
  end,
}
for robots in limax.start(experiment, { out = arg[1], resume = true }):generations() do
  robots:simulate():score()
  if robots.generation == tonumber(arg[2]) then error "enough" end
  local best, rising = robots.ranked, robots.ranked[1]
  for _, i in ipairs(best) do
    if robots[i].measures.rise > robots[rising].measures.rise then rising = i end
  end
  local pairs_of_indices, state = {}, robots.state
  state.rising = state.rising + rising + state.scored
  for child = 1, 6 do pairs_of_indices[child] = { rising, best[child % #best + 1] } end
  local other = best[1] == rising and best[2] or best[1]
  robots:breed { parents = pairs_of_indices, elites = { rising, other }, mutation_rate = 0.2 }
end
]]

suite:test("an own loop continues where it was stopped", function(t)
  local folder = t:folder()
  local script = folder .. "/own.lua"
  process.write(script, OWN_LOOP)
  completes(t, folder, { "own.lua", "whole" })
  for _, stop in ipairs { 0, 2, 4 } do
    local done = run(folder, { "own.lua", "parts", tostring(stop) })
    t:ok(done.stderr:find("enough", 1, true), done.stderr)
  end
  completes(t, folder, { "own.lua", "parts" })
  same_run(t, folder .. "/parts", folder .. "/whole")
  t:equal(state_of(folder .. "/parts"), "done")
  process.fails(t, folder, 2, { "run", "--resume", "parts" }, "limax own.lua\nwith limax.start(")
  -- a finished run stays as it is
  completes(t, folder, { "own.lua", "parts" })
  same_run(t, folder .. "/parts", folder .. "/whole")

  local changed = OWN_LOOP:gsub("mutation_rate = 0.2", "mutation_rate = 0.1")
  process.write(script, changed)
  process.fails(t, folder, 2, { "own.lua", "parts" }, "changed = true continues with the new one")
  process.write(script, (changed:gsub("resume = true", "%0, changed = true")))
  completes(t, folder, { "own.lua", "parts" })
  t:ok(host.file.exists(folder .. "/parts/scripts-2"))
end)
