--- compare.lua: one robot under two devices, or two sets of options: what each measured, side by
--- side. SI units.

local engine = require "limax.engine"
local host = require "limax.host"
local robots = require "limax.robot"
local scored_robot = require "limax.scored_robot"
local schema = require "limax.schema"
local terminal = require "limax.terminal"

local compare = {}

local function merged(what, given, common)
  if type(given) == "string" then given = { device = given } end
  if type(given) ~= "table" then
    engine.fail(("compare: %s: expected a device or a table of options, got %s"):format(what,
      schema.show(given)))
  end
  local options = {}
  for key, value in pairs(common or {}) do options[key] = value end
  for key, value in pairs(given) do options[key] = value end
  return options
end

-- "cuda", "cpu, double": what a column's head says.
local function title_of(given)
  if type(given) == "string" then return given end
  local parts = {}
  for key, value in pairs(given) do
    parts[#parts + 1] = key == "device" and tostring(value) or ("%s %s"):format(key,
      tostring(value))
  end
  table.sort(parts)
  return table.concat(parts, ", ")
end

-- Name, unit and value of everything that is compared.
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

local function simulated(robot, options)
  local began = host.clock()
  local walked = robot:simulate(options)
  return walked, measures(walked, host.clock() - began)
end

--- Simulates twice and gives the differences, second less first; as text, a table of both.
---@param robot limax.robot|limax.scored_robot
---@param first string|table
---@param second string|table
---@param options? table
---@return table<string, number>
function compare.two(robot, first, second, options)
  if type(robot) ~= "table" or type(robot.simulate) ~= "function" then
    engine.fail("compare: expected a robot, got " .. schema.show(robot))
  end
  if scored_robot.is(robot) then robot = robots.new(robot) end
  local one, left = simulated(robot, merged("first", first, options))
  local two, right = simulated(robot, merged("second", second, options))
  local rows, differences = {}, {}
  for k, measure in ipairs(left) do
    local a, b = measure[3], right[k][3]
    local difference = a and b and b - a or nil
    differences[measure[1]] = difference
    rows[k] = { measure[2] ~= "" and ("%s, %s"):format(measure[1], measure[2]) or measure[1],
      a or "-", b or "-", difference or "-" }
  end
  table.insert(rows, 1, { "status", one.status, two.status, "" })
  local head = { "", title_of(first), title_of(second), "difference" }
  return setmetatable(differences,
    { __tostring = function() return terminal.table(head, rows, terminal.style()) end })
end

return compare
