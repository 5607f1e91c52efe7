--- accuracy.lua: `limax bench accuracy`: the cost of accuracy, as scripts/ACCURACY.md explains.

local ranking = require "limax.tools.bench.accuracy.ranking"
local terminal = require "limax.base.terminal"
local tiers = require "limax.settings.tiers"

local accuracy = {}

local LEAPFROG, EULER = "leapfrog", "symplectic_euler"

-- Sizes in SI units. `reference`: step of the finest setting; `seconds`: wall time of one round of
-- one setting; `set`: overrides of every experiment; `cases`: how many of walkers.CASES run under
-- `settings`, and `rest` those after them.

-- Two minutes on two cores, most of them in the finest setting.
local QUICK = { cases = 2, robots = 16, generations = 6, reference = 1e-5, seconds = 0.04,
  set = { "simulation.duration=1.5", "simulation.settle=0.3", "record={}" },
  settings = ranking.settings({ "preview", "evolve", "publish" }, {
    { LEAPFROG, "compensated", 1e-3 }, { LEAPFROG, "compensated", 5e-4 },
    { LEAPFROG, "compensated", 1e-4 }, { LEAPFROG, "single", 2e-4 },
    { LEAPFROG, "single", 5e-5 }, { EULER, "compensated", 1e-3 },
    { EULER, "compensated", 5e-4 }, { EULER, "compensated", 2e-4 },
    { EULER, "compensated", 5e-5 },
  }) }

-- Every integrator for bodies on the ground, every precision, five steps.
local function all_settings()
  local list = {}
  for _, integrator in ipairs { LEAPFROG, EULER } do
    for _, precision in ipairs { "single", "compensated", "double" } do
      for _, time_step in ipairs { 1e-3, 5e-4, 2e-4, 1e-4, 5e-5 } do
        list[#list + 1] = { integrator, precision, time_step }
      end
    end
  end
  return list
end

local FULL = { cases = 4, robots = 48, generations = 15, reference = 5e-6, seconds = 0.2,
  set = { "record={}" }, settings = ranking.settings(tiers.NAMES, all_settings()),
  -- some fitnesses read what their scripts record
  rest = { set = {}, reference = 1e-5,
    settings = ranking.settings({ "preview", "evolve", "publish" }, {}) } }

--- Ranks robots under each setting, prints a table, and stores the measurements of the tiers for
--- `limax run` and `limax doctor`.
---@param how table the command's arguments; `size` instead of the usual ones
function accuracy.run(how)
  local size = how.size or how.full and FULL or QUICK
  local set = { unpack(size.set) }
  if how.duration then set[#set + 1] = ("simulation.duration=%.9g"):format(how.duration) end
  local result = ranking.run(size, set, how.device, how.say)
  how.say("\n" .. ranking.text(result, terminal.style {}) .. "\n")
  local measured = tiers.summary { ranking = result }
  for _, name in ipairs(measured and tiers.NAMES or {}) do
    how.say(("%-10s %s: %s"):format(name, tiers.describe(name), tiers.price(measured[name])))
  end
  -- another size gives another price
  if not measured or how.size or how.duration then return result end
  local path, message = tiers.keep(how.device, measured)
  how.say(path and "stored for limax run and limax doctor: " .. path
    or "not stored for limax run and limax doctor: " .. message)
  return result
end

return accuracy
