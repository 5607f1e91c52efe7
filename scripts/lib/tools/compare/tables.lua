--- tables.lua: a comparison as text, CSV, JSON and LaTeX. Fitness has the unit of the experiment's
--- fitness; evaluations are simulations of a robot for its score.

local csv = require "limax.base.csv"
local host = require "limax.host"
local ledgers = require "limax.tools.compare.ledgers"
local outcome = require "limax.tools.compare.outcome"
local sample = require "limax.base.statistics.sample"
local terminal = require "limax.base.terminal"
local verdict = require "limax.tools.compare.verdict"

local tables = {}

local TESTS = { signed_rank = "Wilcoxon's exact signed-rank test of pairs",
  rank_sum = "Mann and Whitney's exact test" }

local function number(value, pattern) return value and (pattern or "%.4g"):format(value) or "-" end

-- "a to b" of a list, or all of it where it is short.
local function spread(values)
  local sorted, texts = { unpack(values) }, {}
  table.sort(sorted)
  for i, value in ipairs(sorted) do texts[i] = ("%.4g"):format(value) end
  if #texts >= sample.LEAST_FOR_MEAN then return texts[1] .. " to " .. texts[#texts] end
  return table.concat(texts, " ")
end

-- What the centres of all arms are: with few runs a median, else the interquartile mean.
local function centre_name(result)
  local name
  for _, arm in ipairs(result.arms) do
    if name and arm.centre_name ~= name then return "centre" end
    name = arm.centre_name
  end
  return name == "median" and name or "IQM"
end

local function full_name(arm)
  local partly = arm.model and arm.model.share < ledgers.WHOLE
  return partly and arm.name .. " (partly model)" or arm.name
end

-- ---- text ---------------------------------------------------------------------------------------

local function main_table(result, style)
  local rows = {}
  for i, arm in ipairs(result.arms) do
    local test = arm.test or {}
    rows[i] = { full_name(arm), arm.n, number(arm.centre), spread(arm.values),
      number(arm.evaluations, "%.0f"), number(test.difference, "%+.4g"),
      test.low and ("%+.4g to %+.4g"):format(test.low, test.high) or "-",
      number(test.a12, "%.2f"), number(test.p, "%.3g"), number(test.p_holm, "%.3g") }
  end
  return terminal.table({ "arm", "n", centre_name(result), "values", "evaluations",
    "difference", "95 %", "A12", "p", "Holm" }, rows, style)
end

local function exploratory_table(result, style)
  local rows = {}
  for i, arm in ipairs(result.arms) do
    local e = arm.exploratory
    rows[i] = { arm.name, ("%d of %d"):format(e.reached, arm.n),
      e.evaluations and ("%.0f"):format(e.evaluations) or "missed", number(e.area) }
  end
  return terminal.table({ "arm", "reached", "evaluations to it", "mean best so far" }, rows, style)
end

-- The outcomes of proposed fields, of the arms that proposed any.
local function proposal_table(result, style)
  local rows = {}
  for _, arm in ipairs(result.arms) do
    local row = { arm.name, arm.proposals.proposed }
    for k, name in ipairs(ledgers.SHARES) do
      row[k + 2] = number(arm.proposals[name] and 100 * arm.proposals[name], "%.1f %%")
    end
    if arm.proposals.proposed > 0 then rows[#rows + 1] = row end
  end
  if #rows == 0 then return nil end
  return terminal.table({ "arm", "fields proposed", "accepted", "clamped", "rate-limited",
    "rejected" }, rows, style)
end

-- Calls `add` with the names of the arms for which `text_of` returns the same text, and that text.
local function by_text(result, text_of, add)
  local list, names = {}, {}
  for _, arm in ipairs(result.arms) do
    local text = text_of(arm)
    if text and not names[text] then
      names[text] = {}
      list[#list + 1] = text
    end
    if text then table.insert(names[text], arm.name) end
  end
  for _, text in ipairs(list) do
    local all = #names[text] > 2 and #names[text] == result.comparisons
    add(all and "every arm" or table.concat(names[text], ", "), text)
  end
end

-- How the tests were chosen, and what they can show.
local function add_tests(result, add)
  for _, name in ipairs { "signed_rank", "rank_sum" } do
    by_text(result, function(arm) return arm.test and arm.test.name == name and arm.test.why end,
      function(names, why) add(("%s for %s: %s."):format(TESTS[name], names, why)) end)
  end
  by_text(result, function(arm)
    local test = arm.test
    return test and ("n = %d: the smallest p after Holm over %d is %.2g; 80 %% power at d = 1"
      .. " takes n = %s."):format(arm.n, result.comparisons, test.smallest_p_holm,
      test.needed and tostring(test.needed) or "more than 100")
  end, function(_, text) add(text) end)
end

local function add_about_arms(result, add)
  for _, arm in ipairs(result.arms) do
    if arm.model then
      add(("%s: the model set %.1f %% of %d generations."):format(arm.name, 100 * arm.model.share,
        arm.model.generations))
    end
    if arm.donor then add(("%s: %s."):format(arm.name, arm.donor)) end
    if arm.tuning > 0 then
      add(("%s: %.0f of its evaluations were spent on tuning."):format(arm.name, arm.tuning))
    end
  end
end

--- The comparison as text for a terminal.
---@param result table of verdict.compare
function tables.text(result, style)
  local parts = { terminal.bold("Outcome: ", style) .. outcome.TEXT,
    ("Baseline: %s"):format(result.baseline), "", main_table(result, style), "" }
  local function add(text) parts[#parts + 1] = text end
  add_tests(result, add)
  if centre_name(result) == "centre" then
    add(("centre: the interquartile mean (IQM) from %d runs up, else the median."):format(
      sample.LEAST_FOR_MEAN))
  end
  if result.failed_at_publish > 0 then
    add(("%d champions fail at publish: they count as the worst outcome of all runs.")
      :format(result.failed_at_publish))
  end
  add ""
  by_text(result, function(arm) return arm.claim end,
    function(names, claim) add(("%s: %s."):format(names, claim)) end)
  add_about_arms(result, add)
  if result.comparisons == 0 then add "Only one arm: there is nothing to compare it with." end
  add ""
  add(terminal.bold("Exploratory", style) .. (", no claims: runs whose best_standard reached %.4g "
    .. "(%s), and the mean of the best so far over evaluations"):format(result.target,
    result.target_given and "--target" or "the centre of the baseline's last generations"))
  add(exploratory_table(result, style))
  local proposed = proposal_table(result, style)
  if proposed then add("\n" .. proposed) end
  return table.concat(parts, "\n") .. "\n"
end

-- ---- for other programs -------------------------------------------------------------------------

local COLUMNS = { "arm", "n", "centre", "centre_name", "evaluations", "tuning_evaluations", "donor",
  "model_share", "test", "zeros", "p", "p_holm", "smallest_p_holm", "n_for_80_percent_power",
  "difference", "difference_low", "difference_high", "a12", "claim", "reached",
  "evaluations_to_target", "mean_best_so_far", "proposed", "accepted", "clamped", "rate_limited",
  "rejected" }

-- One arm as plain columns.
local function row_of(arm)
  local test, e = arm.test or {}, arm.exploratory
  local row = { arm = arm.name, n = arm.n, centre = arm.centre, centre_name = arm.centre_name,
    evaluations = arm.evaluations, tuning_evaluations = arm.tuning, donor = arm.donor,
    model_share = arm.model and arm.model.share, test = test.name, zeros = test.zeros, p = test.p,
    p_holm = test.p_holm, smallest_p_holm = test.smallest_p_holm,
    n_for_80_percent_power = test.needed, difference = test.difference, difference_low = test.low,
    difference_high = test.high, a12 = test.a12, claim = arm.claim, reached = e.reached,
    evaluations_to_target = e.evaluations, mean_best_so_far = e.area }
  for name, value in pairs(arm.proposals) do row[name] = value end
  return row
end

--- A line per arm.
function tables.csv(result)
  local rows = {}
  for i, arm in ipairs(result.arms) do rows[i] = row_of(arm) end
  return csv.encode(COLUMNS, rows)
end

--- Everything, with the outcome of every run.
function tables.json(result)
  local list = host.json.array {}
  for i, arm in ipairs(result.arms) do
    local row = row_of(arm)
    row.claimed, row.why, row.runs = arm.claimed, arm.test and arm.test.why, host.json.array {}
    for k, run in ipairs(arm.runs) do
      row.runs[k] = { seed = run.seed, repetition = run.repetition, outcome = arm.values[k],
        evaluations = run.evaluations, mean_best_so_far = arm.exploratory.areas[k],
        evaluations_to_target = arm.exploratory.to_target[k] }
    end
    list[i] = row
  end
  return host.json.encode({ schema = "limax.compare/1", outcome = outcome.TEXT,
    baseline = result.baseline, level = verdict.LEVEL, comparisons = result.comparisons,
    failed_at_publish = result.failed_at_publish, target = result.target, arms = list },
    { indent = 2 }) .. "\n"
end

local LATEX = { ["_"] = "\\_", ["%"] = "\\%", ["&"] = "\\&", ["#"] = "\\#", ["$"] = "\\$",
  ["{"] = "\\{", ["}"] = "\\}", ["~"] = "\\textasciitilde{}", ["^"] = "\\textasciicircum{}",
  ["\\"] = "\\textbackslash{}", ["<"] = "\\textless{}", [">"] = "\\textgreater{}" }

--- A table of the package booktabs.
function tables.latex(result)
  local lines = { "% needs \\usepackage{booktabs}", "\\begin{tabular}{lrrrrrr}", "\\toprule",
    ("arm & $n$ & %s & difference & $A_{12}$ & $p$ & $p_{\\mathrm{Holm}}$ \\\\"):format(
      centre_name(result)), "\\midrule" }
  local function cell(value, pattern) return value and pattern:format(value) or "--" end
  for _, arm in ipairs(result.arms) do
    local test, name = arm.test or {}, full_name(arm):gsub("[_%%&#${}~^\\<>]", LATEX)
    lines[#lines + 1] = ("%s & %d & %s & %s & %s & %s & %s \\\\"):format(name, arm.n,
      number(arm.centre), test.difference and ("%.4g [%.4g, %.4g]"):format(test.difference,
      test.low, test.high) or "--", cell(test.a12, "%.2f"), cell(test.p, "%.3g"),
      cell(test.p_holm, "%.3g"))
  end
  lines[#lines + 1] = "\\bottomrule"
  lines[#lines + 1] = "\\end{tabular}"
  return table.concat(lines, "\n") .. "\n"
end

return tables
