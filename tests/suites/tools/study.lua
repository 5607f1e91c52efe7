--- study.lua: the study of supervision: its plan, equal budgets and first populations, a study that
--- was stopped continues to the same bytes, and what it prints.

local cells = require "limax.tools.study.cells"
local faulty_server = require "support.faulty_server"
local host = require "limax.host"
local limax = require "limax"
local plan = require "limax.tools.study.plan"
local process = require "support.process"
local runs = require "limax.tools.report.runs"
local run_folder = require "limax.run.folder"
local source = require "limax.base.source"
local study = require "limax.tools.study.study"
local trial = require "support.trial"

-- The finished runs of these folders.
local function finished(words) return runs.finished(runs.read_all(words, true)) end

local suite = require("limax.test").suite "study"

local TINY = { seed = 3, lattice = { 2, 2, 2 }, population = 4, fitness = "distance",
  genome = { sigma = 0.5 }, simulation = { duration = 0.1, settle = 0, accuracy = "preview" },
  record = {} }

local function tiny(out, settings)
  local options = { experiment = TINY, out = out, repetitions = 2, evaluations = 32,
    device = limax.engine.device "cpu", with_model = false, say = function() end }
  for name, value in pairs(settings or {}) do options[name] = value end
  return study.new(options)
end

-- ---- the plan -----------------------------------------------------------------------------------

suite:test("donors run before the cells that read them, in another repetition", function(t)
  local config = tiny "/nowhere".config
  for _, with_model in ipairs { false, true } do
    local arms = plan.arms(config, with_model)
    local list, place, donors = plan.cells(arms, 3), {}, {}
    t:equal(#list, 3 * (with_model and 17 or 13))
    for _, arm in ipairs(arms) do
      if arm.asks then t:equal(arm.supervisor.fallback, "keep") end
    end
    for k, cell in ipairs(list) do
      t:ok(not place[cell.path], cell.path)
      place[cell.path] = k
      t:equal(cell.donor ~= nil, cell.arm.reads ~= nil)
      if cell.donor then
        t:equal(cell.donor.arm.name, with_model and "llm" or "rules")
        t:ok(cell.donor.repetition ~= cell.repetition and place[cell.donor.path], cell.path)
        local key = cell.arm.name .. cell.donor.repetition
        t:ok(not donors[key], key)
        donors[key] = true
      end
    end
  end
end)

suite:test("invalid settings are refused", function(t)
  t:raises("at least two repetitions", function() tiny("/nowhere", { repetitions = 1 }) end)
  t:raises("at least 8 populations, 32, got 31",
    function() tiny("/nowhere", { evaluations = 31 }) end)
  t:raises('unknown arm yoke; did you mean "yoked"?',
    function() tiny("/nowhere", { arms = { "fixed", "yoke" } }) end)
  t:raises("yoked reads the runs of llm or rules, which is not among the arms",
    function() tiny("/nowhere", { arms = { "fixed", "yoked" } }) end)
end)

-- ---- a whole study ------------------------------------------------------------------------------

-- Bytes of the files of the runs that contain no clock and no path.
local function bytes_of(one)
  local list = {}
  for _, cell in ipairs(one.cells) do
    for _, name in ipairs { "metrics.jsonl", "ledger.jsonl", "robots/g0001.npy" } do
      -- the ledger names the folder of a donor
      local text = assert(source.read(("%s/%s/r%02d/%s"):format(one.out, cell.path,
        cell.repetition, name)))
      list[#list + 1] = text:gsub(one.out:gsub("%p", "%%%0"), "OUT")
    end
  end
  return list
end

-- Truncates a run of one repetition to its state after a generation.
local function cut_to(path, generation)
  local folder = run_folder.open(path)
  folder:continue(folder.config, {}, false, generation)
  folder:close()
end

suite:test("every arm makes a valid experiment", function(t)
  local one = tiny "/nowhere"
  for _, cell in ipairs(one.cells) do
    if not cell.arm.reads then t:equal(cells.experiment(one, cell).config.evaluations, 32) end
  end
end)

-- Equal first populations and budgets, and a comparison of them.
local function check_study(t, whole, result)
  local first = {}
  for _, cell in ipairs(whole.cells) do
    local place = ("%s/%s/r%02d/%%s/g0000.npy"):format(whole.out, cell.path, cell.repetition)
    local beginning = assert(source.read(place:format "robots"))
      .. assert(source.read(place:format "genomes"))
    first[cell.repetition] = first[cell.repetition] or beginning
    t:ok(beginning == first[cell.repetition], cell.path)
  end
  t:ok(first[1] ~= first[2])
  -- each run uses the budget up to less than one population, tuning included
  for _, run in ipairs(finished { whole.out }) do
    t:ok(run.evaluations <= 36 and run.evaluations > 36 - 4, run.path .. ": " .. run.evaluations)
    t:equal(run.before > 0, run.arm == "tuned_fixed")
  end
  t:equal({ #result.arms, result.baseline }, { 4, "fixed" })
  for _, arm in ipairs(result.arms) do
    t:equal(arm.donor, arm.name == "yoked" and "parameters of another repetition of rules" or nil)
    t:ok(not arm.claimed, arm.name)
  end
  for _, name in ipairs { "compare.txt", "compare.csv", "compare.json",
    "learning-85.svg", "learning.csv" } do
    t:equal(host.file.exists(whole.out .. "/compare/" .. name), "file")
  end
end

suite:test("a study compares equal budgets, and continues to the same bytes", function(t)
  local own = source.copy(TINY)
  own.fitness = function(robot) return robot:distance() end
  local some = { arms = { "fixed", "tuned_fixed", "rules", "yoked" }, evaluations = 36,
    experiment = own }
  local whole = tiny(t:folder() .. "/whole", some)
  check_study(t, whole, study.run(whole))
  -- stopped after its third run, the first one truncated to two generations
  local stopped, count = tiny(t:folder() .. "/stopped", some), 0
  stopped.say = function()
    count = count + 1
    if count == 4 then error("stop", 0) end
  end
  t:raises("stop", function() study.run(stopped) end)
  t:raises("runs are not done", function() finished { stopped.out } end)
  cut_to(stopped.out .. "/fixed/r01", 1)
  local again = tiny(stopped.out, some)
  study.run(again)
  t:equal(bytes_of(again), bytes_of(whole))
  t:equal(source.read(again.out .. "/compare/compare.csv"),
    source.read(whole.out .. "/compare/compare.csv"))

  -- only the study can resume its runs
  process.fails(t, t:folder(), 2, { "run", "--resume", again.out .. "/fixed/r01" },
    "was not started from a script that returns an experiment")

  -- another study in the same folder
  some.evaluations = 40
  t:raises("was started by another study: evaluations was 36, is 40",
    function() study.run(tiny(again.out, some)) end)
end)

-- A study's script with its smallest study, which is also that of --quick.
local SMALLEST = [[
local study = require "limax.tools.study.study"
local small = { repetitions = 2, evaluations = 32, experiment = { lattice = { 2, 2, 2 },
  population = 4, fitness = "distance", record = {},
  simulation = { duration = 0.05, settle = 0, accuracy = "preview" } } }
small.quick = small
study.main(small, { ... })
]]

-- ---- arms that ask a model ----------------------------------------------------------------------

suite:test("arms that ask a model: their share of generations", function(t)
  local server = faulty_server.open(t)
  local base = t:folder()
  assert(host.file.write_atomic(base .. "/tiny.lua", SMALLEST))
  local done = process.ends(base, { "tiny.lua", "--out", "asked", "--device", "cpu", "--arms",
    "fixed,llm,llm_paper,yoked" },
    { before = "LIMAX_LLM_MODEL=played LIMAX_LLM_URL=" .. server:url "varied" })
  t:ok(done.status == 0, done.stderr .. done.stdout)
  local price = done.stdout:find("evaluations: at most 256, 32 a run", 1, true)
  t:ok(price and price < done.stdout:find("[1/8] fixed, repetition 1", 1, true), done.stdout)
  t:ok(done.stdout:find "\ntokens: about [%d.e-]+ million for %d+ answers", done.stdout)
  trial.contains(t, done.stdout, "\nllm: the model set 100.0 % of ",
    "\nllm_paper: the model set 100.0 % of ",
    "\nyoked: parameters of another repetition of llm.")
  server:close()
end)
