--- fitness.lua: the library of fitness functions. Each takes a scored robot and gives one number to
--- be maximised. SI units; x and y are horizontal; t = 0 is when actuation starts; r is the centre
--- of mass in the x-y plane, z its height, T the duration.

local choice = require "limax.base.choice"
local engine = require "limax.engine"
local measured = require "limax.robot.measured"
local schema = require "limax.engine.schema"
local scored_robot = require "limax.robot.scored_robot"
local strict = require "limax.engine.strict"

local fitness = strict.module "limax.fitness"

-- m/s^2; only normalises `efficiency`
local standard_gravity = 9.81

local idle_power = { value = 0.1, unit = "W/kg", minimum = 0, maximum = 1000,
  note = "a tenth of a resting mammal's, far below what a gait costs" }
local least_path = { value = 0.1, unit = "m", minimum = 0, maximum = 1e6,
  note = "one voxel of the default edge" }

---@class limax.fitness.entry: limax.choice.entry
---@field unit string
---@field formula string
---@field record fun(options: table): table traces that it reads, samples per second

local axis = schema.choice { "x", "y", "z" }
local case_rule = schema.number { unit = "equal parts of the run", minimum = 1, maximum = 1000,
  integer = true }

local function no_traces() return {} end
local function path_trace() return { center_of_mass = 50 } end

--- Unit, formula, options and traces of each function, by its name.
---@type table<string, limax.fitness.entry>
fitness.entries = {
  walk = {
    unit = "m",
    formula = "2 |r(T) - r(T/2)|",
    options = { axis = axis },
    record = no_traces,
  },
  carry = {
    unit = "m",
    formula = "2 |b(T) - b(T/2)|, b the centre of the scene's first block in the x-y plane",
    options = { axis = axis },
    record = no_traces,
  },
  distance = {
    unit = "m",
    formula = "|r(T) - r(0)|",
    options = { axis = axis, cases = case_rule },
    record = function(options) return options.cases and path_trace() or {} end,
  },
  target = {
    unit = "m",
    formula = "|g - r(0)| - |g - r(T)|, g the scene's target in the x-y plane; of several, the sum"
      .. " over the time that each is seen",
    record = no_traces,
  },
  speed = {
    unit = "m/s; with body_lengths = true, body lengths per second",
    formula = "|r(T) - r(0)| / T, divided by the longer horizontal side of the body at rest",
    options = { axis = axis, body_lengths = schema.boolean(false) },
    record = no_traces,
  },
  height = {
    unit = "m",
    formula = "max over samples of z(t) - z(0)",
    record = path_trace,
  },
  efficiency = {
    unit = "1",
    formula = "m g |r(T) - r(0)| / (W + idle_power m T), W the positive work of the muscles",
    options = { idle_power = schema.number(idle_power) },
    record = function() return { energy = 200 } end,
  },
  straightness = {
    unit = "1",
    formula = "|r(T) - r(0)| / s, s the length of the path of r; 0 while s < least_path",
    options = { least_path = schema.number(least_path) },
    record = path_trace,
  },
}

--- Twice the horizontal distance of the run's second half, m, so that falling over or one jump does
--- not count. With `axis`, its signed part along x, y or z.
---@param robot limax.scored_robot
---@param options? { axis?: "x"|"y"|"z" }
---@return number
function fitness.walk(robot, options)
  return 2 * measured.distance(robot, "middle", options and options.axis)
end

--- Twice the horizontal displacement of the scene's first block in the run's second half, m, so
--- that falling against it once does not count. With `axis`, its signed part along x, y or z.
---@param robot limax.scored_robot
---@param options? { axis?: "x"|"y"|"z" }
---@return number
function fitness.carry(robot, options)
  local block = robot:block { from = "middle" }
  local along = options and ({ x = 1, y = 2, z = 3 })[options.axis]
  return 2 * (along and block.displacement[along] or block.distance)
end

-- Distance covered in each of `count` equal parts of the run, m; `along` is 1, 2, 3 or nil for the
-- x-y plane.
local function parts(robot, count, along)
  local path = robot:trace "center_of_mass"
  local samples, list = path:size(), {}
  for part = 1, count do
    local first = 1 + math.floor((part - 1) * (samples - 1) / count)
    local last = 1 + math.floor(part * (samples - 1) / count)
    local dx, dy = path[last][1] - path[first][1], path[last][2] - path[first][2]
    list[part] = along and path[last][along] - path[first][along] or math.sqrt(dx * dx + dy * dy)
  end
  return list
end

--- Horizontal distance from t = 0 to the end, m. With `axis`, its signed part. With `cases = n`,
--- also the distances of n equal parts of the run, for lexicase selection.
---@param robot limax.scored_robot
---@param options? { axis?: "x"|"y"|"z", cases?: integer }
---@return number
---@return number[]? cases
function fitness.distance(robot, options)
  local along = options and options.axis
  local whole = measured.distance(robot, "start", along)
  if not (options and options.cases) then return whole end
  return whole, parts(robot, options.cases, ({ x = 1, y = 2, z = 3 })[along])
end

--- How much nearer to the scene's target, horizontally, the centre of mass is at the end, m. Of
--- targets that appear one after the other, the sum over the time that each is seen; that reads the
--- trace "center_of_mass".
---@param robot limax.scored_robot
---@return number
function fitness.target(robot)
  local targets = robot.context.scene.target
  if not targets then
    engine.fail('scene.target: the fitness "target" needs one; limax.scenes.land { target = true }'
      .. " has one")
  end
  local outcome, duration = measured.outcome(robot, "target"), robot:duration()
  local function center_at(time)
    if time <= 0 then return { outcome.center_start[0], outcome.center_start[1] } end
    if time >= duration then return { outcome.center_end[0], outcome.center_end[1] } end
    local path = robot:trace "center_of_mass"
    return path[1 + math.floor(time / duration * (path:size() - 1) + 0.5)]
  end
  local sum = 0
  for k, target in ipairs(targets) do
    local goal = target.position
    local function away(center)
      local x, y = goal[1] - center[1], goal[2] - center[2]
      return math.sqrt(x * x + y * y)
    end
    local next_time = targets[k + 1] and targets[k + 1].time or duration
    sum = sum + (away(center_at(target.time)) - away(center_at(next_time)))
  end
  return sum
end

--- Mean horizontal speed of the whole run, m/s, or body lengths per second.
---@param robot limax.scored_robot
---@param options? { axis?: "x"|"y"|"z", body_lengths?: boolean }
---@return number
function fitness.speed(robot, options)
  local distance = measured.distance(robot, "start", options and options.axis)
  local speed = distance / robot:duration()
  if not (options and options.body_lengths) then return speed end
  return speed / robot:length()
end

--- Highest rise of the centre of mass above its place at t = 0, m.
---@param robot limax.scored_robot
---@return number
function fitness.height(robot) return robot:height() end

--- Weight times distance per joule of the muscles: the inverse of a cost of transport, 1. The cost
--- includes `idle_power`, else a body that barely moves divides two tiny numbers.
---@param robot limax.scored_robot
---@param options? { idle_power?: number } W/kg
---@return number
function fitness.efficiency(robot, options)
  local idle = options and options.idle_power or idle_power.value
  local mass = robot:mass()
  local paid = robot:energy().muscle_work + idle * mass * robot:duration()
  local gained = mass * standard_gravity * measured.distance(robot)
  return paid > 0 and gained / paid or 0
end

--- Distance over the length of the path, 0 to 1; 0 for paths below `least_path`.
---@param robot limax.scored_robot
---@param options? { least_path?: number } m
---@return number
function fitness.straightness(robot, options)
  local least = options and options.least_path or least_path.value
  local path = robot:path_length()
  return path > 0 and path >= least and measured.distance(robot) / path or 0
end

-- The names of the functions, which an experiment may pass instead.
local name_of = {}

-- An experiment names a function, `fitness = "walk"`; `fitness = limax.fitness.walk()` calls it.
for name in pairs(fitness.entries) do
  local law = fitness[name]
  local what = "limax.fitness." .. name
  local check = schema.fields(fitness.entries[name].options or {})
  rawset(fitness, name, function(robot, options, ...)
    if not scored_robot.is(robot) then
      engine.fail(("limax.fitness.%s: expected a robot that was simulated, got %s; an experiment"
        .. " names the function: fitness = %q, or { %q, option = value }"):format(name,
        schema.show(robot), name, name))
    end
    if options ~= nil then schema.demand(check, options, what) end
    return law(robot, options, ...)
  end)
  name_of[fitness[name]] = name
end

---@class limax.fitness
---@field name string a library name, or "function"
---@field call fun(robot: limax.scored_robot): number, number[]?
---@field record table<string, number> traces that it reads, samples per second
---@field options table resolved options of a library fitness

-- The mean over the trials of a robot. The cases are those of each trial, else its score.
local function averaged(call, trials)
  local sum, cases = 0, {}
  for _, trial in ipairs(trials) do
    local score, own = call(trial)
    sum = sum + score
    for _, case in ipairs(own or { score }) do cases[#cases + 1] = case end
  end
  return sum / #trials, cases
end

--- The fitness that an experiment names: a library name, { name, option = value }, or a function,
--- whose traces the experiment lists in `record`.
---@param spec string|table|fun(robot: limax.scored_robot): number, number[]?
---@return limax.fitness
function fitness.get(spec)
  -- called with the state of an experiment, it would take that for its options
  spec = name_of[spec] or spec
  if type(spec) == "function" then
    return { name = "function", call = spec, record = {}, options = {} }
  end
  local name, options = choice.read("fitness", spec, fitness.entries)
  local law = fitness[name]
  -- a function without options takes none
  local given = next(options) and options or nil
  local function call(robot) return law(robot, given) end
  return {
    name = name,
    call = function(robot)
      if not scored_robot.has_trials(robot) then return call(robot) end
      local trials = robot.trials
      if #trials == 1 then return call(trials[1]) end
      return averaged(call, trials)
    end,
    record = fitness.entries[name].record(options),
    options = options,
  }
end

return strict.close("limax.fitness", fitness)
