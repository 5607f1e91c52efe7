--- bodies.lua: bodies of benches and device suites, made by formulas instead of genomes.

local engine = require "limax.engine"

local bodies = {}

--- The effects of a robot that walks on flat ground, each with its defaults.
bodies.ALL = {
  gravity = true, ground = true, friction = true, damping = true, actuation = true,
}

--- A population of bodies with all four materials and different weights. A robot's body depends
--- only on its number. `hollow`: every second body has empty voxels too, and may be in several
--- pieces.
---@param options { first: integer|nil, hollow: boolean|nil }|nil `first`: number of the first robot
function bodies.population(materials, lattice, count, options)
  local first = options and options.first or 1
  local population = engine.population { lattice = lattice, count = count }
  local all = lattice[1] * lattice[2] * lattice[3]
  local voxels, stiffness, amplitude, phase = {}, {}, {}, {}
  for robot = 1, count do
    local n = first + robot - 2
    local full = not (options and options.hollow) or n % 2 == 0
    for voxel = 1, all do
      voxels[voxel] = full and 1 + (voxel * 7 + n) % 4 or (voxel * 7 + n) % 5
      stiffness[voxel] = 0.3 + 0.7 * ((voxel * 37 + n) % 101) / 100
      amplitude[voxel] = 0.2 + 0.6 * ((voxel * 53 + n) % 101) / 100
      phase[voxel] = ((voxel * 71 + n) % 101) / 100
    end
    population:set_body(robot, voxels,
      { stiffness = stiffness, amplitude = amplitude, phase = phase })
  end
  population:check(materials, { require_muscle = false })
  return population
end

return bodies
