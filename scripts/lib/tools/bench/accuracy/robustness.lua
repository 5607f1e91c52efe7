--- robustness.lua: the numbers of the targets that are no error: hard cases that fail, random
--- bodies that diverge at the automatic step, what a step spends on effects that its scene lacks,
--- what self-collision costs where nothing touches. `limax bench stability` and `blow-ups` do the
--- first two in full; `--with FILE` counts what they left. SI units.

local absent_effects = require "limax.tools.bench.accuracy.absent_effects"
local blow_ups = require "limax.tools.bench.blow_ups"
local engine = require "limax.engine"
local host = require "limax.host"
local stability = require "limax.tools.bench.stability"
local step_cases = require "limax.tools.bench.cases"
local terminal = require "limax.base.terminal"
local timing = require "limax.tools.bench.timing"

local robustness = {}

robustness.COLUMNS = { "what", "devices", "first", "count", "failed", "reported", "value",
  "reason" }

-- a walker's, and the same where masses of its surface may meet
local PLAIN = { gravity = true, ground = true, friction = true, damping = true, actuation = true }
local MEETING = { self_collision = true }
for name in pairs(PLAIN) do MEETING[name] = true end

---@class limax.accuracy.robustness_size
---@field filter string|nil of hard cases; all if left out
---@field blow_ups integer random bodies
---@field seconds number wall time of one repeat of a step's price
---@field rounds integer repeats

-- Time of a step with self-collision over that without, a full body that touches nothing.
local function price_of_meeting(device, size)
  local materials, list = engine.materials "paper", {}
  local one = device.kind == "cpu" and engine.device("cpu", { threads = 1 }) or device
  for k, scene in ipairs { PLAIN, MEETING } do
    list[k] = step_cases.endless(materials, { lattice = { 5, 5, 5 },
      -- what fills a large GPU
      count = one.kind == "cpu" and 1 or 4224, scene = scene, integrator = "leapfrog",
      precision = "compensated", device = one, seconds = size.seconds / 5 })
  end
  -- one thread: its own time, in which a busy machine's other work does not count
  local rates = timing.best_rates(list, size.rounds, one.kind == "cpu" and os.clock or nil)
  for _, case in ipairs(list) do case.free() end
  return rates[1] / rates[2]
end

--- The kinds of devices of the rows of a matrix of hard cases, in their order: "cpu, cuda".
---@param rows { device: string }[]
---@return string
function robustness.devices(rows)
  local seen, list = {}, {}
  for _, row in ipairs(rows) do
    if not seen[row.device] then seen[row.device], list[#list + 1] = true, row.device end
  end
  return table.concat(list, ", ")
end

--- Measures all four.
---@param how { device: limax.device, size: limax.accuracy.robustness_size, say: fun(text: string) }
---@return { columns: string[], rows: table[] }
function robustness.run(how)
  local size, rows = how.size, {}
  local matrix = stability.run { device = how.device, filter = size.filter, say = how.say }
  rows[1] = { what = "hard cases", devices = robustness.devices(matrix.rows),
    count = matrix.cases.cases - matrix.cases.skipped,
    failed = matrix.cases.failed + matrix.cases.differ }
  host.raise_if_interrupted()
  local search = blow_ups.search { device = how.device, first = 1, cases = size.blow_ups,
    say = how.say }
  rows[2] = { what = "blow-ups", devices = how.device.kind, first = search.cases.first,
    count = search.cases.count, failed = search.cases.step,
    reported = search.cases.diverged - search.cases.step }
  host.raise_if_interrupted()
  local absent, all = absent_effects.count()
  rows[3] = { what = "absent effects", value = absent, reason = not absent and all or nil }
  rows[4] = { what = "self-collision", value = price_of_meeting(how.device, size) }
  return { columns = robustness.COLUMNS, rows = rows }
end

local UNITS = { ["absent effects"] = "instructions a step", ["self-collision"] = "of the time" }

--- The rows as a table for people.
---@param result { rows: table[] }
---@param style limax.terminal.style
---@return string
function robustness.text(result, style)
  local lines = {}
  for k, row in ipairs(result.rows) do
    lines[k] = { row.what, row.count or "-", row.failed or "-",
      row.value and ("%.3g %s"):format(row.value, UNITS[row.what]) or row.reason or "-" }
  end
  return terminal.table({ "", "count", "failed", "" }, lines, style)
end

return robustness
