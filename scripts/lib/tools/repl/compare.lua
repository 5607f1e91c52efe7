--- compare.lua: simulates a robot on two devices, or with two sets of options, and compares the
--- measures. SI units.

local engine = require "limax.engine"
local failure = require "limax.base.failure"
local host = require "limax.host"
local robots = require "limax.robot.robot"
local scored_robot = require "limax.robot.scored_robot"
local schema = require "limax.engine.schema"
local terminal = require "limax.base.terminal"

local compare = {}

local function merged(name, choice, common)
  if type(choice) == "string" then choice = { device = choice } end
  if type(choice) ~= "table" then
    engine.fail(("compare: %s: expected a device or a table of options, got %s"):format(name,
      schema.show(choice)))
  end
  local options = {}
  for key, value in pairs(common or {}) do options[key] = value end
  for key, value in pairs(choice) do options[key] = value end
  return options
end

-- The head of a column: "cuda", "cpu, double".
local function title_of(choice)
  if type(choice) == "string" then return choice end
  local parts = {}
  for key, value in pairs(choice) do
    parts[#parts + 1] = key == "device" and tostring(value) or ("%s %s"):format(key,
      tostring(value))
  end
  table.sort(parts)
  return table.concat(parts, ", ")
end

-- Name, unit and value of each measure.
local function measures(robot, seconds)
  local outcome = robot.record.outcome
  local ends = outcome.center_end
  return {
    { "distance", "m", robot.status == "done" and robot:distance() or nil },
    { "x at the end", "m", ends[1] }, { "y at the end", "m", ends[2] },
    { "z at the end", "m", ends[3] },
    { "time step", "s", outcome.time_step }, { "steps", "", outcome.step },
    { "wall time", "s", seconds },
  }
end

-- Reports an unavailable device before anything is simulated, with alternatives.
local function check_device(name)
  if type(name) ~= "string" then return end
  local available, device = failure.attempt(engine.device, name)
  if available then
    device:free()
  elseif name == "cuda" then
    local reason = failure.bare(device):gsub("^[^\n:]+:%d+: ", ""):gsub("; use 'cpu' or .-$", "")
    engine.fail(("compare: %s. Compare two settings of the CPU, such as compare(robot, \"cpu\", "
      .. "{ precision = \"double\" }); limax doctor reports what CUDA needs"):format(reason))
  else
    error(device, 0)
  end
end

local function simulated(robot, options)
  local began = host.clock()
  local walked = robot:simulate(options)
  return walked, measures(walked, host.clock() - began)
end

-- Counts in full, other numbers as in the table.
local function shown(value, unit)
  if not value then return "-" end
  return unit == "" and ("%d"):format(value) or value
end

--- Simulates twice and returns the differences, second minus first; as text, a table of both.
---@param robot limax.robot|limax.scored_robot
---@param first string|table
---@param second string|table
---@return table<string, number>
function compare.two(robot, first, second, options)
  if type(robot) ~= "table" or type(robot.simulate) ~= "function" then
    engine.fail("compare: expected a robot, got " .. schema.show(robot))
  end
  if scored_robot.is(robot) then robot = robots.new(robot) end
  local of_first, of_second = merged("first", first, options), merged("second", second, options)
  check_device(of_first.device)
  check_device(of_second.device)
  local one, left = simulated(robot, of_first)
  local two, right = simulated(robot, of_second)
  local rows, differences = {}, {}
  for k, measure in ipairs(left) do
    local a, b = measure[3], right[k][3]
    local difference = a and b and b - a or nil
    differences[measure[1]] = difference
    rows[k] = { measure[2] ~= "" and ("%s, %s"):format(measure[1], measure[2]) or measure[1],
      shown(a, measure[2]), shown(b, measure[2]), shown(difference, measure[2]) }
  end
  table.insert(rows, 1, { "status", one.status, two.status, "" })
  local head = { "", title_of(first), title_of(second), "difference" }
  return setmetatable(differences,
    { __tostring = function() return terminal.table(head, rows, terminal.style()) end })
end

return compare
