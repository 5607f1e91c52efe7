--- ranking.lua: compares the ranks of robots under cheap settings with those under the finest one,
--- for random and evolved populations of the shipped scenes. The chaos floor is the finest setting
--- against itself at a step changed by about one part in 1e4; no setting can be expected to beat
--- it. SI units.

local defaults = require "limax.settings.defaults"
local engine = require "limax.engine"
local failure = require "limax.base.failure"
local host = require "limax.host"
local rescore = require "limax.evolution.rescore"
local settings = require "limax.settings.settings"
local statistics = require "limax.base.statistics.ranking"
local terminal = require "limax.base.terminal"
local walkers = require "limax.tools.bench.accuracy.walkers"

local ranking = {}

-- Share of the robots that are elites: the paper's, and the library's default.
local ELITES = 0.3

-- Names for people.
local LABELS = { symplectic_euler = "symplectic Euler", leapfrog = "leapfrog", rk4 = "RK4" }

-- The paper names no integrator and no precision; its step is 1e-5 s.
local PAPER = { integrator = "symplectic_euler", precision = "single", time_step = 1e-5 }

-- The finest setting at a time step, s.
local function finest(time_step)
  return { integrator = "leapfrog", precision = "double", time_step = time_step }
end

ranking.COLUMNS = { "case", "population", "setting", "tier", "integrator", "precision", "time_step",
  "status", "reason", "robots", "failed", "tau", "overlap", "distance_error",
  "distance_error_relative", "elite_regret", "seconds_per_second", "relative_to_paper" }

--- The step nearest to one part in 1e4 longer or shorter that whole samples allow.
---@param time_step number s
---@param rate integer Hz, base rate of the samples
---@return number s
function ranking.perturbed(time_step, rate)
  local steps = math.floor(1 / (rate * time_step) + 0.5)
  return 1 / (rate * (steps + math.max(1, math.floor(1e-4 * steps + 0.5))))
end

--- Numbers that compare cheap scores with the reference's.
---@return table tau, overlap, distance_error, distance_error_relative, elite_regret
function ranking.compare(reference, cheap, count)
  local off, relative = statistics.mean_error(reference.distance, cheap.distance, count)
  local share = ELITES
  return {
    tau = statistics.kendall_tau(reference.fitness, cheap.fitness, count),
    overlap = statistics.overlap(reference.fitness, cheap.fitness, count, share),
    distance_error = off, distance_error_relative = relative,
    elite_regret = statistics.elite_regret(reference.fitness, cheap.fitness, count, share),
  }
end

local CPU_ONLY = "CPU only"

-- Why the engine refuses a simulation with these options; nil if it does not.
local function refusal_on(device, robots, options)
  local fine, value = failure.attempt(engine.simulation, robots.engine, robots.materials,
    robots.world.scene, options, device)
  if fine then
    value:free "its options were only checked"
    return nil
  end
  if failure.of_machine(value) then error(value, 0) end
  local message = failure.bare(value)
  return message:match "simulation: (.*)$" or message
end

-- Why the device does not support a setting of these robots, "CPU only" if the CPU does; or nil.
local function refusal(robots, setting)
  local world, options = robots.world, rescore.options(robots.world.config, setting)
  local why = refusal_on(world.device, robots, options)
  if not why or world.device.kind == "cpu" then return why end
  return refusal_on(engine.device "cpu", robots, options) and why or CPU_ONLY
end

-- Prices of the settings that the device supports, by index.
local function prices_of(robots, list, seconds)
  local settings_of, place, prices = {}, {}, {}
  for k, each in ipairs(list) do
    if not each.refused then
      settings_of[#settings_of + 1], place[#place + 1] = each.setting, k
    end
  end
  for k, price in pairs(walkers.prices(robots, settings_of, seconds)) do
    prices[place[k]] = price
  end
  return prices
end

-- The longest step of the bodies, s; that of an invalid one is not a number.
local function longest(steps)
  local most
  for _, step in pairs(steps) do
    if step > (most or 0) then most = step end
  end
  return most
end

-- One population under every setting, the finest and the chaos floor first.
local function measure(case, kind, robots, size, seconds, rows)
  local near = ranking.perturbed(size.reference, settings.base_rate(robots.world.config.record))
  local list = { { name = "finest", setting = finest(size.reference),
    -- the finest setting may be a tier's
    tier = size.reference == defaults.tiers.reference.time_step_most and "reference" or nil },
    { name = "chaos floor", setting = finest(near) } }
  for _, each in ipairs(size.settings) do
    list[#list + 1] = { name = each.name, setting = each.setting, tier = each.tier }
  end
  for _, each in ipairs(list) do each.refused = refusal(robots, each.setting) end
  local prices, first, reference, paper = prices_of(robots, list, seconds), #rows + 1, nil, nil
  for k, each in ipairs(list) do
    host.raise_if_interrupted()
    local row = { case = case.name, population = kind, setting = each.name, tier = each.tier,
      integrator = each.setting.integrator, precision = each.setting.precision,
      time_step = tonumber(each.setting.time_step), robots = #robots,
      status = each.refused and "refused" or "done", reason = each.refused }
    if not each.refused then
      local scores = rescore.population(robots, each.setting)
      reference = reference or scores
      for key, value in pairs(ranking.compare(reference, scores, #robots)) do row[key] = value end
      row.failed = scores.failed
      row.time_step = row.time_step or longest(scores.time_step)
      row.seconds_per_second = scores.failed < #robots and prices[k] or nil
      if each.name == "paper" then paper = prices[k] end
    end
    rows[#rows + 1] = row
  end
  for k = first, #rows do
    local price = rows[k].seconds_per_second
    rows[k].relative_to_paper = price and paper and price / paper
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

--- Measures the cases.
---@param size table see accuracy.lua
---@param set string[] overrides of every experiment of the first cases
function ranking.run(size, set, device, say)
  local rows = {}
  for c = 1, size.rest and #walkers.CASES or size.cases do
    local case, own = walkers.CASES[c], c <= size.cases and size or size.rest
    local experiment = walkers.experiment(case, { "population=" .. size.robots,
      "generations=" .. size.generations }, c <= size.cases and set or size.rest.set)
    local refused = refusal_of(experiment, device)
    for _, kind in ipairs { "random", "evolved" } do
      if refused then
        rows[#rows + 1] = { case = case.name, population = kind, setting = "every setting",
          status = "refused", reason = refused, robots = size.robots }
      else
        say(("%s: %d %s bodies"):format(case.name, size.robots, kind))
        measure(case, kind, walkers[kind](experiment, device), own, size.seconds, rows)
      end
    end
  end
  return { columns = ranking.COLUMNS, rows = rows }
end

-- The number of failed robots, or why there is none.
local function failed_of(row)
  if row.status ~= "refused" then return row.failed end
  return row.reason == CPU_ONLY and row.reason or "refused"
end

local function percent(field)
  return function(row) return row[field] and ("%.1f %%"):format(100 * row[field] + 0) end
end

local TABLE = { { "case" }, { "bodies", "population" }, { "setting" }, { "failed", failed_of },
  { "tau", "tau", "%.3f" }, { "same elites", percent "overlap" },
  { "distance, mm", function(row) return row.distance_error and 1e3 * row.distance_error end,
    "%.1f" },
  { "elite regret", percent "elite_regret" }, { "s per robot s", "seconds_per_second" },
  { "of the paper's", "relative_to_paper", "%.3f" } }

function ranking.text(result, style)
  local notes = {}
  for _, row in ipairs(result.rows) do
    local note = ("%s, %s: %s"):format(row.case, row.setting, row.reason)
    if failed_of(row) == "refused" and notes[#notes] ~= note then notes[#notes + 1] = note end
  end
  return ("order of the robots against the finest setting; elites are the best %d %%\n"):format(
    100 * ELITES) .. terminal.rows(TABLE, result.rows, style) .. "\n"
    .. table.concat(notes, "\n")
end

--- Settings of the tables: tiers, each body's own step, other steps, the paper's.
---@param names string[] tiers
---@param others { [1]: string, [2]: string, [3]: number }[] integrator, precision, step (s)
---@return { name: string, tier: string|nil, setting: table }[] see rescore.options
function ranking.settings(names, others)
  local list = {}
  for _, tier in ipairs(names) do
    list[#list + 1] = { name = tier, tier = tier, setting = { accuracy = tier } }
  end
  list[#list + 1] = { name = "auto", setting = { integrator = "leapfrog",
    precision = "compensated", time_step = "auto" } }
  for _, other in ipairs(others) do
    list[#list + 1] = { name = ("%s, %s, %g s"):format(LABELS[other[1]], other[2],
      other[3]), setting = { integrator = other[1], precision = other[2], time_step = other[3] } }
  end
  list[#list + 1] = { name = "paper", setting = PAPER }
  return list
end

return ranking
