--- targets.lua: the numbers that limax sets itself: what is asked and hoped for, what was measured,
--- whether it is met. A number that was not measured, or not at the size that is asked for, is said
--- to be so, never met.

local methods = require "limax.tools.bench.accuracy.methods"
local sample = require "limax.base.statistics.sample"
local terminal = require "limax.base.terminal"
local walkers = require "limax.tools.bench.accuracy.walkers"

local targets = {}

targets.COLUMNS = { "target", "asked", "aim", "measured", "limit", "met", "aim_limit", "aim_met",
  "note" }

-- The rows of a section that have all these fields.
local function rows_with(results, section, fields)
  local list = {}
  for _, row in ipairs(results[section] and results[section].rows or {}) do
    local fits = true
    for name, value in pairs(fields) do fits = fits and row[name] == value end
    if fits then list[#list + 1] = row end
  end
  return list
end

local function value_of(results, section, fields, name)
  local row = rows_with(results, section, fields)[1]
  return row and row[name]
end

-- The chaos floor's row of the same population.
local function floor_of(results, row)
  return rows_with(results, "ranking",
    { case = row.case, population = row.population, setting = "chaos floor" })[1]
end

-- The largest regret of the tier `evolve` beyond what is allowed there, and the largest price.
local function elite_regret(results)
  local worst, limit, price
  for _, row in ipairs(rows_with(results, "ranking", { tier = "evolve" })) do
    local floor = (floor_of(results, row) or {}).elite_regret
    if row.elite_regret and floor then
      local allowed = math.max(0.05, 2 * floor)
      if not worst or row.elite_regret - allowed > worst - limit then
        worst, limit = row.elite_regret, allowed
      end
      price = math.max(price or 0, row.relative_to_paper or 0)
    end
  end
  return worst, limit, price
end

local function least_tau(results)
  local worst, limit, aim, robots, floor_there
  for _, row in ipairs(rows_with(results, "ranking", { tier = "evolve", population = "random" })) do
    local floor = (floor_of(results, row) or {}).tau
    if row.tau and floor then
      local asked = math.min(0.95, floor - 0.02)
      if not worst or row.tau - asked < worst - limit then
        worst, limit, aim = row.tau, asked, math.min(0.98, floor)
        robots, floor_there = row.robots, floor
      end
    end
  end
  return { tau = worst, limit = limit, aim = aim, robots = robots, floor = floor_there }
end

-- Cases of the ranking that were measured, with both populations.
local function ranked_cases(results)
  local seen, count = {}, 0
  for _, row in ipairs(rows_with(results, "ranking", { tier = "evolve" })) do
    if row.elite_regret and not seen[row.case] then seen[row.case], count = true, count + 1 end
  end
  return count
end

-- Medians over the seeds of the tier `evolve` against the paper's setting.
local function final_best(results)
  local best, price = {}, {}
  for _, row in ipairs(rows_with(results, "evolutions", { setting = "evolve" })) do
    best[#best + 1], price[#price + 1] = row.best_relative_to_paper, row.relative_to_paper
  end
  return sample.median(best), sample.median(price)
end

-- The larger over both smooth scenes of leapfrog's error at 20 times the paper's step over that of
-- the paper's integrator at the paper's step: with sums compensated in both, so that integrators
-- are compared, and with the paper's in plain fp32.
local function smooth_error(results)
  local worst, plain
  for _, scene in ipairs { "free", "air" } do
    local function error_of(integrator, precision, time_step)
      return value_of(results, "work_precision", { scene = scene, integrator = integrator,
        precision = precision, time_step = time_step }, "error")
    end
    local paper = methods.PAPER
    local cheap = error_of("leapfrog", "compensated", 20 * paper.time_step)
    local summed = error_of(paper.integrator, "compensated", paper.time_step)
    local rounded = error_of(paper.integrator, paper.precision, paper.time_step)
    if cheap and summed then worst = math.max(worst or 0, cheap / summed) end
    if cheap and rounded then plain = math.max(plain or 0, cheap / rounded) end
  end
  return worst, plain
end

-- Compensated sums against plain ones at the paper's step: the median over the scenes of leapfrog's
-- price, as a share; and on the smooth scenes, for the paper's integrator, how many times smaller
-- the error is (the least) and how many times double's (the most).
local function compensation(results)
  local price, gain, beside_double = {}, nil, nil
  local function error_of(scene, precision)
    return value_of(results, "work_precision", { scene = scene,
      integrator = methods.PAPER.integrator, precision = precision,
      time_step = methods.PAPER.time_step }, "error")
  end
  for _, row in ipairs(rows_with(results, "work_precision", { integrator = "leapfrog",
    precision = "compensated", time_step = methods.PAPER.time_step })) do
    local plain = rows_with(results, "work_precision", { scene = row.scene,
      integrator = "leapfrog", precision = "single", time_step = row.time_step })[1]
    if row.error and plain and plain.error and not row.tier and not plain.tier then
      price[#price + 1] = row.seconds_per_second / plain.seconds_per_second - 1
    end
  end
  for _, scene in ipairs { "free", "air" } do
    local single, compensated, double = error_of(scene, "single"), error_of(scene, "compensated"),
      error_of(scene, "double")
    if single and compensated and double then
      gain = math.min(gain or math.huge, single / compensated)
      beside_double = math.max(beside_double or 0, compensated / double)
    end
  end
  return sample.median(price), gain, beside_double
end

-- Error of fp32 with compensated sums on the way over that at rest: the geometric mean over the
-- steps. Both errors are rounding alone (double is a hundred times nearer), so that one body's
-- ratio is luck: its logarithm has a standard deviation of 0.3, and eight bodies at one step leave
-- 0.11.
local function way_ratio(results)
  local sum, count, metres = 0, 0, nil
  for _, row in ipairs(rows_with(results, "rounding", { precision = "compensated" })) do
    local home = row.way > 0 and row.error and value_of(results, "rounding",
      { precision = "compensated", way = 0, duration = row.duration, time_step = row.time_step },
      "error")
    if home then
      sum, count, metres = sum + math.log(row.error / home), count + 1, row.way
    end
  end
  if count > 0 then return math.exp(sum / count), metres end
end

local function kept(results, scene, field)
  local row = rows_with(results, "conservation",
    { scene = scene, integrator = "leapfrog", precision = "compensated" })[1]
  if not row or not row[field] then return nil end
  return math.abs(row[field]), row.steps
end

-- Random bodies that several searches saw, and how many failed; a body that two of them saw counts
-- once, its failure twice.
local function searched(results)
  local rows, seen = rows_with(results, "robustness", { what = "blow-ups" }), 0
  local count, failed
  table.sort(rows, function(a, b) return a.first < b.first end)
  for _, row in ipairs(rows) do
    local last = row.first + row.count - 1
    count = (count or 0) + math.max(0, last - math.max(row.first - 1, seen))
    failed, seen = (failed or 0) + row.failed, math.max(seen, last)
  end
  return count, failed
end

-- The matrix of hard cases: the fewest cases of those that were run, all failures, the devices.
local function hard_cases(results)
  local count, failed, devices = nil, nil, {}
  for _, row in ipairs(rows_with(results, "robustness", { what = "hard cases" })) do
    count, failed = math.min(count or math.huge, row.count), (failed or 0) + row.failed
    devices[#devices + 1] = row.devices
  end
  return count, failed, table.concat(devices, ", ")
end

-- Bodies that a search must have seen for its least and its aim.
local BODIES, BODIES_HOPED = 1e5, 1e7
-- Hard cases, without the one that no body of voxels can be put to.
local HARD_CASES, HARD_CASES_HOPED = 57, 70
-- Steps and way that are asked for.
local VIBRATION, SPIN, WAY = 1e7, 1e6, 100
-- Scenes that limax ships: walkers.CASES.
local SCENES = #walkers.CASES

-- What is asked of the tier `evolve` and of whole evolutions.
local function of_evolve(results)
  local regret, regret_limit, price = elite_regret(results)
  local tau = least_tau(results)
  local best, best_price = final_best(results)
  local cases = ranked_cases(results)
  local few = cases < SCENES and ("%d of %d scenes"):format(cases, SCENES) or nil
  -- the worst of some scenes may be missed, and cannot be met
  return {
    { name = "elite regret of evolve, worst population", value = regret, partial = few,
      most = regret_limit or 0.05, asked = "5 % or 2 x chaos floor", aim = "2 %", aim_most = 0.02 },
    { name = "price of evolve in the paper's", value = price, partial = few, most = 0.1,
      asked = "1/10" },
    { name = ("tau of evolve, %s random bodies, worst scene"):format(tau.robots or "48"),
      value = tau.tau, partial = few, least = tau.limit or 0.95,
      asked = "min(0.95, floor - 0.02)",
      aim = "min(0.98, floor)", aim_least = tau.aim or 0.98,
      note = tau.floor and ("chaos floor %.3f"):format(tau.floor) },
    { name = "final best of evolutions, evolve over paper, median", value = best, least = 0.95,
      asked = "0.95", aim = "1", aim_least = 1 },
    { name = "price of those evolutions in the paper's, median", value = best_price, most = 0.1,
      asked = "1/10", aim = "1/25", aim_most = 0.04 },
  }
end

local function of_errors(results)
  local extra, gain, beside_double = compensation(results)
  local smooth, of_plain = smooth_error(results)
  local way, metres = way_ratio(results)
  local energy, energy_steps = kept(results, "vibration", "energy_drift")
  local momentum, spin_steps = kept(results, "spin", "momentum_drift")
  local spin_energy = kept(results, "spin", "energy_drift")
  local single = value_of(results, "rounding", { precision = "single", start = 1024 }, "same_bits")
  local compensated =
    value_of(results, "rounding", { precision = "compensated", start = 1024 }, "same_bits")
  local moved
  if single ~= nil and compensated ~= nil then moved = single and compensated and 0 or 1 end
  -- a number of fewer steps is no answer
  local function short(got, asked, unit)
    return got and got < asked and ("measured over %g %s, asked over %g"):format(got, unit, asked)
      or nil
  end
  return {
    { name = "energy drift, vibrating, leapfrog compensated, 1e7 steps", value = energy,
      most = 1e-4, asked = "1e-4", aim = "2e-5", aim_most = 2e-5,
      short = short(energy_steps, VIBRATION, "steps") },
    { name = "angular momentum, free spin of 1e6 steps", value = momentum, most = 1e-6,
      asked = "1e-6", aim = "1e-7", aim_most = 1e-7, short = short(spin_steps, SPIN, "steps") },
    { name = "energy, free spin of 1e6 steps", value = spin_energy, most = 5e-5, asked = "5e-5",
      aim = "1e-6", aim_most = 1e-6, short = short(spin_steps, SPIN, "steps") },
    { name = "smooth error at 20 times the paper's step, of the paper's",
      value = smooth, most = 1, asked = "1", aim = "1/3", aim_most = 1 / 3,
      note = of_plain and ("sums compensated in both; of the paper's in plain fp32 %.2g"):format(
        of_plain) },
    { name = "extra time of compensated sums", value = extra, most = 0.1, asked = "+10 %",
      aim = "+3 %", aim_most = 0.03 },
    { name = "error of single over compensated, the paper's setting", value = gain, least = 8,
      asked = "8" },
    -- "the same as double": what a figure would not show
    { name = "error of compensated over double, the paper's setting", value = beside_double,
      aim = "1", aim_most = 1.05 },
    { name = "starts that change bits when moved by 1024 m", value = moved, most = 0,
      asked = "none", aim = "none", aim_most = 0 },
    -- a ratio of two roundings is known to some per cent
    { name = "error on a way of 100 m over that at rest, fp32 compensated", value = way,
      most = 1.2, asked = "1.2", aim = "1", aim_most = 1.05,
      short = short(metres, WAY, "m") },
  }
end

local function of_robustness(results)
  local cases, failing, devices = hard_cases(results)
  local bodies, diverging = searched(results)
  local absent = value_of(results, "robustness", { what = "absent effects" }, "value")
  local meeting = value_of(results, "robustness", { what = "self-collision" }, "value")
  return {
    { name = "hard cases that fail or differ, on every device measured", value = failing, most = 0,
      asked = "none", aim = "none of 70",
      aim_most = (cases or 0) >= HARD_CASES_HOPED and 0 or -1,
      note = cases and ("%d cases on %s"):format(cases, devices),
      short = cases and cases < HARD_CASES and ("%d cases alone"):format(cases) or nil },
    { name = "random bodies that diverge at auto because of the step", value = diverging, most = 0,
      asked = "< 1 in 1e5", aim = "0 in 1e7",
      aim_most = (bodies or 0) >= BODIES_HOPED and 0 or -1,
      note = bodies and ("of %g"):format(bodies),
      short = bodies and bodies < BODIES and ("%g bodies alone"):format(bodies) or nil },
    { name = "instructions a step for effects that the scene lacks", value = absent, most = 0,
      asked = "0", aim = "0", aim_most = 0 },
    { name = "time with self-collision, nothing touching, over without", value = meeting,
      most = 1.5, asked = "1.5", aim = "1.15", aim_most = 1.15 },
  }
end

-- Notes of a number in one line.
local function notes_of(number)
  local list = { number.short or number.note }
  list[#list + 1] = number.partial
  return #list > 0 and table.concat(list, "; ") or nil
end

-- Is a value within its limits? nil where it has none.
local function within(value, most, least)
  if most then return value <= most end
  if least then return value >= least end
end

--- Asked, measured, met.
---@param results table<string, { rows: table[] }> by section
---@return { columns: string[], rows: table[] }
function targets.judge(results)
  local rows = {}
  for _, list in ipairs { of_evolve(results), of_errors(results), of_robustness(results) } do
    for _, number in ipairs(list) do
      local row = { target = number.name, asked = number.asked, aim = number.aim,
        measured = number.value, limit = number.most or number.least,
        aim_limit = number.aim_most or number.aim_least, note = number.value and notes_of(number) }
      if number.value and not number.short then
        row.met = within(number.value, number.most, number.least)
        row.aim_met = within(number.value, number.aim_most, number.aim_least)
        if number.partial then
          if row.met then row.met = nil end
          if row.aim_met then row.aim_met = nil end
        end
      end
      rows[#rows + 1] = row
    end
  end
  return { columns = targets.COLUMNS, rows = rows }
end

local function verdict(row)
  if row.measured == nil then return "not measured" end
  local said = row.met == false and "MISSED" or row.met and "met"
    or row.asked and "too little to tell" or "-"
  if row.aim_met == nil then return said end
  return said .. (row.aim_met and ", aim met" or ", aim missed")
end

--- The rows as a table for people.
---@param result { rows: table[] }
---@param style limax.terminal.style
---@return string
function targets.text(result, style)
  local lines = {}
  for k, row in ipairs(result.rows) do
    lines[k] = { row.target, row.asked or "-", row.aim or "-",
      row.measured and ("%.3g"):format(row.measured) or "-", verdict(row), row.note or "" }
  end
  return terminal.table({ "", "asked", "aim", "measured", "", "" }, lines, style)
end

return targets
