--- together.lua: the repetitions of an experiment, one or several at a time. Each is a coroutine
--- that runs until it has robots to simulate; the simulations of all are advanced together, so that
--- small populations share a device that none of them fills. No number depends on the other
--- repetitions.

local engine = require "limax.engine"
local failure = require "limax.base.failure"
local history = require "limax.run.history"
local host = require "limax.host"

local together = {}

-- s of one slice of wall time: short enough for progress and Ctrl-C
local SLICE = 0.05
-- robots per multiprocessor, or per thread, that keep a device busy
local ROBOTS_PER_UNIT = 8

--- Advances a simulation to its end, in a run of together.run.
function together.wait(simulation) coroutine.yield(simulation) end

--- How many repetitions at a time fill a device: at least two.
---@param population integer robots of one repetition
function together.at_once(device, population)
  local units = 0
  for _, gpu in ipairs(device:describe().gpus or {}) do units = units + gpu.multiprocessors end
  if units == 0 then units = device.threads end
  return math.max(2, math.ceil(ROBOTS_PER_UNIT * units / population))
end

---@class limax.together.member a repetition that has begun
---@field run limax.run
---@field thread thread
---@field simulation limax.simulation|nil that it waits for; nil when it has ended
---@field spring_steps number of that simulation, when it was last advanced

-- Runs a repetition until it waits for a simulation, or ends.
local function continue(member)
  local resumed, value, problem, trace = coroutine.resume(member.thread)
  if not resumed then error(value, 0) end -- an interrupt, which nothing catches
  local ended = coroutine.status(member.thread) == "dead"
  if ended and not value then failure.raise_again(problem, trace) end
  if ended then history.release(member.run.history) end
  member.simulation, member.spring_steps = not ended and value or nil, 0
end

-- Advances the simulations of all members by a slice. Returns their progress.
local function advance(members)
  local simulations = {}
  for i, member in ipairs(members) do simulations[i] = member.simulation end
  local progress = engine.advance_together(simulations, SLICE)
  for _, state in ipairs(progress) do
    if state.interrupted then
      host.raise_if_interrupted()
      error(host.interrupt, 0)
    end
  end
  return progress
end

---@class limax.together.options
---@field repetitions integer[] in the order in which they begin
---@field at_once integer
---@field begin fun(repetition: integer): limax.run made with `wait = together.wait`
---@field on_progress fun(state: table) steps of steps_total are generations; spring_rate

--- Runs repetitions to their ends, and frees the robots of each.
function together.run(options)
  local active, left, springs, seconds = {}, { unpack(options.repetitions) }, 0, 0

  -- Continues some members; those that still wait for a simulation become the active ones.
  local function keep_waiting(members)
    active = {}
    for _, member in ipairs(members) do
      if not member.simulation then continue(member) end
      active[#active + 1] = member.simulation and member
    end
  end

  while true do
    while #active < options.at_once and left[1] do
      local repetition = table.remove(left, 1)
      local run = options.begin(repetition)
      local members = { unpack(active) }
      members[#members + 1] = { run = run,
        thread = coroutine.create(function() return failure.attempt(run.finish, run) end) }
      keep_waiting(members)
    end
    if #active == 0 then return end
    local began, share = host.clock(), 0
    local progress = advance(active)
    seconds = seconds + host.clock() - began
    for i, member in ipairs(active) do
      local state = progress[i]
      springs = springs + state.spring_steps - member.spring_steps
      member.spring_steps = state.spring_steps
      share = share + (state.steps_total > 0 and state.steps / state.steps_total or 0)
      if state.finished then member.simulation = nil end
    end
    options.on_progress { steps = share, steps_total = 1, spring_rate = springs / seconds }
    keep_waiting(active)
  end
end

return together
