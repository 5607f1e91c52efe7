--- ranks.lua: one run on several ranks of mpirun gives the bytes of the plain command, wherever it
--- was interrupted, and ends with a reason where ranks compute different things.

local division = require "limax.evolution.division"
local engine = require "limax.engine"
local evolution = require "support.evolution"
local exchange = require "limax.base.exchange"
local faulty_server = require "support.faulty_server"
local host = require "limax.host"
local process = require "support.process"
local whole_runs = require "support.whole_runs"

local suite = require("limax.test").suite "ranks"

local MPIRUN = "OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 mpirun -n %d"
  .. " --oversubscribe"

-- Runs limax on so many ranks; 0 is the plain command.
local function on(ranks, folder, ...)
  return process.ends(folder, { ... }, { before = ranks > 0 and MPIRUN:format(ranks) or nil })
end

local function completes(ranks, t, folder, ...)
  local done = on(ranks, folder, ...)
  t:ok(done.status == 0, ("%d ranks: status %s\n%s"):format(ranks, tostring(done.status),
    done.stderr))
  return done
end

local available

local function test(name, body)
  suite:test(name, function(t)
    local folder = t:folder()
    if available == nil then
      process.write(folder .. "/count.lua", 'print("ranks", require("limax.base.ranks").count)')
      local done = on(2, folder, "count.lua")
      available = done.stdout:find "ranks\t2" ~= nil
    end
    if not available then t:skip "there is no mpirun here, or limax was built without MPI" end
    body(t, folder)
  end)
end

local function write_experiment(folder, generations)
  process.write(folder .. "/tiny.lua", whole_runs.experiment(generations, 2))
end

local same = whole_runs.same

-- What a run says, without kernels that a GPU's first run compiles.
local function warnings(done)
  return (done.stderr:gsub("limax: compiled the kernel[^\n]*\n", ""))
end

test("any number of ranks gives the same bytes, also after a resume", function(t, folder)
  write_experiment(folder, 12)
  local plain = completes(0, t, folder, "run", "tiny.lua", "-q", "--out", "0")
  for _, ranks in ipairs { 2, 3, 6 } do
    local done = completes(ranks, t, folder, "run", "tiny.lua", "-q", "--out", tostring(ranks))
    same(t, ("%s/%d"):format(folder, ranks), folder .. "/0")
    t:equal(process.read(("%s/%d/config.json"):format(folder, ranks)),
      process.read(folder .. "/0/config.json"))
    t:equal(warnings(done), warnings(plain)) -- each once
  end
  for name, ranks in pairs { ["2"] = 3, ["3"] = 0, ["0"] = 2 } do
    completes(ranks, t, folder, "run", "--resume", name, "--from", "5", "-q")
    same(t, folder .. "/" .. name, folder .. "/6")
  end
end)

suite:test("each robot is of one rank, and each island where all get as many", function(t)
  local random = engine.random(11, 1, "user", 1, 1)
  local before = exchange.count
  for _ = 1, 300 do
    exchange.count = random:integer(7)
    local islands, size, elites, homes = random:integer(20), 1 + random:integer(9), {}, {}
    if random:integer(2) == 1 then islands = exchange.count * random:integer(3) end
    for k = 1, islands do elites[k] = random:integer(size) - 1 end
    for k = 1, islands do for _ = 1, elites[k] do homes[#homes + 1] = k end end
    for k = 1, islands do for _ = elites[k] + 1, size do homes[#homes + 1] = k end end
    local rank_of, rank_of_island, places = {}, {}, 0
    for rank = 0, exchange.count - 1 do
      local share = division.share(#homes, elites, rank)
      local listed = 0
      for _, segment in ipairs(share:segments()) do
        for n = 0, segment.count - 1 do
          listed = listed + 1
          t:ok(share:at(segment.first + n + 1) == segment.place + n + 1)
          t:ok(share:number(segment.place + n + 1) == segment.first + n + 1)
        end
      end
      t:equal(listed, share.count)
      places = places + listed
      for i, home in ipairs(homes) do
        if share:at(i) then
          t:ok(rank_of[i] == nil)
          rank_of[i] = rank
          if islands % exchange.count == 0 then
            rank_of_island[home] = rank_of_island[home] or rank
            t:ok(rank_of_island[home] == rank)
          end
        end
      end
    end
    t:equal(places, #homes)
  end
  exchange.count = before
end)

-- Experiments whose functions read robots of other ranks, or make genes.
local KINDS = {
  { "survival, selection and supervisor that read genomes", [[
    fitness = function(robot) return robot:distance() + 1e-9 * robot.genome[1] end,
    state = function() return { sum = 0 } end,
    survival = function(robots, _, state)
      local best = robots.ranked[1]
      local again = limax.rescore.population(robots, { accuracy = "preview" },
        { best, robots.ranked[7] })
      state.sum = state.sum + limax.diversity.genotype(robots, "top") + robots[3].genome[5]
        + robots[best].genome[2] + robots[5].body.mass + (again.fitness[best] or 0)
      return { best, robots.ranked[2] }, { best, robots.ranked[4], robots.ranked[6] }
    end,
    selection = function(robots, random)
      local count = #robots.ranked
      local first = robots.ranked[random:integer(count)]
      return first, robots.ranked[1 + math.floor(1e6 * math.abs(robots[first].genome[1])) % count]
    end,
    supervisor = function(history, _, _, state)
      local robots = history[#history].population
      return { mutation_scale = 0.1 + 1e-3 * math.abs(robots[20].genome[1])
        + 0.01 * limax.diversity.hamming(robots) }, ("sum %.17g"):format(state.sum)
    end]] },
  { "a survival that reads what only a fitness of another rank did", [[
    fitness = function(robot) return robot:distance() + 1e-9 * robot.body.voxels end,
    survival = function(robots)
      local last = robots.ranked[12]
      return robots[last].body.voxels > 13 and { last } or { robots.ranked[1], last }
    end]] },
  { "equal scores and failures, where a rank has only its own robots", [[
    fitness = function(robot)
      if robot.generation > 0 and (robot.id - 20) % 24 < 2 then return 0 / 0 end
      return math.floor(50 * robot:distance())
    end]] },
  { "cells of an archive", [[fitness = "distance", survival = "map_elites",
    archive = { "grid", descriptors = { "muscle_share", "voxel_share" } },
    selection = function(robots, random)
      local count = #robots.ranked
      local a, b = robots.ranked[random:integer(count)], robots.ranked[random:integer(count)]
      return a, robots[a].record.cell % 3 == 0 and a or b
    end,
    supervisor = function(history)
      local robots, sum = history[#history].population, 0
      for i = 1, #robots do sum = sum + (robots.rows[i].cell or 0) end
      return { mutation_scale = 0.1 + 1e-4 * sum }, "read"
    end]] },
  { "a survival and a supervisor that read whole robots", [[fitness = "distance",
    genome = { mutation = "self_adaptive" },
    survival = function(robots)
      local lightest, masses = nil, {}
      for i, robot in ipairs(robots) do masses[i] = robot.body.mass + (robot.parents[1] or 0) end
      for _, i in ipairs(robots.ranked) do
        if not lightest or masses[i] < masses[lightest] then lightest = i end
      end
      return { lightest }
    end,
    supervisor = function(history)
      local robots, voxels = history[#history].population, 0
      for _, robot in ipairs(robots) do voxels = voxels + robot.body.voxels end
      return { mutation_scale = 0.1 + 1e-4 * voxels + 1e-6 * robots[24].parents[1] }, "read"
    end]] },
  { "a survival that reads genomes", [[fitness = "distance", survival = function(robots)
      local best, most = nil, -math.huge
      for _, i in ipairs(robots.ranked) do
        if robots[i].genome[1] > most then best, most = i, robots[i].genome[1] end
      end
      return { best }
    end]] },
  { "newcomers on islands", [[fitness = "distance", survival = { "age_fitness", newcomers = 2 },
    islands = { count = 3, every = 2, migrants = 1, topology = "ring" },
    selection = function(robots, random)
      local count = #robots.ranked
      local k = 1 + math.floor(100 * limax.diversity.hamming(robots)) % count
      return robots.ranked[k], robots.ranked[random:integer(count)]
    end]] },
  { "islands that run ahead, until all robots of one fail", [[survival = "generational",
    generations = 20, islands = { count = 12, every = 8, migrants = 1 }, supervisor = "fixed",
    fitness = function(robot)
      local born = math.floor((robot.id - 1) / 24)
      if (born == 4 or born == 17) and robot.island == 7 then return 0 / 0 end
      return robot:distance()
    end]] },
  { "genes where some ranks have elites only", [[fitness = "distance",
    survival = function(robots) return { unpack(robots.ranked, 1, 22) } end,
    genome = { crossover = function(robots) robots:cross() end }]] },
  { "genes by functions", [[fitness = "distance", genome = {
    mutation = function(robots)
      for _, i in ipairs(robots) do
        local genes, random, first = robots:genes(i), robots:random(i), robots:parents(i)
        genes[1] = robots.rows[1].fitness or robots.rows[24].id -- of one rank
        for k = 2, #genes do genes[k] = 0.9 * first[k] + i % 3 * random:normal() end
        robots.rows[i].origin = "bred"
      end
    end,
    encoding = { genes = 27, initialize = function(robots)
      robots:initialize()
      for _, i in ipairs(robots) do
        if i % 10 == 5 then robots:genes(i)[1] = i end
      end
    end, express = function(robots)
      for _, i in ipairs(robots) do
        local genes, voxels = robots:genes(i), robots:voxels(i)
        for k = 1, 27 do voxels[k] = math.floor(math.abs(genes[k]) * 3) % 5 end
      end
    end } }]] },
}

for _, kind in ipairs(KINDS) do
  test("the same bytes on two and three ranks: " .. kind[1], function(t, folder)
    evolution.script(folder .. "/kind.lua", [[lattice = { 3, 3, 3 }, population = 24,
      generations = 4, simulation = { duration = 0.3, settle = 0.1, accuracy = "preview" }, ]]
      .. kind[2])
    for _, ranks in ipairs { 0, 2, 3 } do
      completes(ranks, t, folder, "run", "kind.lua", "-q", "--device", "cpu", "--out",
        tostring(ranks))
    end
    for _, ranks in ipairs { "2", "3" } do same(t, folder .. "/" .. ranks, folder .. "/0") end
  end)
end

test("islands run ahead of a slower rank, and all numbers stay", function(t, folder)
  -- island 2 waits in generation 2 for island 1 in generation 4
  evolution.script(folder .. "/ahead.lua", [[lattice = { 3, 3, 3 }, population = 24,
    generations = 9, simulation = { duration = 0.3, settle = 0.1 },
    islands = { count = 2, every = 6, migrants = 2 }, supervisor = "fixed",
    fitness = function(robot)
      local generation, tries = math.floor((robot.id - 1) / 24), 0
      if robot.island == 1 and generation == 4 then io.open("there", "w"):close() end
      while robot.island == 2 and generation == 2 and not io.open "there" do
        tries = tries + 1
        if tries > 1e7 then error "no island ran ahead" end
      end
      return robot:distance()
    end]])
  completes(2, t, folder, "run", "ahead.lua", "-q", "--device", "cpu", "--out", "2")
  completes(0, t, folder, "run", "ahead.lua", "-q", "--device", "cpu", "--out", "0")
  same(t, folder .. "/2", folder .. "/0")
end)

-- The pids of the ranks of an mpirun.
local function ranks_of(child)
  local pids = {}
  for pid in process.output("pgrep -P " .. child.pid):gmatch "%d+" do
    pids[#pids + 1] = tonumber(pid)
  end
  table.sort(pids)
  return pids
end

-- Signals and whom they reach: a rank, from 1, or mpirun. A rank that is stopped does not answer.
local LOSSES = { { "KILL", 1 }, { "KILL", 2 }, { "TERM" }, { "KILL", 3 }, { "INT" }, { "KILL", 1 },
  { "TERM" }, { "STOP", 2 }, { "KILL", 2 }, { "KILL", 3 } }

test("a run that loses a rank ends, and resumes to the same bytes", function(t, folder)
  write_experiment(folder, 80)
  completes(0, t, folder, "run", "tiny.lua", "-q", "--out", "whole")
  local random = engine.random(7, 1, "user", 1, 1)
  local function lines()
    local text = process.read(folder .. "/lossy/journal.jsonl")
    return select(2, text:gsub('"kind":"generation"', ""))
  end
  for k, loss in ipairs(LOSSES) do
    local what, before = ("signal %d, %s"):format(k, loss[1]), lines()
    local child = process.start(folder, k > 1 and { "run", "--resume", "lossy", "-q" }
      or { "run", "tiny.lua", "-q", "--out", "lossy" },
      MPIRUN:format(3))
    local moment, pids = nil, nil
    child:signal_when(loss[1], function()
      if lines() < before + 4 then return false end
      pids = pids or ranks_of(child)
      moment = moment or host.clock() + 0.02 * random:uniform()
      if host.clock() < moment then return false end
      child.pid = loss[2] and pids[loss[2]] or child.pid
      return true
    end)
    -- a rank that hangs exceeds the limit of this test
    local status, output = child:finish()
    t:ok(status ~= 0, ("%s: status %s\n%s"):format(what, tostring(status), output))
    t:ok(output:find "continue with: mpirun .* %-%-resume lossy", what .. "\n" .. output)
    t:ok(lines() < 160, what .. ": it was done already")
  end
  completes(2, t, folder, "run", "--resume", "lossy", "-q")
  same(t, folder .. "/lossy", folder .. "/whole")
end)

-- More fields of the experiment, and a text that its run on three ranks prints.
local FAULTS = {
  { "a survival that depends on an address",
    [[fitness = "walk", survival = function(robots)
      return { robots.ranked[1 + math.floor(tonumber(tostring {}:match "0x(%x+)", 16) / 16) % 8] }
    end]], "generation %d+: the parents of ranks 0 and %d differ.*continue with: mpirun %-n 3 " },
  { "a fitness with an error on the last rank",
    "fitness = function(robot) return robot.id == 12 and robot.id.x or robot:distance() end",
    "^[^\n]*robot 12 of the first generation: the fitness failed: [^\n]*attempt to index" },
}

for _, fault in ipairs(FAULTS) do
  test(fault[1] .. " ends the run with the reason, printed once",
    function(t, folder)
      evolution.script(folder .. "/fault.lua", [[lattice = { 3, 3, 3 }, population = 12,
        generations = 20, simulation = { duration = 0.5, settle = 0.1 }, ]] .. fault[2])
      local done = on(3, folder, "run", "fault.lua", "-q", "--device", "cpu")
      local _, reports = done.stderr:gsub("limax: ", "")
      local text = done.stderr:match "limax: (.*)" or ""
      t:ok(done.status ~= 0 and reports == 1 and text:find(fault[3]), done.stderr)
    end)
end

-- More fields of the experiment; breeding from generation 2 fails, on a rank that may be ahead.
local LATE_FAULTS = {
  [[genome = { mutation = function(robots)
    for _, i in ipairs(robots) do
      if robots.rows[i].id == 3 * 12 + 12 then error "no" end
    end
  end }]],
  [[islands = { count = 3, every = 9, migrants = 1 }, supervisor = "fixed",
    trials = function(generation)
      if generation == 3 then error "no" end
      return { {} }
    end]],
}

test("a generation is kept where breeding from it fails on another rank", function(t, folder)
  for k, fields in ipairs(LATE_FAULTS) do
    evolution.script(folder .. "/fails.lua", [[lattice = { 3, 3, 3 }, population = 12,
      generations = 20, simulation = { duration = 0.3, settle = 0.1 }, fitness = "distance", ]]
      .. fields)
    for _, ranks in ipairs { 0, 3 } do
      local out = ("%d-%d"):format(k, ranks)
      local done = on(ranks, folder, "run", "fails.lua", "-q", "--device", "cpu", "--out", out)
      t:ok(done.status ~= 0 and done.stderr:find "no\n", done.stderr)
      local text = process.read(folder .. "/" .. out .. "/journal.jsonl")
      t:equal(select(2, text:gsub('"kind":"generation"', "")), 3)
    end
  end
end)

test("only one rank asks a language model", function(t, folder)
  local server = faulty_server.open(t)
  evolution.script(folder .. "/asks.lua", ([[generations = 4,
    supervisor = { "llm", url = %q, model = "m" }]]):format(server:url "good"))
  completes(0, t, folder, "run", "asks.lua", "-q", "--out", "0")
  completes(3, t, folder, "run", "asks.lua", "-q", "--out", "3")
  t:equal(server:ask "counts".good.requests, 2 * 3)
  t:ok(process.read(folder .. "/3/r01/metrics.jsonl")
    == process.read(folder .. "/0/r01/metrics.jsonl"))
  server:close()
end)

test("ranks share the runs of a study", function(t, folder)
  process.write(folder .. "/study.lua", [[
    local tiny = { seed = 3, lattice = { 2, 2, 2 }, population = 4, fitness = "distance",
      simulation = { duration = 0.1, settle = 0, accuracy = "preview" }, record = {},
      archive = { "grid", descriptors = { "muscle_share" } }, survival = "map_elites" }
    require("limax.tools.study.study").main({ repetitions = 2, evaluations = 32,
      experiment = tiny }, { ... })]])
  for _, ranks in ipairs { 0, 3 } do
    completes(ranks, t, folder, "study.lua", "--out", tostring(ranks), "--device", "cpu")
  end
  -- one run goes on after its first generation, on one of two ranks
  local journal = folder .. "/3/fixed/r01/journal.jsonl"
  process.write(journal, process.read(journal):match '^.-"kind":"generation"[^\n]*\n')
  completes(2, t, folder, "study.lua", "--out", "3", "--device", "cpu")
  for _, name in ipairs { "study.json", "compare/compare.json", "compare/compare.csv",
    "yoked/r02/r02/metrics.jsonl" } do
    local plain = process.read(folder .. "/0/" .. name):gsub("0/", "3/")
    t:ok(#plain > 0 and plain == process.read(folder .. "/3/" .. name):gsub("0/", "3/"), name)
  end
  process.write(folder .. "/bad.lua", (process.read(folder .. "/study.lua"):gsub('"distance"',
    'function() error "bad" end', 1)))
  local done = on(2, folder, "bad.lua", "--out", "bad", "--device", "cpu")
  t:ok(done.status == 1 and done.stderr:find "the fitness failed: bad.lua"
    and not done.stderr:find "terminate called", done.stderr)
end)

test("a command for one process, and a loop of one's own, are refused", function(t, folder)
  local done = on(2, folder, "doctor")
  t:ok(done.status == 2 and done.stderr:find "start it without mpirun", done.stderr)
  process.write(folder .. "/loop.lua", [[local limax = require "limax"
      limax.start(limax.experiment { name = "loop", population = 4, fitness = "walk" })]])
  done = on(2, folder, "loop.lua")
  t:ok(done.status == 2 and done.stderr:find "loop of your own runs in one process", done.stderr)
  write_experiment(folder, 2)
  done = on(7, folder, "run", "tiny.lua", "-q", "--device", "cpu")
  t:ok(done.status == 2 and done.stderr:find "population = 12: 7 ranks .* at most 6", done.stderr)
end)
