--- compare.lua: simulates a robot on two devices, or with two sets of options, and compares the
--- measures. SI units.

local choice = require "limax.base.choice"
local host = require "limax.host"
local robots = require "limax.robot.robot"
local schema = require "limax.engine.schema"
local scored_robot = require "limax.robot.scored_robot"
local terminal = require "limax.base.terminal"

local compare = {}

-- The options of one simulation, and the head of its column: "cuda", "cpu, precision double".
local function side(name, wish, common)
  if type(wish) == "string" then wish = { device = wish } end
  if type(wish) ~= "table" then
    schema.refuse("compare: " .. name, "a device or a table of options", wish)
  end
  local options, parts = {}, {}
  for key, value in pairs(common) do options[key] = value end
  for i, key in ipairs(choice.sorted_keys(wish)) do
    options[key] = wish[key]
    parts[i] = (key == "device" and "" or key .. " ") .. tostring(wish[key])
  end
  table.sort(parts)
  return options, table.concat(parts, ", ")
end

-- How a simulation ended, and name, unit and value of each measure.
local function measures(robot, options)
  local began = host.clock()
  local walked = robot:simulate(options)
  local outcome = walked.record.outcome
  local x, y, z = unpack(outcome.center_end)
  return walked.status, {
    { "distance", "m", walked.status == "done" and walked:distance() or nil },
    { "x at the end", "m", x }, { "y at the end", "m", y }, { "z at the end", "m", z },
    { "time step", "s", outcome.time_step }, { "steps", "", outcome.step },
    { "wall time", "s", host.clock() - began },
  }
end

-- Counts in full, other numbers as in the table.
local function shown(value, unit)
  if not value then return "-" end
  return unit == "" and ("%d"):format(value) or value
end

--- Simulates a robot twice and compares the results: on two devices, or with two sets of options
--- of `robot:simulate`.
---@param robot limax.robot|limax.scored_robot
---@param first "auto"|"cpu"|"cuda"|limax.robot.simulate_options
---@param second "auto"|"cpu"|"cuda"|limax.robot.simulate_options
---@param options? limax.robot.simulate_options of both
---@return table<string, number> differences of the measures, second minus first
function compare.compare(robot, first, second, options)
  if type(robot) ~= "table" or type(robot.simulate) ~= "function" then
    schema.refuse("compare", "a robot", robot)
  end
  options = options == nil and {} or schema.demand(schema.table, options, "compare: options")
  if scored_robot.is(robot) then robot = robots.new(robot) end
  local of_first, first_title = side("first", first, options)
  local of_second, second_title = side("second", second, options)
  local first_status, left = measures(robot, of_first)
  local second_status, right = measures(robot, of_second)
  local rows, differences = { { "status", first_status, second_status, "" } }, {}
  for k, measure in ipairs(left) do
    local name, unit, a = unpack(measure)
    local b = right[k][3]
    differences[name] = a and b and b - a or nil
    rows[k + 1] = { unit ~= "" and ("%s, %s"):format(name, unit) or name,
      shown(a, unit), shown(b, unit), shown(differences[name], unit) }
  end
  local head = { "", first_title, second_title, "difference" }
  return setmetatable(differences,
    { __tostring = function() return terminal.table(head, rows, terminal.style()) end })
end

return compare
