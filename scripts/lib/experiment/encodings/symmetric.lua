--- symmetric.lua: wraps another encoding and mirrors its bodies: the half with the lower
--- coordinates along an axis is copied to the other: { "symmetric", of = "cppn", axis = "x" }.

local schema = require "limax.engine.schema"

local AXES = { x = 1, y = 2, z = 3 }

-- The voxel that each voxel takes its material and weights from.
local function sources(lattice, axis)
  local list, n = {}, lattice
  for z = 0, n[3] - 1 do
    for y = 0, n[2] - 1 do
      for x = 0, n[1] - 1 do
        local at = { x, y, z }
        at[axis] = math.min(at[axis], n[axis] - 1 - at[axis])
        list[#list + 1] = 1 + at[1] + n[1] * (at[2] + n[2] * at[3])
      end
    end
  end
  return list
end

return {
  options = { of = schema.any, axis = schema.choice { "x", "y", "z" } },
  make = function(options, context)
    local inner = context.get(options.of or "fourier")
    local from = sources(context.lattice, AXES[options.axis or "y"])
    local encoding = {}
    for key, value in pairs(inner) do encoding[key] = value end
    function encoding.express(robots)
      inner.express(robots)
      for _, i in ipairs(robots) do
        local voxels, weights = robots:voxels(i), robots:weights(i)
        for v = 1, #from do
          local source = from[v]
          if source ~= v then
            voxels[v] = voxels[source]
            for kind = 1, 3 do weights[kind][v] = weights[kind][source] end
          end
        end
      end
    end
    return encoding
  end,
}
