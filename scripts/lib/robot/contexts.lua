--- contexts.lua: where the records of a generation's robots come from: each is made when its robot
--- is first asked for it.

local contexts = {}

--- Where a record comes from. Traces need `simulation`, the genome needs `population`.
---@class limax.robot.context
---@field population? limax.population of the engine
---@field index? integer in it
---@field simulation? limax.simulation of the engine
---@field materials limax.materials
---@field scene table
---@field options table settings of the simulation, with `record` and `edge`
---@field fitness? any as robot files keep it
---@field trials? limax.robot.context[] of each trial, where there are any

---@class limax.robot.contexts
---@field have_trials boolean
---@field simulated table<integer, limax.simulation[]> by index of a robot: one per trial
---@field [integer] limax.robot.context
local Contexts = {}

--- Where the record of robot i comes from.
---@param robots limax.population.scored
---@param simulations? limax.simulation[] one per trial; none after its traces have ended
---@param materials? limax.materials the generation's if left out
---@param options? table[] of each trial; its own if left out
---@return limax.robot.context
function contexts.of_robot(robots, i, simulations, materials, options)
  materials, simulations = materials or robots.materials, simulations or {}
  local function context(k)
    local trial = robots.trials[k]
    return { population = robots.engine, index = i, materials = materials, scene = trial.scene,
      options = options and options[k] or trial.options, simulation = simulations[k] }
  end
  local whole, config = context(1), robots.world.config
  whole.fitness = config.fitness
  if config.trials then
    whole.trials = {}
    for k, trial in ipairs(robots.trials) do
      whole.trials[k] = context(k)
      whole.trials[k].materials = trial.engine_materials or materials
    end
  end
  return whole
end

--- The contexts of a generation. `robots.on_disk` is the metatable of those without a population.
---@param robots limax.population.scored
---@return limax.robot.contexts
function contexts.of(robots)
  return setmetatable({ have_trials = robots.world.config.trials ~= nil, simulated = {} }, {
    __index = function(self, i)
      if type(i) == "string" then return Contexts[i] end
      local context = contexts.of_robot(robots, i, self.simulated[i])
      for _, each in ipairs { context, unpack(context.trials or {}) } do
        setmetatable(each, robots.on_disk)
      end
      rawset(self, i, context)
      return context
    end,
  })
end

--- Names the simulations of robot i, one per trial; none ends its traces.
---@param i integer
---@param simulations? limax.simulation[]
function Contexts:simulate(i, simulations)
  self.simulated[i] = simulations
  local context = rawget(self, i)
  if not context then return end
  for k, each in ipairs(context.trials or { context }) do
    each.simulation = simulations and simulations[k]
  end
  context.simulation = simulations and simulations[1]
end

return contexts
