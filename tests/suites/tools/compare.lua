--- compare.lua: `limax compare` on small real runs, and its verdicts on outcomes made by hand:
--- which test, what may be claimed, which runs cannot be compared.

local arms = require "limax.tools.report.arms"
local evolution = require "support.evolution"
local forged = require "support.forged"
local host = require "limax.host"
local measures = require "limax.tools.compare.measures"
local limax = require "limax"
local outcome = require "limax.tools.compare.outcome"
local process = require "support.process"
local runs = require "limax.tools.report.runs"
local source = require "limax.base.source"
local tables = require "limax.tools.compare.tables"
local trial = require "support.trial"
local verdict = require "limax.tools.compare.verdict"

-- The finished runs of these folders.
local function finished(words) return runs.finished(runs.read_all(words, true)) end

local suite = require("limax.test").suite "compare"

local contains, run = trial.contains, evolution.run

-- ---- real runs ----------------------------------------------------------------------------------

suite:test("runs become arms, pairs and a table in every form", function(t)
  local base, words = t:folder(), { "compare" }
  for _, name in ipairs { "fixed", "random" } do
    for seed = 1, 3 do
      words[#words + 1] = run(("%s/%s%d"):format(base, name, seed), { supervisor = name,
        seed = seed })
    end
  end
  local done = process.completes(t, base, words)
  contains(t, done.stdout, "Baseline: fixed", "Wilcoxon's exact signed-rank test of pairs for "
    .. "random: every seed and repetition is in both arms.",
    "n = 3: the smallest p after Holm over 1 is 0.25", "\nExploratory, no claims")
  t:ok(done.stdout:find("\nrandom: too few runs for any claim: the smallest p after Holm is 0.25."
    .. " Its difference from fixed is %S+ m %(95 %% interval %S+ to %S+%) on 3 pairs of runs.\n\n"
    .. "arm +n +median"), done.stdout)

  for _, word in ipairs { "--out", base .. "/out", "--json" } do words[#words + 1] = word end
  done = process.ends(base, words)
  local result = assert(host.json.decode(done.stdout))
  t:equal({ result.baseline, #result.arms }, { "fixed", 2 })
  for k, one in ipairs(result.arms[2].runs) do
    t:equal({ one.seed, one.repetition, one.evaluations > 6 }, { tostring(k), 1, true })
    t:ok(one.outcome and one.mean_best_so_far)
  end
  t:equal(done.stdout, source.read(base .. "/out/compare.json"))
  local csv = source.read(base .. "/out/compare.csv")
  t:equal(select(2, csv:gsub("\n", "")), 3)
  local picture = source.read(base .. "/out/learning-175.svg")
  t:ok(picture:find(">random</text>", 1, true) and picture:find "</svg>%s*$")

  for _, bad in ipairs { { "--csv", "--json", "--csv and --json exclude each other" },
    { "--baseline", "fixd", 'did you mean "fixed"?' } } do
    process.fails(t, base, 2, { "compare", base .. "/fixed1", bad[1], bad[2] }, bad[3])
  end
end)

suite:test("the outcome is the last champion at publish under the first materials", function(t)
  local folder = run(t:folder() .. "/r", { generations = 4, fitness = { "distance", axis = "x" },
    supervision = { materials = true },
    supervisor = function() return { materials = { bone = { stiffness = 9000 } } } end })
  local read = finished { folder }
  local value = outcome.measure(read, limax.engine.device "cpu")[read[1]]
  local champion = limax.robot(folder .. "/r01/champions/g0003.json")
  local again = champion:simulate { accuracy = "publish", device = "cpu",
    materials = read[1].config.materials }
  t:same_bits(value, again:distance { axis = "x" })
  t:ok(value ~= champion:simulate { accuracy = "publish", device = "cpu" }:distance { axis = "x" },
    "other materials, another score")
end)

suite:test("a fitness of a script runs from the folder, as it was recorded", function(t)
  local base = t:folder()
  local executed, helper = base .. "/executed", base .. "/r1/scripts/helper.lua"
  process.write(base .. "/own.lua", [[
local limax = require "limax"
io.open("executed", "w"):close()
require "helper"
return limax.experiment { name = "own", lattice = { 2, 2, 2 }, population = 4, generations = 2,
  repetitions = 1, simulation = { duration = 0.1, settle = 0, accuracy = "preview" },
  supervisor = "fixed", fitness = function(robot)
    -- not in a variable, whose value would make the fitness another one
    return require("helper").value + 0 * robot:distance()
  end }
]])
  for k, supervisor in ipairs { "fixed", "random" } do
    process.write(base .. "/helper.lua", ("return { value = %d }"):format(6 + k))
    process.completes(t, base, { "run", "own.lua", "-q", "--out", "r" .. k, "--set",
      "supervisor=" .. supervisor })
  end
  local done = process.completes(t, base, { "compare", "r1", "r2", "--json" })
  local compared = host.json.decode(done.stdout).arms
  t:equal({ compared[1].runs[1].outcome, compared[2].runs[1].outcome }, { 7, 8 })

  -- with the key of another user nothing runs, and the report says why
  for _, key in ipairs { "", ("LIMAX_KEY_FILE=%s/other.key"):format(base) } do
    host.file.remove(executed)
    done = process.ends(base, { "report", "r1", "r2", "--out", "x.html" }, { before = key })
    t:equal({ done.status, host.file.exists(executed) }, { 0, key == "" and "file" or nil })
    local refusal = process.read(base .. "/x.html"):find("trust it: limax trust r1", 1, true)
    t:equal(refusal == nil, key == "")
  end
  local function refused(text)
    process.fails(t, base, 2, { "compare", "r1", "r2" }, text)
    t:ok(not host.file.exists(executed), text)
  end
  process.write(helper, "return { value = 1000 }")
  refused("r1/scripts/helper.lua is not the script that ran: its SHA-256 differs from "
    .. "r1/config.json: run.scripts[1].sha256")
  process.write(helper, "return { value = 7 }")
  forged.text(base .. "/r1", "config.json", function(text)
    return (text:gsub('"seed": %d+', '"seed": 7'))
  end)
  refused "r1/config.json was changed since it was sealed"
end)

suite:test("other questions and budgets are refused with the fields that differ", function(t)
  local base = t:folder()
  local function refused(fields, ...)
    local first = run(base .. "/a" .. #host.file.list(base), { seed = 1 })
    local second = run(base .. "/b" .. #host.file.list(base), fields)
    local list = finished { first, second }
    for _, text in ipairs { "another question or budget", ... } do
      t:raises(text, function() arms.group(list) end)
    end
  end
  refused({ generations = 2 }, "  generations: 3, 2")
  refused({ fitness = "walk" }, '  fitness: "distance", "walk"')
  refused({ population = 8, lattice = { 2, 2, 3 } }, "  lattice.3: 2, 3", "  population: 6, 8")
  refused({ simulation = { duration = 0.1, settle = 0, accuracy = "preview" } },
    "  simulation.duration: 0.2, 0.1")
  t:raises("is not a run folder", function() finished { base } end)
  local twice = run(base .. "/twice", {})
  t:raises("are the same: arm fixed, seed 1, repetition 1", function()
    arms.group(finished { twice, twice })
  end)
  local text = process.read(twice .. "/journal.jsonl")
  process.write(twice .. "/journal.jsonl", (text:gsub("[^\n]*\n$", "")))
  t:raises("is not done (stopped)", function() finished { twice } end)
end)

local function wait() end

local NAMES = {
  -- of one supervisor, by the fields that differ; the last one is another run of the first arm
  { { supervisor = "rules" }, { supervisor = { "rules", patience = 2 } },
    { supervisor = "rules", breeding = { mutation_rate = 0.2 } },
    { supervisor = "rules", name = "other", seed = 2 },
    names = { "^rules$", "patience=2", "^rules %(breeding.mutation_rate=0.2%)$" } },
  -- by how they search; map_elites brings its own selection, and cppn its own fields of a genome
  { { survival = { "plus", share = 0.3 }, genome = { encoding = "cppn" } }, {},
    { archive = { "grid", cells = 4, descriptors = { "muscle_share" } }, survival = "map_elites" },
    names = { "^cppn, plus, no archive$", "^fourier, elitist, no archive$",
      "^fourier, map_elites, grid$" } },
  { {}, { selection = "rank" }, names = { "^tournament$", "^rank$" } },
  { { survival = { "plus", share = 0.3 } }, { survival = { "plus", share = 0.2 } },
    names = { "^fixed$", "^fixed %(survival.share=0.2%)$" } },
  -- by their experiments
  { { supervisor = "rules", name = "low" },
    { supervisor = "rules", name = "high", breeding = { mutation_rate = 0.2 } },
    names = { "^low$", "^high$" } },
  { { supervisor = wait }, { supervisor = "fixed" }, names = { "compare%.lua$", "^fixed$" } },
  -- two functions of one file
  { { supervisor = wait }, { supervisor = function() return nil, "other" end },
    names = { "compare%.lua$", 'compare%.lua %(supervisor.function="%x+"%)$' } },
}

suite:test("arms are named by what differs", function(t)
  local base = t:folder()
  for n, case in ipairs(NAMES) do
    local list = {}
    for k, fields in ipairs(case) do list[k] = run(("%s/%d-%d"):format(base, n, k), fields) end
    local groups = arms.group(finished(list))
    t:equal(#groups, #case.names)
    for k, pattern in ipairs(case.names) do t:ok(groups[k].name:find(pattern), groups[k].name) end
  end
end)

suite:test("--outcome compares what the metrics record of archives and fronts", function(t)
  local base, words = t:folder(), { "compare" }
  local function archive(cells)
    return { "grid", cells = cells, descriptors = { "muscle_share", "voxel_share" } }
  end
  for _, survival in ipairs { "elitist", "map_elites" } do
    for seed = 1, 2 do
      words[#words + 1] = run(("%s/%s%d"):format(base, survival, seed), { archive = archive(5),
        survival = survival, seed = seed })
    end
  end
  local text = process.completes(t, base, { unpack(words, 1, 5) })
  contains(t, text.stdout, "Outcome: best_standard")
  words[#words + 1], words[#words + 2] = "--outcome=qd_score", "--json"
  local result = host.json.decode(process.completes(t, base, words).stdout)
  contains(t, result.outcome, "QD score")
  for _, arm in ipairs(result.arms) do
    for k, one in ipairs(arm.runs) do
      local lines = source.read(("%s/%s%d/r01/metrics.jsonl"):format(base, arm.arm, k))
      t:equal(one.outcome, host.json.decode(lines:match "([^\n]+)\n$").archive.qd_score)
    end
  end
  local function refused(message, ...)
    process.fails(t, base, 2, { "compare", words[2], ... }, message)
  end
  run(base .. "/fine", { archive = archive(9), seed = 3 })
  run(base .. "/none", { seed = 4 })
  refused("elitist1 and fine cannot be compared by coverage: it depends on cells, which is 5 and 9",
    "fine", "--outcome", "coverage")
  refused('none has no qd_score: it needs an archive with cells: archive = { "grid"', "none",
    "--outcome", "qd_score")
  refused("elitist1 has no hypervolume: it needs objectives with a reference point", "--outcome",
    "hypervolume")
  refused('did you mean "coverage"?', "--outcome", "coverge")
end)

-- ---- verdicts on outcomes by hand ---------------------------------------------------------------

-- An arm of runs with these outcomes, repetitions 1, 2, ...; each took `evaluations`.
local function arm_of(name, outcomes, evaluations, supervisor)
  local arm = { name = name, runs = {}, by_pair = {} }
  for i = 1, #outcomes do
    local one = { seed = "1", repetition = i, evaluations = evaluations or 100, before = 0,
      config = { population = 10, supervisor = supervisor or name }, ledger = {},
      lines = { { evaluations = 10, best_standard = 0.5 },
        { evaluations = (evaluations or 100) - 10, best_standard = outcomes[i] or nil } } }
    arm.runs[i], arm.by_pair[arms.pair(one)] = one, one
  end
  return arm
end

local function judge(list, options)
  local outcomes = {}
  for _, arm in ipairs(list) do
    for _, one in ipairs(arm.runs) do outcomes[one] = one.lines[2].best_standard end
  end
  return verdict.compare(list, outcomes, options)
end

local function counting(n, first, step)
  local list = {}
  for i = 1, n do list[i] = first + (step or 1) * i end
  return list
end

suite:test("ten pairs of one sign are a claim, and Holm counts the arms", function(t)
  local result = judge { arm_of("fixed", counting(10, 0)), arm_of("better", counting(10, 0.5)),
    arm_of("worse", counting(10, -0.25)), arm_of("same", counting(10, 0)) }
  local test = result.arms[2].test
  t:equal({ test.name, test.p, test.p_holm, test.smallest_p_holm, result.comparisons },
    { "signed_rank", 2 / 1024, 6 / 1024, 6 / 1024, 3 })
  t:equal(result.arms[2].centre_name, "interquartile mean")
  t:near({ test.difference, test.low, test.high }, { 0.5, 0.5, 0.5 })
  for k, claim in ipairs { "^better than fixed %(p = 0.0059 after Holm", "^worse than fixed",
    "^no difference from fixed was shown %(p = 1 after Holm" } do
    t:ok(result.arms[k + 1].claim:find(claim), result.arms[k + 1].claim)
    t:equal(result.arms[k + 1].claimed, k < 3)
  end
  t:equal(result.sentences, {
    "better is better than fixed by 0.5 (95 % interval 0.5 to 0.5; p = 0.0059 after Holm) on 10"
      .. " pairs of runs.",
    "worse is worse than fixed by 0.25 (95 % interval 0.25 to 0.25; p = 0.0059 after Holm) on 10"
      .. " pairs of runs.",
    "same: no difference from fixed was shown (p = 1 after Holm). It has the same outcome as fixed"
      .. " on all 10 pairs of runs: does what differs change anything?" })
end)

suite:test("a missing pair means the unpaired test, and is named", function(t)
  local result = judge { arm_of("a", counting(6, 0)), arm_of("b", counting(5, 10)) }
  local test = result.arms[2].test
  t:equal({ test.name, test.why, test.a12, test.difference },
    { "rank_sum", "b lacks seed 1, repetition 6 of a", 1 })
  t:near(test.p, 2 / 462)
  t:ok(result.arms[2].claim:find "^better than a", result.arms[2].claim)
  t:equal(result.sentences, { "b is better than a by 9.5 (median 13 against median 3.5; p = 0.0043"
    .. " after Holm) on 5 and 6 runs." })
end)

suite:test("no claim: few runs, other evaluations, a model that was asked too little", function(t)
  -- judges against this arm, and expects this claim of the other one
  local function claims(text, n, arm, options)
    local result = judge({ arm_of("fixed", counting(n, 0)), arm }, options)
    local judged = result.arms[options and 1 or 2]
    t:ok(judged.claim:find(text), judged.claim)
    t:equal(judged.claimed, text:find "^^better" ~= nil)
    return result
  end
  claims("^too few runs for any claim: the smallest p after Holm is 0.063$", 5,
    arm_of("five", counting(5, 9)))
  claims("^no claim: 111 evaluations against 100 of fixed$", 9, arm_of("more", counting(9, 9), 111))

  local asked = arm_of("llm", counting(9, 9))
  for i, one in ipairs(asked.runs) do
    one.ledger[1] = { generation = 0, supervisor = "llm" }
    for g = 1, 10 do
      one.ledger[g + 1] = { generation = g, source = i == 1 and g <= 4 and "keep" or "model" }
    end
  end
  t:near(claims("^better than fixed", 9, asked).arms[2].model.share, 86 / 90)
  asked.runs[2].ledger[2].source = "rules"
  local result = claims("^partly model: it set 94 %%", 9, asked)
  contains(t, tables.text(result, { width = 80 }), "llm (partly model)")
  -- nor is anything claimed against such an arm
  claims("^no claim: llm is partly model: it set 94 %%", 9, asked, { baseline = "llm" })
end)

suite:test("a champion that fails at publish is the worst of all, and counted", function(t)
  local fixed, other = arm_of("fixed", counting(6, 3)), arm_of("other", counting(6, 1))
  fixed.runs[4].lines[2].best_standard = nil
  local result = judge { fixed, other }
  t:equal(result.failed_at_publish, 1)
  t:equal(result.arms[1].values, { 4, 5, 6, 2, 8, 9 })
  t:equal(result.arms[1].n, 6)
end)

suite:test("exploratory: a missed target is censored, the area is a mean", function(t)
  local result = judge({ arm_of("fixed", { 1, 2, 3 }), arm_of("other", { 1, 1, 5 }) },
    { target = 2 })
  local first, second = result.arms[1].exploratory, result.arms[2].exploratory
  t:equal({ first.reached, first.evaluations }, { 2, 100 })
  t:equal({ second.reached, second.evaluations }, { 1, nil })
  local one = { before = 20, lines = { { evaluations = 10, best_standard = 1 },
    { evaluations = 30, best_standard = 3 }, { evaluations = 10 },
    { evaluations = 10, best_standard = 2 } } }
  t:equal(measures.points(one), { { 30, 1 }, { 60, 3 }, { 70, 3 }, { 80, 2 } })
  -- 30 evaluations at 1, then 20 at 3
  t:near(measures.exploratory({ one }, 9).area, (30 * 1 + 20 * 3) / 50)
end)
