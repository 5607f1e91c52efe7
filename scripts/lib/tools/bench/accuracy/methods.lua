--- methods.lua: the integrators and precisions that a build and a device have, found by asking the
--- engine, and how tables and figures name them.

local engine = require "limax.engine"
local failure = require "limax.base.failure"

local methods = {}

methods.INTEGRATORS = { "symplectic_euler", "leapfrog", "rk4", "xpbd" }
methods.PRECISIONS = { "single", "compensated", "mixed", "double" }

--- Names for people.
methods.LABELS = { symplectic_euler = "symplectic Euler", leapfrog = "leapfrog", rk4 = "RK4",
  xpbd = "XPBD" }

--- The paper's setting as this library reads it: the paper names no integrator and no precision;
--- its step is 1e-5 s.
methods.PAPER = { integrator = "symplectic_euler", precision = "single", time_step = 1e-5 }

--- Why a device that is none does not take what the CPU takes.
methods.CPU_ONLY = "CPU only"

--- Why the engine takes no simulation with these options in this scene; nil where it does.
---@param trial { population: limax.population, materials: limax.materials, scene: limax.scene }
---@param options table as engine.simulation takes them
---@param device limax.device
---@return string|nil
function methods.refusal(trial, options, device)
  local fine, value =
    failure.attempt(engine.simulation, trial.population, trial.materials, trial.scene, options,
      device)
  if fine then
    value:free "it was made to see whether it can be"
    return nil
  end
  if failure.of_machine(value) then error(value, 0) end
  local said = failure.bare(value)
  return said:match "simulation: (.*)$" or said
end

--- The same in few words: "CPU only" where the CPU takes what this device does not.
---@param trial { population: limax.population, materials: limax.materials, scene: limax.scene }
---@param options table
---@param device limax.device
---@return string|nil
function methods.brief_refusal(trial, options, device)
  local why = methods.refusal(trial, options, device)
  if not why or device.kind == "cpu" then return why end
  return methods.refusal(trial, options, engine.device "cpu") and why or methods.CPU_ONLY
end

--- Is this integrator in the build at all?
---@param integrator string
---@return boolean
function methods.in_build(integrator)
  return engine.names.integrator.value[integrator] ~= nil
end

return methods
