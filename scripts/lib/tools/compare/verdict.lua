--- verdict.lua: each arm of a comparison against the baseline: an exact test of the one primary
--- outcome, adjusted by Holm; everything else is exploratory. A claim needs enough runs, equal
--- evaluations and, for a language model, that it set nearly all generations.

local arms = require "limax.tools.report.arms"
local bootstrap = require "limax.base.statistics.bootstrap"
local failure = require "limax.base.failure"
local folders = require "limax.tools.report.runs"
local holm = require "limax.base.statistics.holm"
local measures = require "limax.tools.compare.measures"
local outcome = require "limax.tools.compare.outcome"
local power = require "limax.base.statistics.power"
local rank_sum = require "limax.base.statistics.rank_sum"
local sample = require "limax.base.statistics.sample"
local signed_rank = require "limax.base.statistics.signed_rank"
local suggest = require "limax.engine.suggest"

local verdict = {}

--- A claim's level, after Holm.
verdict.LEVEL = 0.05
-- the effect, in standard deviations, for which the number of runs needed is reported
local EFFECT = 1

-- The values of a list, by `value_of`.
local function each(list, value_of)
  local values = {}
  for i, run in ipairs(list) do values[i] = value_of(run) end
  return values
end

-- A champion that fails at `publish` has no outcome: it counts as the worst of all that have one.
local function fill_worst(all, outcomes)
  local worst, filled = math.huge, 0
  for _, run in ipairs(all) do worst = math.min(worst, outcomes[run] or math.huge) end
  if worst == math.huge then failure.raise(1, "the champions of all runs fail at publish") end
  for _, run in ipairs(all) do
    if not outcomes[run] then outcomes[run], filled = worst, filled + 1 end
  end
  return filled
end

-- The arm that the others are compared with.
local function find_baseline(list, wanted)
  local names = {}
  for i, arm in ipairs(list) do
    names[i] = arm.name
    if arm.name == (wanted or "fixed") then return arm end
  end
  if not wanted then return list[1] end
  failure.raise(2, ("--baseline %s: there is no such arm%s"):format(wanted,
    suggest.ending(wanted, names)))
end

-- A pair that one arm has and another lacks: "a lacks seed 1, repetition 3 of b".
local function lacking(arm, other)
  for _, run in ipairs(arm.runs) do
    if not other.by_pair[arms.pair(run)] then
      return ("%s lacks seed %s, repetition %d of %s"):format(other.name, run.seed, run.repetition,
        arm.name)
    end
  end
end

-- One arm's outcomes against the baseline's.
local function test_of(arm, baseline, outcomes)
  local unpaired = lacking(arm, baseline) or lacking(baseline, arm)
  local function value_of(run) return outcomes[run] end
  local mine, its = each(arm.runs, value_of), each(baseline.runs, value_of)
  local sums = rank_sum.test(mine, its)
  local test = { a12 = sums.a12 }
  if unpaired then
    test.name, test.why, test.p = "rank_sum", unpaired, sums.p
    test.smallest_p = rank_sum.smallest_p(#mine, #its)
    return test
  end
  local differences = {}
  -- both arms are in the order of their pairs
  for i, value in ipairs(mine) do differences[i] = value - its[i] end
  local ranks = signed_rank.test(differences)
  test.name, test.why = "signed_rank", "every seed and repetition is in both arms"
  test.p, test.zeros = ranks.p, ranks.zeros
  test.smallest_p = signed_rank.smallest_p(#mine)
  test.difference = sample.centre(differences)
  test.low, test.high = bootstrap.interval(differences, sample.centre)
  return test
end

-- Is the arm's outcome above the baseline's?
local function is_better(test)
  return test.name == "signed_rank" and test.difference > 0
    or test.name == "rank_sum" and test.a12 > 0.5
end

-- The result for an arm, and whether it is a claim.
local function claim_of(arm, baseline, test, most_apart)
  for _, either in ipairs { arm, baseline } do
    if either.unsupervised then
      return ("no claim: the supervisor of %s failed in every generation"):format(
        either.name), false
    end
    local share = either.model and either.model.share
    if share and share < measures.WHOLE then
      return ("%spartly model: it set %.0f %% of the generations, a claim needs %.0f %%"):format(
        either == arm and "" or ("no claim: %s is "):format(baseline.name), 100 * share,
        100 * measures.WHOLE), false
    end
  end
  local apart = math.abs(arm.evaluations - baseline.evaluations)
  if apart > most_apart then
    return ("no claim: %g evaluations against %g of %s"):format(arm.evaluations,
      baseline.evaluations, baseline.name), false
  end
  if test.smallest_p_holm > verdict.LEVEL then
    return ("too few runs for any claim: the smallest p after Holm is %.2g"):format(
      test.smallest_p_holm), false
  end
  if test.p_holm > verdict.LEVEL then
    return ("no difference from %s was shown (p = %.2g after Holm)"):format(baseline.name,
      test.p_holm), false
  end
  return ("%s %s (p = %.2g after Holm, A12 = %.2f)"):format(
    is_better(test) and "better than" or "worse than", baseline.name, test.p_holm, test.a12), true
end

-- An arm against the baseline in sentences: which is better, by how much, how sure that is, and on
-- how many runs.
local function in_words(row, baseline, unit)
  local test, better = row.test, is_better(row.test)
  local difference = test.difference or row.centre - baseline.centre
  -- ranks and centres may differ in their direction: then there is no "better by"
  local by = row.claimed and (better and difference > 0 or not better and difference < 0)
  local about, on
  if test.difference then
    local low, high = test.low, test.high
    if by and not better then low, high = -high, -low end
    about = ("95 %% interval %.3g to %.3g"):format(low, high)
    on = row.n == 1 and "1 pair of runs" or ("%d pairs of runs"):format(row.n)
  else
    about = ("%s %.4g against %s %.4g"):format(row.centre_name, row.centre, baseline.centre_name,
      baseline.centre)
    on = ("%d and %d runs"):format(row.n, baseline.n)
  end
  if test.zeros == row.n then
    return ("%s: %s. It has the same outcome as %s on %s%s: does what differs change anything?")
      :format(row.name, row.claim, baseline.name, row.n > 1 and "all " or "", on)
  end
  unit = unit and unit ~= "1" and " " .. unit or ""
  if not by then
    return ("%s: %s. Its difference from %s is %+.3g%s (%s) on %s."):format(row.name, row.claim,
      baseline.name, difference, unit, about, on)
  end
  return ("%s is %s than %s by %.3g%s (%s; p = %.2g after Holm) on %s."):format(row.name,
    better and "better" or "worse", baseline.name, math.abs(difference), unit, about, test.p_holm,
    on)
end

-- Adds what depends on the number of tests: p after Holm, the smallest possible, and the number of
-- runs for a power of 80 %.
local function adjust(tests)
  local p, needed = each(tests, function(test) return test.p end), {}
  for k, adjusted in ipairs(holm.adjust(p)) do
    local test = tests[k]
    test.p_holm, test.smallest_p_holm = adjusted, math.min(1, #tests * test.smallest_p)
    needed[test.name] = needed[test.name]
      or { power.runs_needed(test.name, EFFECT, verdict.LEVEL / #tests) }
    test.needed = needed[test.name][1]
  end
end

--- The comparison of runs whose outcomes were measured, as a table of plain values; `sentences`
--- has the result for each arm in words.
---@param outcomes table<limax.report.run, number> filled up here
---@param options { baseline: string|nil, target: number|nil, outcome: string|nil }|nil see
--- `limax compare --help`; `outcome` is what was measured, in words
function verdict.compare(list, outcomes, options)
  options = options or {}
  local filled = fill_worst(folders.of(list), outcomes)
  local baseline = find_baseline(list, options.baseline)
  local target = options.target or sample.centre(each(baseline.runs, measures.last))
  local result = { baseline = baseline.name, failed_at_publish = filled, target = target,
    target_given = options.target ~= nil, outcome = options.outcome or outcome.TEXT, arms = {},
    sentences = {} }
  local tests, baseline_row = {}, nil
  for i, arm in ipairs(list) do
    local values = each(arm.runs, function(run) return outcomes[run] end)
    local centre, name = sample.centre(values)
    local row = { name = arm.name, runs = arm.runs, n = #values, values = values, centre = centre,
      centre_name = name, donor = arm.donor, model = measures.model(arm.runs),
      evaluations = sample.median(each(arm.runs, function(run) return run.evaluations end)),
      tuning = sample.median(each(arm.runs, function(run) return run.before end)),
      exploratory = measures.exploratory(arm.runs, target),
      proposals = measures.proposals(arm.runs) }
    row.supervisor_failures, row.unsupervised = folders.supervisor_failures(arm.runs)
    if arm == baseline then
      baseline_row = row
    else
      row.test = test_of(arm, baseline, outcomes)
      tests[#tests + 1] = row.test
    end
    result.arms[i] = row
  end
  adjust(tests)
  local unit = not options.outcome and folders.fitness_words(list[1].runs[1].config.fitness)
  for _, row in ipairs(result.arms) do
    if row.test then
      row.claim, row.claimed =
        claim_of(row, baseline_row, row.test, list[1].runs[1].config.population)
      table.insert(result.sentences, in_words(row, baseline_row, unit))
    end
  end
  if #tests == 0 then
    result.sentences[1] = "Only one arm: there is nothing to compare it with."
  end
  result.comparisons = #tests
  return result
end

return verdict
