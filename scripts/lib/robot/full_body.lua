--- full_body.lua: bodies with the same material in every voxel. Their closed-form bound on the time
--- step measures the cost of a set of materials, and is the limit of a fixed step.

local engine = require "limax.engine"
local robot_file = require "limax.robot.robot_file"

local full_body = {}

--- The least bound on the time step over the full bodies of all materials, s, and the material that
--- sets it.
---@param materials table engine materials
---@param scene table engine scene
---@param options table for engine.simulation
---@return number bound s
---@return string material
function full_body.bound(lattice, materials, scene, options, device)
  local voxels, genes = {}, {}
  local least, name = math.huge, ""
  for k = 1, scene:control_genes() do genes[k] = 0 end
  local body = robot_file.population({ { control = genes } }, lattice)
  for material = 1, materials.count do
    if materials:get(material).kind ~= "empty" then
      -- a population keeps material indices from 0
      for i = 1, lattice[1] * lattice[2] * lattice[3] do voxels[i] = material - 1 end
      body:set_body(1, voxels)
      body:check(materials, { require_muscle = false })
      local simulation = engine.simulation(body, materials, scene, options, device)
      -- prepares the robot and computes its bound
      simulation:state(1)
      local bound = simulation:outcome(1).time_step_bound or math.huge
      simulation:free()
      if bound < least then least, name = bound, materials:get(material).name end
    end
  end
  body:free()
  return least, name
end

return full_body
