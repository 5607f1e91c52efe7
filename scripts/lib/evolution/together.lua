--- together.lua: several repetitions at a time, so that small populations share a device that none
--- of them fills. Each is a coroutine that goes on until it has robots to simulate; all that wait
--- are advanced together. No number depends on the others, so the bits are those of one after the
--- other.

local engine = require "limax.engine"
local failure = require "limax.base.failure"
local host = require "limax.host"

local together = {}

-- seconds of one slice: short enough for progress and Ctrl-C
local SLICE = 0.05
-- robots for each multiprocessor, or each thread, that keep a device busy
local ROBOTS_OF_UNIT = 8

local waiting = {} -- what is yielded first: no script can yield it

--- Advances a simulation to its end along with those of other repetitions. For runs that
--- `together.run` drives.
---@param simulation limax.simulation
function together.wait(simulation) coroutine.yield(waiting, simulation) end

--- How many repetitions at a time fill a device: two at least.
---@param device limax.device
---@param population integer robots of one repetition
---@return integer
function together.at_once(device, population)
  local units = 0
  for _, gpu in ipairs(device:describe().gpus or {}) do units = units + gpu.multiprocessors end
  if units == 0 then units = device.threads end
  return math.max(2, math.ceil(ROBOTS_OF_UNIT * units / population))
end

---@class limax.together.member one repetition on its way
---@field repetition integer
---@field thread thread
---@field simulation limax.simulation|nil that it waits for
---@field share number of that simulation that is done, 0 to 1
---@field before number spring steps of it when it was last looked at

---@class limax.together.options
---@field repetitions integer[] in the order in which they begin
---@field at_once integer
---@field begin fun(repetition: integer): limax.run made with `wait = together.wait`
---@field ended fun(repetition: integer)
---@field on_progress fun(state: table) steps of steps_total are generations; spring_rate

local function interrupted()
  host.raise_if_interrupted()
  error(host.interrupt, 0)
end

-- Lets a repetition go on until it waits for a simulation, or ends.
local function go_on(member)
  local resumed, token, simulation, trace = coroutine.resume(member.thread)
  -- an interrupt passes through everything
  if not resumed then error(token, 0) end
  member.simulation, member.share, member.before = nil, 0, 0
  if coroutine.status(member.thread) == "dead" then
    local fine, problem = token, simulation
    if not fine then failure.raise_again(problem, trace) end
  elseif token == waiting then
    member.simulation = simulation
  else
    failure.raise(1, "a function of the experiment calls coroutine.yield outside a coroutine")
  end
end

local function make(given, repetition)
  local run = given.begin(repetition)
  local member = { repetition = repetition,
    thread = coroutine.create(function() return failure.attempt(run.finish, run) end) }
  go_on(member)
  return member
end

--- Runs repetitions to their ends.
---@param given limax.together.options
function together.run(given)
  local active, next_one = {}, 1
  local springs, seconds = 0, 0
  while true do
    while #active < given.at_once and given.repetitions[next_one] do
      local member = make(given, given.repetitions[next_one])
      next_one = next_one + 1
      if member.simulation then
        active[#active + 1] = member
      else
        given.ended(member.repetition)
      end
    end
    if #active == 0 then return end

    local simulations = {}
    for i, member in ipairs(active) do simulations[i] = member.simulation end
    local began = host.clock()
    local progress = engine.advance_together(simulations, SLICE)
    seconds = seconds + host.clock() - began
    local share = 0
    for i, member in ipairs(active) do
      local state = progress[i]
      if state.interrupted then interrupted() end
      springs, member.before = springs + state.spring_steps - member.before, state.spring_steps
      member.share = state.steps_total > 0 and state.steps / state.steps_total or 0
      share = share + member.share
    end
    given.on_progress { steps = share, steps_total = 1, spring_rate = springs / seconds }

    local left = {}
    for i, member in ipairs(active) do
      if progress[i].finished then go_on(member) end
      if member.simulation then
        left[#left + 1] = member
      else
        given.ended(member.repetition)
      end
    end
    active = left
  end
end

return together
