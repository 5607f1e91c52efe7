--- tables.lua: a comparison as text, HTML, CSV and JSON. Fitness has the unit of the experiment's
--- fitness; evaluations are simulations of a robot for its score.

local charts = require "limax.tools.report.charts"
local csv = require "limax.base.csv"
local host = require "limax.host"
local html = require "limax.tools.report.html"
local measures = require "limax.tools.compare.measures"
local runs = require "limax.tools.report.runs"
local sample = require "limax.base.statistics.sample"
local source = require "limax.base.source"
local terminal = require "limax.base.terminal"
local verdict = require "limax.tools.compare.verdict"

local tables = {}

local TESTS = { { "signed_rank", "Wilcoxon's exact signed-rank test of pairs" },
  { "rank_sum", "Mann and Whitney's exact test" } }

local COLUMNS = { "arm", "n", "centre", "centre_name", "evaluations", "tuning_evaluations", "donor",
  "model_share", "test", "zeros", "p", "p_holm", "smallest_p_holm", "n_for_80_percent_power",
  "difference", "difference_low", "difference_high", "a12", "claim", "reached",
  "evaluations_to_target", "mean_best_so_far", "proposed", "accepted", "clamped", "rate_limited",
  "rejected", "supervisor_failures" }

-- The arms with plain columns; text that only tables show is in `label` and `values`.
local function rows_of(result)
  local rows = {}
  for i, arm in ipairs(result.arms) do
    local test, e = arm.test or {}, arm.exploratory
    local partly = arm.model and arm.model.share < measures.WHOLE
    rows[i] = { arm = arm.name, n = arm.n, centre = arm.centre, centre_name = arm.centre_name,
      evaluations = arm.evaluations, tuning_evaluations = arm.tuning, donor = arm.donor,
      model_share = arm.model and arm.model.share, test = test.name, zeros = test.zeros, p = test.p,
      p_holm = test.p_holm, smallest_p_holm = test.smallest_p_holm,
      n_for_80_percent_power = test.needed, difference = test.difference,
      difference_low = test.low, difference_high = test.high, a12 = test.a12, claim = arm.claim,
      reached = e.reached, evaluations_to_target = e.evaluations, mean_best_so_far = e.area,
      supervisor_failures = arm.supervisor_failures, values = arm.values,
      label = partly and arm.name .. " (partly model)" or arm.name }
    for name, value in pairs(arm.proposals) do rows[i][name] = value end
  end
  return rows
end

-- The name of the arms' centres: the median with few runs, else the interquartile mean.
local function centre_name(result)
  local name
  for _, arm in ipairs(result.arms) do
    if name and arm.centre_name ~= name then return "centre" end
    name = arm.centre_name
  end
  return name == "median" and name or "IQM"
end

-- "a to b" of the values, or all of them where they are few.
local function spread(row)
  local sorted, texts = { unpack(row.values) }, {}
  table.sort(sorted)
  for i, value in ipairs(sorted) do texts[i] = ("%.4g"):format(value) end
  if #texts >= sample.LEAST_FOR_MEAN then return texts[1] .. " to " .. texts[#texts] end
  return table.concat(texts, " ")
end

local function main_table(result)
  return { { "arm", "label" }, { "n" }, { centre_name(result), "centre", "%.4g" },
    { "values", spread }, { "evaluations", "evaluations", "%.0f" },
    { "difference", "difference", "%+.4g" },
    { "95 %", function(row)
      return row.difference_low
        and ("%+.4g to %+.4g"):format(row.difference_low, row.difference_high)
    end },
    { "A12", "a12", "%.2f" }, { "p", "p", "%.3g" }, { "Holm", "p_holm", "%.3g" } }
end

local EXPLORATORY = { { "arm" },
  { "reached", function(row) return ("%d of %d"):format(row.reached, row.n) end },
  { "evaluations to it", function(row)
    return row.evaluations_to_target and ("%.0f"):format(row.evaluations_to_target) or "missed"
  end },
  { "mean best so far", "mean_best_so_far", "%.4g" } }

local function percent(title, field)
  return { title, function(row) return row[field] and ("%.1f %%"):format(100 * row[field]) end }
end

local PROPOSALS = { { "arm" }, { "fields proposed", "proposed" }, percent("accepted", "accepted"),
  percent("clamped", "clamped"), percent("rate-limited", "rate_limited"),
  percent("rejected", "rejected") }

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
    add(all and "every arm" or table.concat(names[text], "; "), text)
  end
end

-- How the tests were chosen, what they can show, and what else there is to know about the arms.
local function add_notes(result, add)
  for _, each in ipairs(TESTS) do
    by_text(result, function(arm) return arm.test and arm.test.name == each[1] and arm.test.why end,
      function(names, why) add(("%s for %s: %s."):format(each[2], names, why)) end)
  end
  by_text(result, function(arm)
    local test = arm.test
    return test and ("n = %d: the smallest p after Holm over %d is %.2g; 80 %% power at d = 1"
      .. " takes n = %s."):format(arm.n, result.comparisons, test.smallest_p_holm,
      test.needed and tostring(test.needed) or "more than 100")
  end, function(_, text) add(text) end)
  if centre_name(result) == "centre" then
    add(("centre: the interquartile mean (IQM) from %d runs up, else the median."):format(
      sample.LEAST_FOR_MEAN))
  end
  if result.failed_at_publish > 0 then
    add(("%d champions fail at publish: they count as the worst outcome of all runs.")
      :format(result.failed_at_publish))
  end
  for _, arm in ipairs(result.arms) do
    if arm.model then
      add(("%s: the model set %.1f %% of %d generations."):format(arm.name, 100 * arm.model.share,
        arm.model.generations))
    end
    if arm.supervisor_failures then
      add(("%s: %s."):format(arm.name, arm.supervisor_failures))
    end
    if arm.donor then add(("%s: %s."):format(arm.name, arm.donor)) end
    if arm.tuning > 0 then
      add(("%s: %.0f of its evaluations were spent on tuning."):format(arm.name, arm.tuning))
    end
  end
end

local function exploratory_text(result)
  return (", no claims: runs whose best_standard reached %.4g (%s), and the mean of the best so far"
    .. " over evaluations"):format(result.target, result.target_given and "--target"
    or "the centre of the baseline's last generations")
end

-- The rows of arms for which something was proposed.
local function proposed_of(rows)
  local list = {}
  for _, row in ipairs(rows) do list[#list + 1] = row.proposed > 0 and row or nil end
  return list
end

--- The comparison as text for a terminal.
function tables.text(result, style)
  local rows = rows_of(result)
  local proposed = proposed_of(rows)
  local parts = { terminal.bold("Outcome: ", style) .. result.outcome,
    ("Baseline: %s"):format(result.baseline), "", table.concat(result.sentences, "\n"), "",
    terminal.rows(main_table(result), rows, style), "" }
  local function add(text) parts[#parts + 1] = text end
  add_notes(result, add)
  add ""
  add(terminal.bold("Exploratory", style) .. exploratory_text(result))
  add(terminal.rows(EXPLORATORY, rows, style))
  if #proposed > 0 then add("\n" .. terminal.rows(PROPOSALS, proposed, style)) end
  return table.concat(parts, "\n") .. "\n"
end

-- A table of a page, which formats numbers itself.
local function html_table(columns, rows, caption)
  local plain = {}
  for c, column in ipairs(columns) do plain[c] = { column[1], column[2] } end
  local head, cells = terminal.cells(plain, rows, "-")
  return html.table(head, cells, caption)
end

--- The same for a page.
function tables.html(result)
  local rows, parts = rows_of(result), {}
  local proposed = proposed_of(rows)
  local function paragraph(class, text)
    parts[#parts + 1] = ("<p%s>%s</p>\n"):format(class, html.escaped(text))
  end
  local function note(text) paragraph(' class="note"', text) end
  for _, text in ipairs(result.sentences) do paragraph("", text) end
  parts[#parts + 1] = html_table(main_table(result), rows,
    ("Outcome: %s; baseline: %s"):format(result.outcome, result.baseline))
  add_notes(result, note)
  parts[#parts + 1] = html_table(EXPLORATORY, rows, "Exploratory" .. exploratory_text(result))
  if #proposed > 0 then
    parts[#parts + 1] = html_table(PROPOSALS, proposed, "Fields that supervisors proposed")
  end
  return table.concat(parts)
end

--- A line per arm.
function tables.csv(result) return csv.encode(COLUMNS, rows_of(result)) end

--- Everything, with the outcome of every run.
function tables.json(result)
  local list = host.json.array(rows_of(result))
  for i, arm in ipairs(result.arms) do
    local row = list[i]
    row.values, row.label, row.runs = nil, nil, host.json.array {}
    row.claimed, row.why = arm.claimed, arm.test and arm.test.why
    for k, run in ipairs(arm.runs) do
      row.runs[k] = { seed = run.seed, repetition = run.repetition, outcome = arm.values[k],
        evaluations = run.evaluations, mean_best_so_far = arm.exploratory.areas[k],
        evaluations_to_target = arm.exploratory.to_target[k] }
    end
  end
  return host.json.encode({ schema = "limax.compare/1", outcome = result.outcome,
    baseline = result.baseline, level = verdict.LEVEL, comparisons = result.comparisons,
    failed_at_publish = result.failed_at_publish, target = result.target, arms = list },
    { indent = 2 }) .. "\n"
end

--- Writes a comparison in every form, and the figures of a report.
function tables.write(path, result, list)
  local unit = runs.fitness_words(list[1].runs[1].config.fitness)
  charts.write(path, list, ("fitness (%s)"):format(unit or "unit of the script"))
  for ending, text in pairs {
    txt = tables.text(result, { color = false, ascii = true, width = 80 }),
    csv = tables.csv(result), json = tables.json(result),
  } do source.write(("%s/compare.%s"):format(path, ending), text) end
end

return tables
