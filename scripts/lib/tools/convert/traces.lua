--- traces.lua: what a robot does, as NumPy arrays: simulated again as its file says, with the
--- traces that are asked for. SI units.

local ffi = require "ffi"
local arrays = require "limax.tools.convert.arrays"
local defaults = require "limax.settings.defaults"
local failure = require "limax.base.failure"
local robot_file = require "limax.robot.robot_file"
local suggest = require "limax.base.suggest"

local traces = {}

--- Rates of traces from words "position=50".
---@param words string[]
---@return table<string, integer>|nil none where there are no words
function traces.rates(words)
  if #words == 0 then return nil end
  local rates, field = {}, defaults.fields.record.rate
  for _, word in ipairs(words) do
    local name, text = word:match "^([%w_]+)=(.*)$"
    local rate, known = tonumber(text), false
    for _, kind in ipairs(defaults.traces) do known = known or kind == name end
    if not known then
      failure.raise(2, ("--record %s: expected TRACE=HZ%s"):format(word,
        suggest.ending(name or word, defaults.traces)))
    end
    if not rate or rate ~= math.floor(rate) or rate < 1 or rate > field.maximum then
      failure.raise(2, ("--record %s: expected a whole number from 1 to %d Hz"):format(word,
        field.maximum))
    end
    rates[name] = rate
  end
  return rates
end

--- Simulates a robot as its file says. It must end well.
---@param path string for messages
---@param robot limax.robot
---@param record table<string, integer>|nil in place of the file's own
---@param device string
---@return limax.scored_robot
function traces.simulate(path, robot, record, device)
  local fine, walked = failure.attempt(robot.simulate, robot, { record = record, device = device })
  if not fine then failure.raise(1, ("%s: %s"):format(path, failure.bare(walked))) end
  if walked.status ~= "done" then
    failure.raise(1, ("%s: the robot is %s%s"):format(path, walked.status,
      walked.reason and " (" .. walked.reason .. ")" or ""))
  end
  return walked
end

-- Numbers of [x][y][z], row by row.
local function flat(grid)
  local list = {}
  for _, plane in ipairs(grid) do
    for _, row in ipairs(plane) do
      for _, value in ipairs(row) do list[#list + 1] = value end
    end
  end
  return list
end

--- The arrays of a simulated robot: each trace and its times, the body, and where its masses lie in
--- the lattice.
---@param walked limax.scored_robot
---@return string the bytes of a .npz file
function traces.encode(walked)
  local context, list = walked.context, {}
  for _, kind in ipairs(defaults.traces) do
    if (context.options.record[kind] or 0) > 0 then
      local trace = walked:trace(kind)
      local count, times = 1, {}
      for _, length in ipairs(trace.shape) do count = count * length end
      for k = 1, trace.shape[1] do times[k] = (k - 1) / trace.rate end
      -- traces are doubles, row by row
      local data = ffi.string(trace:pointer(), count * ffi.sizeof "double")
      list[#list + 1] = { kind, arrays.encode("<f8", trace.shape, data) }
      list[#list + 1] = { kind .. "_time", arrays.of_list("<f8", { #times }, times) }
    end
  end
  local voxels = context.population:voxels(context.index):table()
  local lattice = { #voxels, #voxels[1], #voxels[1][1] }
  list[#list + 1] = { "voxels", arrays.of_list("|u1", lattice, flat(voxels)) }
  local weights = context.population:weights(context.index):table()
  for k, name in ipairs(robot_file.weights) do
    list[#list + 1] = { name, arrays.of_list("<f4", lattice, flat(weights[k])) }
  end
  local sites = context.simulation:sites(context.index):table()
  list[#list + 1] = { "sites", arrays.of_list("<i4", { #sites }, sites) }
  return arrays.pack(list)
end

return traces
