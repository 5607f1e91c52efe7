--- given_body.lua: the encoding of `genome = { body = FILE }`: every robot has the body of a robot
--- file, and only its genes of control vary.

local engine = require "limax.engine"
local robot_file = require "limax.robot.robot_file"

local given_body = {}

--- The encoding for a body in the materials of an experiment. Raises if they do not fit.
---@param description limax.robot.description
---@param materials limax.materials of the experiment
---@return limax.encoding.definition
function given_body.encoding(description, materials)
  local population = robot_file.build(description, materials)
  local count = population:body(1).voxels
  local voxels = population:voxels_view(1):copy()
  local weights = population:weights_view(1):copy()
  population:check(materials, { largest_part = true })
  if count == 0 or population:body(1).voxels < count then
    engine.fail(("expected a body of one connected part, got %d voxels of which %d are connected")
      :format(count, population:body(1).voxels))
  end
  population:free()
  return { name = "body", genes = 0, express = function(robots)
    for _, i in ipairs(robots) do
      local own_voxels, own_weights = robots:voxels(i), robots:weights(i)
      for v = 1, #voxels do
        own_voxels[v] = voxels[v]
        for kind = 1, 3 do own_weights[kind][v] = weights[kind][v] end
      end
    end
  end }
end

return given_body
