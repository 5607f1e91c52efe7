--- outcome.lua: the outcome of a robot's simulation, as the engine's struct and as a table.

local C = require("limax.engine.abi").C
local names = require "limax.engine.names"

local outcome = {}

---@class limax.outcome
---@field status "skipped"|"running"|"done"|"invalid"|"diverged"
---@field reason string|nil "no voxel", "no muscle"; "nonfinite", "speed", "stretch", "control"
---@field step integer steps done since the start of settling
---@field steps integer steps in all
---@field time number s since t = 0, negative while settling
---@field time_step number s
---@field time_step_bound number|nil s; nil if nothing moves
---@field masses integer
---@field springs integer
---@field coarse boolean a mass was seen to move farther than a tenth of an edge in one step
---@field mass number kg
---@field center_start number[] centre of mass at t = 0, m
---@field center_middle number[] after half of the steps from t = 0
---@field center_end number[] at the end
---@field path_length number|nil m; this and the following: nil where their trace is not recorded
---@field height number|nil m
---@field contact number|nil 1
---@field kinetic number|nil J
---@field elastic number|nil J
---@field muscle_work number|nil J
---@field strain number|nil 1
---@field strain_most number|nil 1
---@field block_start number[]|nil centre of the first rigid block at t = 0, m; nil without one
---@field block_middle number[]|nil after half of the steps from t = 0
---@field block_end number[]|nil at the end
---@field block_velocity number[]|nil at the end, m/s
---@field block_upright number|nil cosine of the angle between its own z axis and the world's, there

local NUMBERS = {
  "time", "time_step", "time_step_bound", "masses", "springs", "mass",
  "path_length", "height", "contact", "kinetic", "elastic", "muscle_work", "strain", "strain_most",
  "block_upright",
}
local PLACES = { "center_start", "center_middle", "center_end", "block_start", "block_middle",
  "block_end", "block_velocity" }

--- Status of an outcome, and the reason if it is not "done".
---@param o ffi.cdata* limax_outcome
---@return string status
---@return string|nil reason
function outcome.status(o)
  local status = names.robot_status.text[o.status]
  if status == "invalid" then return status, names.body_status.text[o.reason] end
  if status == "diverged" then return status, names.divergence.text[o.reason] end
  return status, nil
end

--- The numbers of an outcome as a table.
---@param o ffi.cdata* limax_outcome
function outcome.table(o)
  local result = { step = tonumber(o.step), steps = tonumber(o.steps), coarse = o.coarse ~= 0 }
  result.status, result.reason = outcome.status(o)
  for _, name in ipairs(NUMBERS) do
    local value = o[name]
    if value == value then result[name] = value end
  end
  for _, name in ipairs(PLACES) do
    local place = o[name]
    -- a scene without a block has no numbers for it; those of a body are kept as they are
    if place[0] == place[0] or not name:find "^block" then
      result[name] = { place[0], place[1], place[2] }
    end
  end
  return result
end

--- The outcomes of a simulation's robots in the engine.
---@return ffi.cdata* limax_outcome[simulation.count]
function outcome.all(simulation) return C.limax_simulation_outcomes(simulation.handle) end

return outcome
