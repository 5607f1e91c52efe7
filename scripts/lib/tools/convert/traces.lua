--- traces.lua: a robot simulated again as its file describes, and its traces, body and weights as
--- NumPy arrays. SI units.

local ffi = require "ffi"
local defaults = require "limax.settings.defaults"
local failure = require "limax.base.failure"
local npy = require "limax.base.npy"
local robot_file = require "limax.robot.robot_file"
local settings = require "limax.settings.settings"

local traces = {}

--- Rates of traces, Hz, from words such as "position=50".
---@return table<string, integer>|nil rates nil without words
function traces.rates(words)
  if #words == 0 then return nil end
  local rates = {}
  for _, word in ipairs(words) do
    local name, rate = word:match "^([%w_]+)=(.*)$"
    if not name then failure.raise(2, ("--record %s: expected TRACE=HZ"):format(word)) end
    rates[name] = tonumber(rate) or rate
  end
  local checked, message = settings.record(rates, "--record")
  if not checked then failure.raise(2, message) end
  return rates
end

--- Simulates a robot as its file describes. A simulation that fails ends the command.
---@param record table<string, integer>|nil rates that replace the file's own
function traces.simulate(path, robot, record, device)
  local succeeded, simulated = failure.attempt(robot.simulate, robot,
    { record = record, device = device })
  if not succeeded then failure.raise(1, ("%s: %s"):format(path, failure.bare(simulated))) end
  if simulated.status ~= "done" then
    failure.raise(1, ("%s: the robot is %s%s"):format(path, simulated.status,
      simulated.reason and " (" .. simulated.reason .. ")" or ""))
  end
  return simulated
end

-- The values of nested lists in row-major order.
local function flattened(grid, list)
  list = list or {}
  if type(grid) ~= "table" then list[#list + 1] = grid end
  for _, part in ipairs(type(grid) == "table" and grid or {}) do flattened(part, list) end
  return list
end

--- The traces of a simulated robot with their times, its body, and the site of each mass.
---@return string bytes of a .npz file
function traces.encode(simulated)
  local context, list = simulated.context, {}
  local function add(name, kind, shape, data)
    list[#list + 1] = { name, npy.encode(kind, shape, data) }
  end
  for _, kind in ipairs(defaults.traces) do
    if (context.options.record[kind] or 0) > 0 then
      local trace = simulated:trace(kind)
      local count, times = 1, {}
      for _, length in ipairs(trace.shape) do count = count * length end
      for k = 1, trace.shape[1] do times[k] = (k - 1) / trace.rate end
      add(kind, "<f8", trace.shape, ffi.string(trace:pointer(), count * ffi.sizeof "double"))
      add(kind .. "_time", "<f8", { #times }, times)
    end
  end
  local voxels = context.population:voxels(context.index):table()
  local lattice = { #voxels, #voxels[1], #voxels[1][1] }
  add("voxels", "|u1", lattice, flattened(voxels))
  local weights = context.population:weights(context.index):table()
  for k, name in ipairs(robot_file.weights) do add(name, "<f4", lattice, flattened(weights[k])) end
  local sites = context.simulation:sites(context.index):table()
  add("sites", "<i4", { #sites }, sites)
  return npy.pack(list)
end

return traces
