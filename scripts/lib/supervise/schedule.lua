--- schedule.lua: parameters set in advance as lines over generations. With { "schedule",
--- mutation_scale = { { 0, 0.2 }, { 39, 0.02 } } } the scale falls from 0.2 to 0.02 between
--- generations 0 and 39 and then stays. Generation 0 itself has the experiment's own parameters.
--- Source: deterministic control in Eiben, Hinterding, Michalewicz, "Parameter control in
--- evolutionary algorithms" (1999); EvoGym's genetic algorithm lets its share of elites fall so.

local schema = require "limax.engine.schema"

local proposals = require "limax.supervise.proposals"

local parameters = proposals.parameters

-- Points { generation, value }, generations rising.
local function points_rule(value, path)
  if value == nil then return nil end
  local expected = "a list of points { generation, value }, such as { { 0, 0.2 }, { 39, 0.02 } }"
  local number = schema.number { unit = "" }
  local point = schema.list(number, { count = 2, expected = "a point { generation, value }" })
  local points, message = schema.list(point, { expected = expected })(value, path)
  if not points then return nil, message end
  if #points == 0 then return nil, ("%s: expected %s, got no point"):format(path, expected) end
  for k = 2, #points do
    if points[k][1] <= points[k - 1][1] then
      return nil, ("%s[%d]: generation %g does not come after %g")
        :format(path, k, points[k][1], points[k - 1][1])
    end
  end
  return points
end

-- The line through the points, constant before the first and after the last; "geometric" is a line
-- in the logarithm.
local function value_at(points, generation, shape)
  if generation <= points[1][1] then return points[1][2] end
  for k = 2, #points do
    local from, to = points[k - 1], points[k]
    if generation < to[1] then
      local share = (generation - from[1]) / (to[1] - from[1])
      if shape == "step" then return from[2] end
      if shape == "geometric" and from[2] > 0 and to[2] > 0 then
        return from[2] * (to[2] / from[2]) ^ share
      end
      return from[2] + share * (to[2] - from[2])
    end
  end
  return points[#points][2]
end

local options = {
  shape = function(value, path)
    return schema.choice { "linear", "geometric", "step" }(value == nil and "linear" or value, path)
  end,
}
for _, name in ipairs(parameters) do options[name] = points_rule end

return {
  options = options,
  by_generation = true,
  changes = function(chosen)
    local list = {}
    for _, name in ipairs(parameters) do list[#list + 1] = chosen[name] and name end
    return list
  end,
  unfit = function(chosen, config)
    for _, limit in ipairs(proposals.limits(config.population, config.supervision.ranges)) do
      for k, point in ipairs(chosen[limit.field] or {}) do
        if point[2] < limit.minimum or point[2] > limit.maximum then
          return ("%s[%d] is { %g, %.6g }: expected a value from %.6g to %.6g, the range of every"
            .. " proposal"):format(limit.field, k, point[1], point[2], limit.minimum, limit.maximum)
        end
      end
    end
  end,
  note = function(chosen, config)
    local last = config.generations - 1
    for _, name in ipairs(parameters) do
      local points = chosen[name]
      if points and points[#points][1] > last then
        return ('supervisor "schedule": %s ends at generation %g, and the run at %d, so it does not'
          .. " reach %.6g"):format(name, points[#points][1], last, points[#points][2])
      end
    end
  end,
  make = function(chosen)
    return function(history)
      local coming = history[#history].generation + 1
      local proposal
      for _, name in ipairs(parameters) do
        if chosen[name] then
          proposal = proposal or {}
          proposal[name] = value_at(chosen[name], coming, chosen.shape)
        end
      end
      if not proposal then return nil, "the schedule is empty" end
      return proposal, ("schedule for generation %d"):format(coming)
    end
  end,
}
