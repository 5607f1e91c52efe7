--- ranking.lua: how well cheap settings keep the order in which the finest one ranks robots: random
--- and evolved populations of the shipped scenes. The chaos floor is the finest setting against
--- itself at a step changed by about one part in 1e4; no setting can be expected to beat it.
--- SI units.

local defaults = require "limax.settings.defaults"
local failure = require "limax.base.failure"
local host = require "limax.host"
local rescore = require "limax.evolution.rescore"
local settings = require "limax.settings.settings"
local statistics = require "limax.base.statistics.ranking"
local terminal = require "limax.base.terminal"
local trial = require "limax.tools.bench.accuracy.trial"
local walkers = require "limax.tools.bench.accuracy.walkers"

local ranking = {}

--- Share of the robots that are elites: the paper's, and the library's default.
ranking.ELITES = 0.3

ranking.COLUMNS = { "case", "population", "setting", "tier", "integrator", "precision", "time_step",
  "status", "reason", "robots", "failed", "tau", "overlap", "distance_error",
  "distance_error_relative", "elite_regret", "seconds_per_second", "relative_to_paper" }

---@class limax.accuracy.ranking_size
---@field cases integer of walkers.CASES, from the first, that are measured under `settings`
---@field robots integer
---@field generations integer of the evolved populations
---@field set string[] overrides of every experiment: duration and the like
---@field reference number s, the step of the finest setting: leapfrog, double
---@field settings limax.accuracy.ranked_setting[]
---@field seconds number wall time of one turn of one setting, for the prices
---@field rest { set: string[], reference: number, settings: limax.accuracy.ranked_setting[] }|nil
--- of the cases after the first `cases`; left out, those are not measured

---@class limax.accuracy.ranked_setting
---@field name string
---@field tier string|nil
---@field setting table see rescore.options

--- The step nearest to one part in 1e4 longer or shorter that whole samples allow.
---@param time_step number s
---@param rate integer Hz, base rate of the samples
---@return number s
function ranking.perturbed(time_step, rate)
  local steps = math.floor(1 / (rate * time_step) + 0.5)
  return 1 / (rate * (steps + math.max(1, math.floor(1e-4 * steps + 0.5))))
end

--- Numbers that compare cheap scores with the reference's.
---@param reference limax.rescored
---@param cheap limax.rescored
---@param count integer robots
---@return table tau, overlap, distance_error, distance_error_relative, elite_regret
function ranking.compare(reference, cheap, count)
  local off, relative = statistics.mean_error(reference.distance, cheap.distance, count)
  local share = ranking.ELITES
  return {
    tau = statistics.kendall_tau(reference.fitness, cheap.fitness, count),
    overlap = statistics.overlap(reference.fitness, cheap.fitness, count, share),
    distance_error = off, distance_error_relative = relative,
    elite_regret = statistics.elite_regret(reference.fitness, cheap.fitness, count, share),
  }
end

-- The finest setting may be a tier's.
local function tier_of(time_step)
  return time_step == defaults.tiers.reference.time_step_most and "reference" or nil
end

-- Why the device does not support a setting of these robots, or nil.
local function refusal(robots, setting)
  return trial.brief_refusal({ population = robots.engine, materials = robots.materials,
    scene = robots.world.scene }, rescore.options(robots.world.config, setting),
    robots.world.device)
end

-- The settings of a population, the finest and the chaos floor first, and why the device refuses
-- some of them, by index.
local function settings_of(robots, size)
  local config = robots.world.config
  local finest = { integrator = "leapfrog", precision = "double", time_step = size.reference }
  local near = { integrator = "leapfrog", precision = "double",
    time_step = ranking.perturbed(size.reference, settings.base_rate(config.record)) }
  local list = { { name = "finest", setting = finest, tier = tier_of(size.reference) },
    { name = "chaos floor", setting = near } }
  for _, each in ipairs(size.settings) do list[#list + 1] = each end
  local refused = {}
  for k, each in ipairs(list) do refused[k] = refusal(robots, each.setting) end
  return list, refused
end

-- Prices of those that the device supports, by index, and the paper's.
local function prices_of(robots, list, refused, seconds)
  local plain, place = {}, {}
  for k, each in ipairs(list) do
    if not refused[k] then
      plain[#plain + 1] = each.setting
      place[#plain] = k
    end
  end
  local prices, paper = {}, nil
  for k, found in pairs(walkers.prices(robots, plain, seconds)) do
    prices[place[k]] = found
    if list[place[k]].name == "paper" then paper = found end
  end
  return prices, paper
end

-- One population under every setting.
local function measure(case, kind, robots, size, seconds, rows)
  local list, refused = settings_of(robots, size)
  local prices, paper = prices_of(robots, list, refused, seconds)
  local reference
  for k, each in ipairs(list) do
    host.raise_if_interrupted()
    local row = { case = case.name, population = kind, setting = each.name, tier = each.tier,
      integrator = each.setting.integrator, precision = each.setting.precision,
      time_step = tonumber(each.setting.time_step), robots = #robots,
      status = refused[k] and "refused" or "done", reason = refused[k] }
    if not refused[k] then
      local scores = rescore.population(robots, each.setting)
      reference = reference or scores
      row.failed = scores.failed
      row.seconds_per_second = scores.failed < #robots and prices[k] or nil
      if row.seconds_per_second and paper then
        row.relative_to_paper = row.seconds_per_second / paper
      end
      for key, value in pairs(ranking.compare(reference, scores, #robots)) do row[key] = value end
    end
    rows[#rows + 1] = row
  end
end

-- Why the device supports no robot of an experiment, or nil: its scene may need the CPU.
local function refusal_of(experiment, device)
  local fine, robots = failure.attempt(walkers.random, experiment, device)
  if not fine then
    if failure.of_machine(robots) then error(robots, 0) end
    return failure.bare(robots)
  end
  return refusal(robots, { accuracy = "evolve" })
end

---@param how { device: limax.device, size: limax.accuracy.ranking_size, say: fun(text: string) }
---@return { columns: string[], rows: table[] }
function ranking.run(how)
  local size, rows = how.size, {}
  for c = 1, size.rest and #walkers.CASES or size.cases do
    local case, own = walkers.CASES[c], c <= size.cases and size or size.rest
    local changes = { "population=" .. size.robots, "generations=" .. size.generations }
    for _, text in ipairs(own.set) do changes[#changes + 1] = text end
    local experiment = walkers.experiment(case, changes)
    local refused = refusal_of(experiment, how.device)
    for _, kind in ipairs { "random", "evolved" } do
      if refused then
        rows[#rows + 1] = { case = case.name, population = kind, setting = "every setting",
          status = "refused", reason = refused, robots = size.robots }
      else
        how.say(("%s: %d %s bodies"):format(case.name, size.robots, kind))
        measure(case, kind, walkers[kind](experiment, how.device), own, size.seconds, rows)
      end
    end
  end
  return { columns = ranking.COLUMNS, rows = rows }
end

-- What each body's own step saves against the paper's.
local function savings_of_auto(rows)
  local least, most
  for _, row in ipairs(rows) do
    if row.setting == "auto" and row.relative_to_paper then
      local times = 1 / row.relative_to_paper
      least, most = math.min(least or times, times), math.max(most or times, times)
    end
  end
  return least and ("the step auto takes %.0f to %.0f times less time than the paper's %g s")
    :format(least, most, trial.PAPER.time_step) or "the step auto has no price here"
end

local function percent(value) return value and ("%.1f %%"):format(100 * value + 0) or "-" end

function ranking.text(result, style)
  local lines, notes = {}, {}
  for k, row in ipairs(result.rows) do
    local failed = row.failed
    if row.status == "refused" then
      failed = row.reason == trial.CPU_ONLY and row.reason or "refused"
      local note = ("%s, %s: %s"):format(row.case, row.setting, row.reason)
      if failed == "refused" and notes[#notes] ~= note then notes[#notes + 1] = note end
    end
    lines[k] = { row.case, row.population, row.setting, failed,
      row.tau and ("%.3f"):format(row.tau) or "-", percent(row.overlap),
      row.distance_error and ("%.1f"):format(1e3 * row.distance_error) or "-",
      percent(row.elite_regret), row.seconds_per_second or "-",
      row.relative_to_paper and ("%.3f"):format(row.relative_to_paper) or "-" }
  end
  notes[#notes + 1] = savings_of_auto(result.rows)
  return ("order of the robots against the finest setting; elites are the best %d %%\n"):format(
    100 * ranking.ELITES) .. terminal.table({ "case", "bodies", "setting", "failed", "tau",
    "same elites", "distance, mm", "elite regret", "s per robot s", "of the paper's" }, lines,
    style) .. "\n" .. table.concat(notes, "\n")
end

--- Settings of the tables: tiers, each body's own step, other steps, the paper's.
---@param names string[] tiers
---@param others { [1]: string, [2]: string, [3]: number }[] integrator, precision, step (s)
---@return limax.accuracy.ranked_setting[]
function ranking.settings(names, others)
  local list = {}
  for _, tier in ipairs(names) do
    list[#list + 1] = { name = tier, tier = tier, setting = { accuracy = tier } }
  end
  list[#list + 1] = { name = "auto", setting = { integrator = "leapfrog",
    precision = "compensated", time_step = "auto" } }
  for _, other in ipairs(others) do
    list[#list + 1] = { name = ("%s, %s, %g s"):format(trial.LABELS[other[1]], other[2],
      other[3]), setting = { integrator = other[1], precision = other[2], time_step = other[3] } }
  end
  list[#list + 1] = { name = "paper", setting = trial.PAPER }
  return list
end

return ranking
