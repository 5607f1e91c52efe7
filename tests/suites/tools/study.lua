--- study.lua: the study of supervision: who lends to whom, equal budgets, equal first populations,
--- a study that was stopped goes on to the same bytes, and what it tells before and after.

local cells = require "limax.tools.study.cells"
local faulty_server = require "support.faulty_server"
local host = require "limax.host"
local ledger = require "limax.supervise.ledger"
local limax = require "limax"
local model_arms = require "limax.tools.study.model_arms"
local plan = require "limax.tools.study.plan"
local process = require "support.process"
local runs = require "limax.tools.compare.runs"
local source = require "limax.base.source"
local study = require "limax.tools.study.study"
local tuning = require "limax.tools.study.tuning"

local suite = require("limax.test").suite "study"

local TINY = { seed = 3, lattice = { 2, 2, 2 }, population = 4, fitness = "distance",
  genome = { sigma = 0.5 }, simulation = { duration = 0.1, settle = 0, accuracy = "preview" },
  record = {} }

local function tiny(out, given)
  local options = { experiment = TINY, out = out, repetitions = 2, evaluations = 32,
    device = limax.engine.device "cpu", with_model = false, say = function() end }
  for name, value in pairs(given or {}) do options[name] = value end
  return study.new(options)
end

local function names_of(arms)
  local list = {}
  for k, arm in ipairs(arms) do list[k] = arm.name end
  return list
end

-- ---- the plan -----------------------------------------------------------------------------------

suite:test("the arms, without and with a model", function(t)
  local config = tiny "/nowhere".config
  t:equal(names_of(plan.arms(config, false)), { "fixed", "tuned_fixed", "schedule", "random",
    "random_materials", "random_both", "one_fifth", "self_adaptive", "bandit", "rules",
    "constant_median", "yoked", "shuffled" })
  t:equal(names_of(plan.arms(config, true)), { "fixed", "tuned_fixed", "schedule", "random",
    "random_materials", "random_both", "one_fifth", "self_adaptive", "bandit", "rules", "llm",
    "llm_materials", "llm_both", "llm_paper", "llm_unnamed", "llm_blind", "constant_median",
    "yoked", "shuffled" })
  for _, arm in ipairs(plan.arms(config, true)) do
    if arm.asks then t:equal(arm.supervisor.fallback, "keep") end
  end
end)

suite:test("every cell once, donors first and from another repetition", function(t)
  local config = tiny "/nowhere".config
  for _, repetitions in ipairs { 2, 3, 10 } do
    local lent = {}
    for repetition = 1, repetitions do
      local donor = plan.donor_of(repetition, repetitions)
      t:ok(donor ~= repetition and donor >= 1 and donor <= repetitions and not lent[donor])
      lent[donor] = true
    end
    for _, with_model in ipairs { false, true } do
      local list, place, arms = plan.cells(plan.arms(config, with_model), repetitions), {},
        #plan.arms(config, with_model)
      t:equal(#list, arms * repetitions)
      for k, cell in ipairs(list) do
        t:ok(not place[cell.path], cell.path)
        place[cell.path] = k
        t:equal(cell.donor ~= nil, cell.arm.reads ~= nil or cell.arm.blind == true)
        if cell.donor then
          t:equal(cell.donor.arm.name, with_model and "llm" or "rules")
          t:equal(cell.donor.repetition, plan.donor_of(cell.repetition, repetitions))
          t:ok(place[cell.donor.path], cell.path .. " comes before " .. cell.donor.path)
        end
      end
    end
  end
end)

suite:test("what a study cannot be is refused", function(t)
  t:raises("two repetitions at least", function() tiny("/nowhere", { repetitions = 1 }) end)
  t:raises("8 populations at least, 32, got 31",
    function() tiny("/nowhere", { evaluations = 31 }) end)
  t:raises('unknown arm yoke; did you mean "yoked"?',
    function() tiny("/nowhere", { arms = { "fixed", "yoke" } }) end)
  t:raises("yoked reads the runs of llm or rules, which is not among the arms",
    function() tiny("/nowhere", { arms = { "fixed", "yoked" } }) end)
end)

-- ---- a whole one --------------------------------------------------------------------------------

-- Bytes of every file of the runs but for those with clocks or the way there.
local function bytes_of(one)
  local list = {}
  for _, cell in ipairs(one.cells) do
    for _, name in ipairs { "metrics.jsonl", "ledger.jsonl",
      ("r%02d/population/g0001.jsonl"):format(cell.repetition) } do
      -- a donor's folder is named by its way
      local text = assert(source.read(("%s/%s/%s"):format(one.out, cell.path, name)))
      list[#list + 1] = text:gsub(one.out:gsub("%p", "%%%0"), "OUT")
    end
  end
  return list
end

-- Takes a whole run of one repetition back to where it stood after a generation.
local function cut_to(path, generation)
  local bytes = {}
  for _, name in ipairs { "metrics", "ledger", "timing" } do
    bytes[name] = 0
    local lines = source.read(("%s/%s.jsonl"):format(path, name)):gmatch "[^\n]*\n"
    for _ = 0, generation do bytes[name] = bytes[name] + #lines() end
  end
  local checkpoint = { schema = "limax.checkpoint/1", repetition = 1, generation = generation,
    bytes = bytes }
  assert(host.file.write_atomic(path .. "/checkpoint", host.json.encode(checkpoint)))
  assert(host.file.write_atomic(path .. "/STATUS", '{"state":"running"}\n'))
end

suite:test("arms of a repetition begin alike and have equal budgets", { limit = 300 }, function(t)
  local whole = tiny(t:folder() .. "/whole")
  local result = study.run(whole)
  local first = {}
  for _, cell in ipairs(whole.cells) do
    local place = ("%s/%s/r%02d/population/g0000"):format(whole.out, cell.path, cell.repetition)
    local beginning = assert(source.read(place .. ".jsonl")) .. assert(source.read(place .. ".npy"))
    first[cell.repetition] = first[cell.repetition] or beginning
    t:ok(beginning == first[cell.repetition], cell.path)
  end
  t:ok(first[1] ~= first[2])

  -- nobody has more than the budget, tuning included, and nobody leaves a population of it
  for _, run in ipairs(runs.read(runs.expand { whole.out })) do
    t:ok(run.evaluations <= 32 and run.evaluations > 32 - 4, run.path .. ": " .. run.evaluations)
    t:equal(run.before > 0, run.arm == "tuned_fixed")
  end
  t:equal(#result.arms, 13)
  t:equal(result.baseline, "fixed")
  for _, arm in ipairs(result.arms) do
    t:equal(arm.donor, (arm.name == "yoked" or arm.name == "shuffled"
      or arm.name == "constant_median") and "parameters of another repetition of rules" or nil)
    t:ok(not arm.claimed, arm.name)
  end
  for _, name in ipairs { "compare.txt", "compare.csv", "compare.json", "compare.tex",
    "learning.svg", "diversity.csv", "changes.svg", "first_last.csv" } do
    t:equal(host.file.exists(whole.out .. "/compare/" .. name), "file")
  end
end)

suite:test("a study that was stopped goes on to the same bytes", { limit = 60 }, function(t)
  local own = source.copy(TINY)
  own.fitness = function(robot) return robot:distance() end
  local some = { arms = { "fixed", "tuned_fixed", "rules", "yoked" }, evaluations = 36,
    experiment = own }
  local whole = tiny(t:folder() .. "/whole", some)
  study.run(whole)
  -- stopped after its third run, the first one cut to two of its generations
  local stopped, count = tiny(t:folder() .. "/stopped", some), 0
  stopped.say = function()
    count = count + 1
    if count == 4 then error("stop", 0) end
  end
  t:raises("stop", function() study.run(stopped) end)
  t:raises("runs are not done", function() runs.expand { stopped.out } end)
  cut_to(stopped.out .. "/fixed/r01", 1)
  local again = tiny(stopped.out, some)
  study.run(again)
  t:equal(bytes_of(again), bytes_of(whole))
  t:equal(source.read(again.out .. "/compare/compare.csv"),
    source.read(whole.out .. "/compare/compare.csv"))

  -- its script begins studies, not runs
  local done = process.ends(t:folder(), { "run", "--resume", again.out .. "/fixed/r01" })
  t:equal(done.status, 2)
  t:ok(done.stderr:find("was not started from a script that returns an experiment", 1, true),
    done.stderr)

  -- the same folder is no place for another study, whole as it is
  some.evaluations = 40
  t:raises("was begun by another study: evaluations was 36, is 40",
    function() study.run(tiny(again.out, some)) end)
end)

suite:test("what is spent on tuning is of the same budget, and the best setting is taken",
  function(t)
  local one = tiny(t:folder() .. "/one", { evaluations = 120 })
  local tuned = tuning.run(one, 1)
  t:equal({ tuning.budget(one) }, { 3, 12 })
  -- the first, with one elite, takes 4, 3 and 3
  t:ok(tuned.evaluations >= 3 * 8 and tuned.evaluations <= 3 * 12, tuned.evaluations)
  one.tuned[1] = tuned
  for _, cell in ipairs(one.cells) do
    if cell.arm.tuned and cell.repetition == 1 then
      local config = cells.experiment(one, cell).config
      t:equal(config.evaluations, 120 - tuned.evaluations)
      t:equal(config.breeding, tuned.breeding)
    end
  end
  for _, limit in ipairs(ledger.limits(4)) do
    local value = tuned.breeding[limit.field]
    t:ok(limit.material or value >= limit.minimum and value <= limit.maximum, limit.field)
  end
end)

suite:test("the script tells its price first and says that it is too small", function(t)
  local base = t:folder()
  assert(host.file.write_atomic(base .. "/tiny.lua", [[
local study = require "limax.tools.study.study"
local small = { repetitions = 2, evaluations = 32, experiment = { lattice = { 2, 2, 2 },
  population = 4, fitness = "distance", record = {},
  simulation = { duration = 0.05, settle = 0, accuracy = "preview" } } }
study.main({ repetitions = 10, evaluations = 1000, experiment = {}, quick = small }, { ... })
]]))
  local done = process.completes(t, base, { "tiny.lua", "--quick", "--device", "cpu", "--arms",
    "fixed,rules" })
  local price, runs_at = done.stdout:find("evaluations: at most 128, 32 a run", 1, true),
    done.stdout:find("[1/4] fixed, repetition 1", 1, true)
  t:ok(price and runs_at and price < runs_at, done.stdout)
  t:ok(done.stdout:find "\ntime: about [%d.e-]+ h %(", done.stdout)
  t:ok(done.stdout:find("\ntokens: none", 1, true), done.stdout)
  t:ok(done.stdout:find("\n--quick: too small for any claim\n", 1, true), done.stdout)
  t:equal(host.file.exists(base .. "/studies/supervision-quick/compare/compare.csv"), "file")
  done = process.ends(base, { "tiny.lua", "--help" })
  t:equal(done.status, 0)
  t:ok(done.stdout:find("--repetitions N", 1, true), done.stdout)
end)

-- ---- arms that ask a model ----------------------------------------------------------------------

suite:test("unnamed: names go out as letters and come back", function(t)
  local sent = 'Set "mutation_rate" (not mutation_rates) and bone.stiffness: {"elite_fraction":0.3}'
  local asked = model_arms.without_names(sent)
  t:equal(asked, 'Set "A" (not mutation_rates) and bone.E: {"D":0.3}')
  t:equal(model_arms.with_names '{"A": 0.2, "D" :0.1, "reason": "A is \\"B\\" now"}',
    '{"mutation_rate": 0.2, "elite_fraction" :0.1, "reason": "A is \\"B\\" now"}')
end)

local SMALLEST = [[
local study = require "limax.tools.study.study"
study.main({ repetitions = 2, evaluations = 32, experiment = { lattice = { 2, 2, 2 },
  population = 4, fitness = "distance", record = {},
  simulation = { duration = 0.05, settle = 0, accuracy = "preview" } } }, { ... })
]]

suite:test("a dead endpoint costs a study its three questions once", { limit = 300 }, function(t)
  local server, base = faulty_server.open(t), t:folder()
  assert(host.file.write_atomic(base .. "/tiny.lua", SMALLEST))
  local done = process.completes(t, base, { "tiny.lua", "--out", "dead", "--device", "cpu",
    "--arms", "fixed,llm,llm_paper" }, { before =
    "LIMAX_LLM_MODEL=m LIMAX_LLM_URL=http://127.0.0.1:" .. server.ports.refused })
  local questions, probes = 0, 0
  for _, path in ipairs { "llm/r01", "llm/r02", "llm_paper/r01", "llm_paper/r02" } do
    for line in source.read(("%s/dead/%s/transcript.jsonl"):format(base, path)):gmatch "[^\n]+" do
      local entry = host.json.decode(line)
      if entry.kind == "attempt" and entry.probe then probes = probes + 1
      elseif entry.kind == "attempt" then questions = questions + 1 end
    end
  end
  -- each question is tried thrice; each run that follows begins with a probe
  t:equal(questions, 9)
  t:ok(probes >= 3 and probes <= 6, probes)
  t:ok(done.stdout:find("\nllm, llm_paper: partly model: it set 0 %", 1, true), done.stdout)
  server:close()
end)

suite:test("arms that ask a model: an endpoint, their share, and whose history they are told",
  { limit = 60 }, function(t)
  local server = faulty_server.open(t)
  local base = t:folder()
  assert(host.file.write_atomic(base .. "/tiny.lua", SMALLEST))
  local function run(out, arms)
    return process.ends(base, { "tiny.lua", "--out", out, "--device", "cpu", "--arms", arms },
      { before = "LIMAX_LLM_MODEL=played LIMAX_LLM_URL=" .. server:url "varied" })
  end
  local done = run("told", "fixed,llm,llm_paper,llm_blind,yoked")
  t:ok(done.status == 0, done.stderr .. done.stdout)
  t:ok(done.stdout:find "\ntokens: about [%d.e-]+ million for %d+ answers", done.stdout)
  for _, name in ipairs { "llm", "llm_paper", "llm_blind" } do
    t:ok(done.stdout:find("\n" .. name .. ": the model set 100.0 % of ", 1, true), done.stdout)
  end
  t:ok(done.stdout:find("\nllm_blind: history of another repetition of llm.", 1, true), done.stdout)
  t:ok(done.stdout:find("\nyoked: parameters of another repetition of llm.", 1, true), done.stdout)
  -- the blind model's second question tells of the generations that the other repetition had
  local function told(path)
    for line in source.read(path):gmatch "[^\n]+" do
      local entry = host.json.decode(line)
      if entry.request and entry.generation == 2 then
        local content = host.json.decode(entry.request).messages[2].content
        -- four robots, then three: two generations are scored
        t:ok(content:find('"evaluations":{"budget":32,"spent":7}', 1, true), content)
        return assert(content:match "\nThe last generations.-\n%[(.-)%]\n")
      end
    end
  end
  local blind = told(base .. "/told/llm_blind/r01/transcript.jsonl")
  t:equal(blind, told(base .. "/told/llm/r02/transcript.jsonl"))
  t:ok(blind ~= told(base .. "/told/llm/r01/transcript.jsonl"))

  done = run("unnamed", "fixed,llm_unnamed")
  t:ok(done.status == 0, done.stderr .. done.stdout)
  local asked = host.json.encode(server:last "varied")
  t:ok(not asked:find "mutation_rate" and asked:find('\\"A\\"', 1, true), asked)
  server:close()
end)
