--- together.lua: the repetitions of an experiment, one or several at a time, so that small
--- populations share a device that none of them fills. A generation waits at one place only, for
--- its simulations: a queue is enough. No number depends on the other repetitions.

local evolve = require "limax.evolution.evolve"
local generations = require "limax.evolution.generation"
local history = require "limax.run.history"
local host = require "limax.host"

local together = {}

-- robots per multiprocessor, or per thread, that keep a device busy
local ROBOTS_PER_UNIT = 8

--- How many repetitions at a time fill a device: at least two.
---@param population integer robots of one repetition
function together.at_once(device, population)
  local units = 0
  for _, gpu in ipairs(device:describe().gpus or {}) do units = units + gpu.multiprocessors end
  if units == 0 then units = device.threads end
  return math.max(2, math.ceil(ROBOTS_PER_UNIT * units / population))
end

---@class limax.together.options
---@field repetitions integer[] in the order in which they begin
---@field at_once integer
---@field begin fun(repetition: integer): limax.run
---@field on_progress fun(state: table) steps of steps_total are generations; done of robots are
--- simulations; time of duration, s, is their mean; spring_rate

-- Shows how far the generations of the queue are, and the rate of all since `began`.
local function show(options, queue, springs, began)
  local share, done, robots, time, duration = 0, 0, 0, 0, 0
  for _, run in ipairs(queue) do
    local going = run.population.going
    local state = going and going.steps:total()
    if state then
      springs.sum = springs.sum + state.spring_steps - (springs[going] or 0)
      springs[going] = state.spring_steps
      local own = state.steps_total > 0 and state.steps / state.steps_total or 0
      share, done, robots = share + own, done + state.done, robots + state.robots
      for _, trial in ipairs(run.population.trials) do
        local whole = trial.options.duration * state.robots / #run.population.trials
        time, duration = time + own * whole, duration + whole
      end
    end
  end
  options.on_progress { steps = share, steps_total = 1, done = done, robots = robots,
    time = time / math.max(robots, 1), duration = duration / math.max(robots, 1),
    spring_rate = springs.sum / (host.clock() - began) }
end

-- Ends a repetition that has no further generation, and frees its robots.
local function close(run)
  run:close()
  history.release(run.history)
end

-- Takes the first repetition that does not wait for memory out of a queue, or the first one.
local function take(queue)
  for k, run in ipairs(queue) do
    if not run.population.waits then return table.remove(queue, k) end
  end
  queue[1].population.waits = nil
  return table.remove(queue, 1)
end

--- Runs repetitions to their ends. The first in the queue is waited for, scored and bred from; a
--- GPU steps the others meanwhile, as far as its memory is enough.
function together.run(options)
  local queue, left, began = {}, { unpack(options.repetitions) }, host.clock()
  local springs = setmetatable({ sum = 0 }, { __mode = "k" })
  while queue[1] or left[1] do
    while #queue < options.at_once and left[1] do
      local run = options.begin(table.remove(left, 1))
      run.world.make_room = function()
        for _, other in ipairs(queue) do generations.wait(other.population) end
      end
      run.ahead, run.population = generations.begin_beside, evolve.first(run)
      queue[#queue + 1] = run
    end
    for _, run in ipairs(queue) do generations.begin_beside(run.population) end
    show(options, queue, springs, began)
    local run = take(queue)
    if generations.advance(run.population) then
      run.population = evolve.next(run, run.population)
    end
    if run.population then queue[#queue + 1] = run else close(run) end
  end
end

return together
