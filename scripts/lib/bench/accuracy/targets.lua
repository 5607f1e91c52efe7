--- targets.lua: the numbers that limax sets itself: what is asked, what was measured, whether it is
--- met. A number that was not measured is said to be so, never met.

local methods = require "limax.bench.accuracy.methods"
local sample = require "limax.statistics.sample"
local terminal = require "limax.terminal"

local targets = {}

targets.COLUMNS = { "target", "asked", "aim", "measured", "limit", "met" }

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
    local floor = floor_of(results, row).elite_regret
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
  local worst, limit, robots
  for _, row in ipairs(rows_with(results, "ranking", { tier = "evolve", population = "random" })) do
    local floor = floor_of(results, row).tau
    if row.tau and floor then
      local asked = math.min(0.95, floor - 0.02)
      if not worst or row.tau - asked < worst - limit then
        worst, limit, robots = row.tau, asked, row.robots
      end
    end
  end
  return worst, limit, robots
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
-- the paper's integrator at the paper's step, with sums compensated in both.
local function smooth_error(results)
  local worst
  for _, scene in ipairs { "free", "air" } do
    local function error_of(integrator, time_step)
      return value_of(results, "work_precision", { scene = scene, integrator = integrator,
        precision = "compensated", time_step = time_step }, "error")
    end
    local cheap, paper = error_of("leapfrog", 20 * methods.PAPER.time_step),
      error_of(methods.PAPER.integrator, methods.PAPER.time_step)
    if cheap and paper then worst = math.max(worst or 0, cheap / paper) end
  end
  return worst
end

-- Compensated sums against plain ones at the paper's step: the median over the scenes of the price,
-- the least gain in error of the smooth ones.
local function compensation(results)
  local price, gain = {}, nil
  for _, row in ipairs(rows_with(results, "work_precision", { integrator = "leapfrog",
    precision = "compensated", time_step = methods.PAPER.time_step })) do
    local plain = rows_with(results, "work_precision", { scene = row.scene,
      integrator = "leapfrog", precision = "single", time_step = row.time_step })[1]
    if row.error and plain and plain.error and not row.tier and not plain.tier then
      price[#price + 1] = row.seconds_per_second / plain.seconds_per_second - 1
      if row.scene == "free" or row.scene == "air" then
        gain = math.min(gain or math.huge, plain.error / row.error)
      end
    end
  end
  return sample.median(price), gain
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

-- Every number: `most` or `least` is what is asked.
local function numbers(results)
  local regret, regret_limit, price = elite_regret(results)
  local tau, tau_limit, robots = least_tau(results)
  local best, best_price = final_best(results)
  local extra, gain = compensation(results)
  local way, metres = way_ratio(results)
  local energy, energy_steps = kept(results, "vibration", "energy_drift")
  local momentum, spin_steps = kept(results, "spin", "momentum_drift")
  local spin_energy = kept(results, "spin", "energy_drift")
  local single = value_of(results, "rounding", { precision = "single", start = 1024 }, "same_bits")
  local compensated =
    value_of(results, "rounding", { precision = "compensated", start = 1024 }, "same_bits")
  local moved
  if single ~= nil and compensated ~= nil then moved = single and compensated and 0 or 1 end
  local function steps(count) return count and (" (%g steps)"):format(count) or "" end
  return {
    { name = "elite regret of evolve, worst population", value = regret,
      most = regret_limit or 0.05, asked = "5 % or 2 x chaos floor", aim = "0.02" },
    { name = "price of evolve in the paper's", value = price, most = 0.1, asked = "0.1" },
    { name = ("tau of evolve, %s random bodies, worst scene"):format(robots or "48"), value = tau,
      least = tau_limit or 0.95, asked = "min(0.95, floor - 0.02)" },
    { name = "final best of evolutions, evolve over paper, median", value = best, least = 0.95,
      asked = "0.95" },
    { name = "price of those evolutions in the paper's, median", value = best_price, most = 0.1,
      asked = "0.1" },
    { name = "energy drift, vibrating, leapfrog compensated" .. steps(energy_steps), value = energy,
      most = 1e-4, asked = "1e-4 at 1e7 steps", aim = "2e-5" },
    { name = "angular momentum, free spin" .. steps(spin_steps), value = momentum, most = 1e-6,
      asked = "1e-6 at 1e6 steps" },
    { name = "energy, free spin" .. steps(spin_steps), value = spin_energy, most = 5e-5,
      asked = "5e-5 at 1e6 steps" },
    { name = "smooth error at 20 times the paper's step, of the paper's",
      value = smooth_error(results), most = 1, asked = "1", aim = "0.33" },
    { name = "extra time of compensated sums", value = extra, most = 0.1, asked = "0.1",
      aim = "0.03" },
    { name = "error of single over compensated at 1e-5 s", value = gain, least = 8, asked = "8" },
    { name = "starts that change bits when moved by 1024 m", value = moved, most = 0,
      asked = "none" },
    { name = ("error on a way of %g m over that at rest, fp32 compensated"):format(metres or 100),
      value = way, most = 1.2, asked = "1.2" },
  }
end

--- Asked, measured, met.
---@param results table<string, { rows: table[] }> by section
---@return { columns: string[], rows: table[] }
function targets.judge(results)
  local rows = {}
  for k, number in ipairs(numbers(results)) do
    local met
    if number.value then
      met = number.most and number.value <= number.most or number.least ~= nil
        and number.value >= number.least
    end
    rows[k] = { target = number.name, asked = number.asked, aim = number.aim,
      measured = number.value, limit = number.most or number.least, met = met }
  end
  return { columns = targets.COLUMNS, rows = rows }
end

--- The rows as a table for people.
---@param result { rows: table[] }
---@param style limax.terminal.style
---@return string
function targets.text(result, style)
  local lines = {}
  for k, row in ipairs(result.rows) do
    local met = row.met and "met" or "MISSED"
    if row.measured == nil then met = "not measured" end
    lines[k] = { row.target, row.asked, row.aim or "-", row.measured and ("%.3g"):format(
      row.measured) or "-", met }
  end
  return terminal.table({ "", "asked", "aim", "measured", "" }, lines, style)
end

return targets
