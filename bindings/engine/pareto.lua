--- pareto.lua: non-dominated ranks and crowding distances (NSGA-II).

local ffi = require "ffi"
local abi = require "limax.engine.abi"
local schema = require "limax.engine.schema"
local view = require "limax.engine.view"

local C = abi.C

-- [point][objective]
local function values_of(points, objectives)
  local values = ffi.new("double[?]", math.max(#points * objectives, 1))
  for i = 1, #points do
    local point = points[i]
    if type(point) ~= "table" or #point ~= objectives then
      schema.refuse(("pareto: points[%d]"):format(i), ("a list of %d numbers"):format(objectives),
        point, type(point) == "table" and #point)
    end
    for k = 1, objectives do
      local value = point[k]
      if type(value) ~= "number" or value ~= value then
        schema.refuse(("pareto: points[%d][%d]"):format(i, k), "a number", value)
      end
      values[(i - 1) * objectives + k - 1] = value
    end
  end
  return values
end

--- Pareto ranks of points, larger is better in each of up to 8 objectives, and their crowding
--- distances in their rank: the sum over objectives of the gap between the neighbours, divided by
--- the extent of the rank; infinite at its ends. Equal points have the same rank; the first of them
--- has the distance, the others 0.
---@param points number[][]|limax.view [point][objective]
---@return integer[] ranks from 1, the front
---@return number[] crowding
local function pareto(points)
  if view.is_view(points) then points = points:table() end
  schema.demand(schema.table, points, "pareto: points")
  local count, objectives = #points, 1
  if count > 0 then objectives = #schema.demand(schema.table, points[1], "pareto: points[1]") end
  local values = values_of(points, objectives)
  local rank, distance = ffi.new("int32_t[?]", count + 1), ffi.new("double[?]", count + 1)
  abi.check(C.limax_pareto_rank(values, count, objectives, rank, distance), "pareto")
  local ranks, crowding = {}, {}
  for i = 1, count do ranks[i], crowding[i] = rank[i - 1] + 1, distance[i - 1] end
  return ranks, crowding
end

return pareto
