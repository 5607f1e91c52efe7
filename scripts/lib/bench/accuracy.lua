--- accuracy.lua: what accuracy costs: the sections of `limax bench accuracy`, their sizes, and what
--- they leave behind.

local terminal = require "limax.terminal"

local accuracy = {}

--- Sections in the order in which they run.
accuracy.SECTIONS = { "work_precision" }

-- Time steps, s: divisors of 50 ms on both sides of the paper's 1e-5, the first above the limit of
-- stiff bodies.
local STEPS = { 2e-3, 1e-3, 5e-4, 2e-4, 1e-4, 5e-5, 2e-5, 1e-5, 5e-6 }

local QUICK = {
  work_precision = { lattice = { 4, 4, 4 }, steps = STEPS, reference = 2e-6,
    effort = { seconds = 0.1, runs = 3 } },
}

local FULL = {
  work_precision = { lattice = { 5, 5, 5 }, steps = { unpack(STEPS) }, reference = 2e-6,
    effort = { seconds = 2, runs = 20 } },
}
FULL.work_precision.steps[#STEPS + 1] = 2e-6

-- Rows of several sections as one table, for CSV: a row says which section it is of.
local function joined(results, sections)
  local columns, known, rows = { "section" }, {}, {}
  for _, name in ipairs(sections) do
    for _, column in ipairs(results[name].columns) do
      if not known[column] then
        known[column] = true
        columns[#columns + 1] = column
      end
    end
    for _, row in ipairs(results[name].rows) do
      local copy = { section = name }
      for key, value in pairs(row) do copy[key] = value end
      rows[#rows + 1] = copy
    end
  end
  return columns, rows
end

---@param how limax.bench_how
---@return limax.bench_result
function accuracy.run(how)
  local sizes = how.full and FULL or QUICK
  local style = terminal.style {}
  local results = {}
  for _, name in ipairs(accuracy.SECTIONS) do
    local section = require("limax.bench.accuracy." .. name)
    results[name] = section.run { device = how.device, size = sizes[name], say = how.say }
    how.say(section.text(results[name], style))
  end
  local columns, rows = joined(results, accuracy.SECTIONS)
  return { columns = columns, rows = rows }
end

return accuracy
