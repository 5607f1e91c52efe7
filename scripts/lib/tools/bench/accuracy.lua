--- accuracy.lua: `limax bench accuracy`: what accuracy costs. Runs the sections of
--- scripts/ACCURACY.md and writes what they measured.

local choice = require "limax.base.choice"
local failure = require "limax.base.failure"
local host = require "limax.host"
local ranking = require "limax.tools.bench.accuracy.ranking"
local source = require "limax.base.source"
local suggest = require "limax.engine.suggest"
local terminal = require "limax.base.terminal"
local tiers = require "limax.settings.tiers"
local trial = require "limax.tools.bench.accuracy.trial"

local accuracy = {}

--- Sections in the order in which they run.
accuracy.SECTIONS = { "work_precision", "ranking" }

-- Sizes of the sections, in SI units. `reference`: step of the finest setting; `effort`: least wall
-- time and runs of a trial; `seconds`: wall time of one round of one setting; `set`: overrides of
-- every experiment; `cases`: how many of walkers.CASES run under `settings`, and `rest` those after
-- them.
--
-- Time steps, s: divisors of 50 ms on both sides of the paper's 1e-5, the first too long for stiff
-- bodies.
local STEPS = { 2e-3, 1e-3, 5e-4, 2e-4, 1e-4, 5e-5, 2e-5, 1e-5, 5e-6 }
local FINER = { unpack(STEPS) }
FINER[#FINER + 1] = 2e-6

local LEAPFROG, EULER, XPBD = "leapfrog", "symplectic_euler", "xpbd"

-- Two minutes on two cores, most of them in the finest setting of the rankings.
local QUICK = {
  work_precision = { lattice = { 4, 4, 4 }, steps = STEPS, reference = 2e-6,
    effort = { seconds = 0.1, runs = 3 } },
  ranking = { cases = 2, robots = 16, generations = 6, reference = 1e-5, seconds = 0.04,
    set = { "simulation.duration=1.5", "simulation.settle=0.3", "record={}" },
    settings = ranking.settings({ "preview", "evolve", "publish" }, {
      { LEAPFROG, "compensated", 1e-3 }, { LEAPFROG, "compensated", 5e-4 },
      { LEAPFROG, "compensated", 1e-4 }, { LEAPFROG, "single", 2e-4 },
      { LEAPFROG, "single", 5e-5 }, { EULER, "compensated", 1e-3 },
      { EULER, "compensated", 5e-4 }, { EULER, "compensated", 2e-4 },
      { EULER, "compensated", 5e-5 }, { XPBD, "compensated", 1e-3 },
      { XPBD, "compensated", 2e-4 },
    }) },
}

-- Every integrator for bodies on the ground, every precision, five steps; XPBD in one precision.
local function all_settings()
  local list = {}
  for _, time_step in ipairs { 2e-3, 1e-3, 5e-4, 2e-4, 1e-4 } do
    list[#list + 1] = { XPBD, "compensated", time_step }
  end
  for _, integrator in ipairs { LEAPFROG, EULER } do
    for _, precision in ipairs(trial.PRECISIONS) do
      for _, time_step in ipairs { 1e-3, 5e-4, 2e-4, 1e-4, 5e-5 } do
        list[#list + 1] = { integrator, precision, time_step }
      end
    end
  end
  return list
end

local FULL = {
  work_precision = { lattice = { 5, 5, 5 }, steps = FINER, reference = 2e-6,
    effort = { seconds = 2, runs = 20 } },
  ranking = { cases = 4, robots = 48, generations = 15, reference = 5e-6, seconds = 0.2,
    set = { "record={}" }, settings = ranking.settings(tiers.NAMES, all_settings()),
    -- some fitnesses read what their scripts record
    rest = { set = {}, reference = 1e-5,
      settings = ranking.settings({ "preview", "evolve", "publish" },
        { { XPBD, "compensated", 1e-3 } }) } },
}

-- Columns and rows of several sections, with the section's name in each row.
local function joined(results, sections)
  local columns, seen, rows = { "section" }, {}, {}
  for _, name in ipairs(sections) do
    for _, column in ipairs(results[name].columns) do
      if not seen[column] then columns[#columns + 1] = column end
      seen[column] = true
    end
    for _, row in ipairs(results[name].rows) do
      rows[#rows + 1] = source.copy(row)
      rows[#rows].section = name
    end
  end
  return columns, rows
end

-- The sections to run: those that the user names, or all.
local function chosen(names)
  for _, name in ipairs(names) do
    if not choice.contains(accuracy.SECTIONS, name) then
      failure.raise(2, ('--section "%s": unknown%s'):format(name,
        suggest.ending(name, accuracy.SECTIONS)))
    end
  end
  return #names > 0 and names or accuracy.SECTIONS
end

-- The size of a section whose walks last this long, s.
local function lasting(size, duration)
  local own = source.copy(size)
  own.set = { unpack(size.set) }
  own.set[#own.set + 1] = ("simulation.duration=%.9g"):format(duration)
  return own
end

-- Prints what was measured of the tiers and stores it for `limax run` and `limax doctor`.
local function report_tiers(how, results)
  local measured = tiers.summary(results)
  if not measured then return end
  for _, name in ipairs(tiers.NAMES) do
    how.say(("%-10s %s: %s"):format(name, tiers.describe(name), tiers.price(measured[name])))
  end
  -- part of the sections, or other sizes, give another price
  if how.sizes or how.duration or not (results.ranking and results.work_precision) then return end
  local path, message = tiers.keep(how.device, measured)
  how.say(path and "stored for limax run and limax doctor: " .. path
    or "not stored for limax run and limax doctor: " .. message)
end

--- Runs the sections, each a module with run { device, size, say }, which returns columns and rows,
--- and text(result, style).
---@param how table the command's arguments; `sizes` by section instead of the usual ones
function accuracy.run(how)
  local sizes = how.sizes or how.full and FULL or QUICK
  local style, results = terminal.style {}, {}
  local sections = chosen(how.section or {})
  for _, name in ipairs(sections) do
    local section = require("limax.tools.bench.accuracy." .. name)
    local began = host.clock()
    how.say ""
    local size = sizes[name]
    if how.duration and name == "ranking" then size = lasting(size, how.duration) end
    results[name] = section.run { device = how.device, size = size, say = how.say }
    how.say(("\n%s\n(%s: %.0f s)"):format(section.text(results[name], style), name,
      host.clock() - began))
  end
  how.say ""
  report_tiers(how, results)
  local columns, rows = joined(results, sections)
  return { columns = columns, rows = rows }
end

return accuracy
