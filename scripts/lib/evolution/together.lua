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
-- s of steps that a GPU gets ahead: more than the host needs to end and write a generation
local AHEAD = 0.2
-- robots per multiprocessor, or per thread, that keep a device busy
local ROBOTS_PER_UNIT = 8

--- Begins with simulations; a GPU goes on with them while the host does other work.
---@param simulations limax.simulation[]
function together.begin(simulations) engine.begin_together(simulations, AHEAD) end

--- Advances simulations to their ends, in a run of together.run.
function together.wait(simulations) coroutine.yield(simulations) end

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
---@field waiting limax.together.waiting|nil for simulations; nil when it has ended

---@class limax.together.waiting
---@field left limax.simulation[] that have not ended
---@field progress table<limax.simulation, limax.progress> of each, when it was last advanced

local function waiting(simulations)
  return { left = { unpack(simulations) }, progress = {} }
end

-- Runs a repetition until it waits for simulations, or ends.
local function continue(member)
  local resumed, value, problem, trace = coroutine.resume(member.thread)
  if not resumed then error(value, 0) end -- an interrupt, which nothing catches
  local ended = coroutine.status(member.thread) == "dead"
  if ended and not value then failure.raise_again(problem, trace) end
  if ended then history.release(member.run.history) end
  member.waiting = not ended and waiting(value) or nil
end

-- Advances what is left by a slice, or by what a GPU has begun.
local function advance(each)
  local left, simulations = {}, each.left
  for k, progress in ipairs(engine.advance_together(simulations, SLICE)) do
    if progress.interrupted then
      host.raise_if_interrupted()
      error(host.interrupt, 0)
    end
    each.progress[simulations[k]] = progress
    if not progress.finished then left[#left + 1] = simulations[k] end
  end
  each.left = left
end

-- The sums over the simulations of one.
local function total(each)
  local sum = { done = 0, robots = 0, steps = 0, steps_total = 0, spring_steps = 0,
    finished = #each.left == 0, interrupted = false }
  for _, progress in pairs(each.progress) do
    for _, name in ipairs { "done", "robots", "steps", "steps_total", "spring_steps" } do
      sum[name] = sum[name] + progress[name]
    end
  end
  return sum
end

--- Advances simulations to their ends.
---@param simulations limax.simulation[]
---@param on_progress? fun(progress: limax.progress) called after each slice, with their sums
function together.finish(simulations, on_progress)
  local each = waiting(simulations)
  while #each.left > 0 do
    advance(each)
    if on_progress then on_progress(total(each)) end
  end
end

---@class limax.together.options
---@field repetitions integer[] in the order in which they begin
---@field at_once integer
---@field begin fun(repetition: integer): limax.run made with `wait = together.wait`
---@field on_progress fun(state: table) steps of steps_total are generations; spring_rate

--- Runs repetitions to their ends, and frees the robots of each. The first in the queue is waited
--- for and scored; a GPU steps the others meanwhile.
function together.run(options)
  local queue, left, springs, began = {}, { unpack(options.repetitions) }, 0, host.clock()

  local function go_on(member)
    if not member.waiting then continue(member) end
    if member.waiting then queue[#queue + 1] = member end
  end

  while true do
    while #queue < options.at_once and left[1] do
      local run = options.begin(table.remove(left, 1))
      go_on { run = run,
        thread = coroutine.create(function() return failure.attempt(run.finish, run) end) }
    end
    if #queue == 0 then return end
    local share, first = 0, queue[1].waiting
    for _, member in ipairs(queue) do together.begin(member.waiting.left) end
    advance(first)
    for _, member in ipairs(queue) do
      local state = total(member.waiting)
      springs = springs + state.spring_steps - (member.waiting.spring_steps or 0)
      member.waiting.spring_steps = state.spring_steps
      share = share + (state.steps_total > 0 and state.steps / state.steps_total or 0)
    end
    options.on_progress { steps = share, steps_total = 1,
      spring_rate = springs / (host.clock() - began) }
    local member = table.remove(queue, 1)
    if #first.left == 0 then member.waiting = nil end
    go_on(member)
  end
end

return together
