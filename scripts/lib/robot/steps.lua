--- steps.lua: simulations that are advanced together, in slices of wall time.

local engine = require "limax.engine"
local host = require "limax.host"

local steps = {}

-- s of one slice of wall time: short enough for progress and Ctrl-C
local SLICE = 0.05
-- s of steps that a GPU gets ahead: more than the host needs to end and write a generation
local AHEAD = 0.2

---@class limax.steps
---@field all limax.simulation[]
---@field left limax.simulation[] that have not ended
---@field progress table<limax.simulation, limax.progress> of each, when it was last advanced
local Steps = {}
Steps.__index = Steps

function steps.new(simulations)
  return setmetatable({ all = simulations, left = { unpack(simulations) }, progress = {} }, Steps)
end

--- Lets a GPU go on while the host does other work; on the CPU this does nothing.
function Steps:begin() engine.begin_together(self.left, AHEAD) end

--- Advances what is left by a slice, or by what a GPU has begun.
---@return boolean ended
function Steps:advance()
  local left, simulations = {}, self.left
  for k, progress in ipairs(engine.advance_together(simulations, SLICE)) do
    if progress.interrupted then
      host.raise_if_interrupted()
      error(host.interrupt, 0)
    end
    self.progress[simulations[k]] = progress
    if not progress.finished then left[#left + 1] = simulations[k] end
  end
  self.left = left
  return #left == 0
end

--- The sums over the simulations.
function Steps:total()
  local sum = { done = 0, robots = 0, steps = 0, steps_total = 0, spring_steps = 0,
    finished = #self.left == 0, interrupted = false }
  for _, progress in pairs(self.progress) do
    for _, name in ipairs { "done", "robots", "steps", "steps_total", "spring_steps" } do
      sum[name] = sum[name] + progress[name]
    end
  end
  return sum
end

--- Advances simulations to their ends.
---@param on_progress? fun(progress: table) called after each slice
function steps.finish(simulations, on_progress)
  local going = steps.new(simulations)
  while #going.left > 0 do
    going:advance()
    if on_progress then on_progress(going:total()) end
  end
end

return steps
