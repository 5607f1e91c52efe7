--- kind.lua: finds the limax class of a value by its fields.

local engine = require "limax.engine"
local scored_robot = require "limax.robot.scored_robot"

local kind = {}

-- a class and two fields of its objects
local marks = {
  { "limax.robot", "description", "population" },
  { "limax.robot_in_motion", "simulation", "finished" },
  { "limax.run", "experiment", "history" },
  { "limax.population.scored", "records", "generation" },
  { "limax.random", "key", "draw" },
}

--- The class of a value: "limax.robot", "limax.view"; nil for other values.
function kind.of(value)
  if engine.is_view(value) then return "limax.view" end
  if type(value) ~= "table" then return nil end
  if scored_robot.is(value) then return "limax.scored_robot" end
  local class = getmetatable(value)
  if type(class) ~= "table" then return nil end
  for _, mark in ipairs(marks) do
    if rawget(value, mark[2]) ~= nil and rawget(value, mark[3]) ~= nil then return mark[1] end
  end
  local methods = rawget(class, "methods")
  local name = type(methods) == "table" and rawget(methods, "kind_name")
  return name and "limax." .. name or nil
end

return kind
