--- own_forces.lua: two effects written as text in a scene: a magnet that pulls a robot through the
--- air, and a treadmill that carries it back while it walks. The engine compiles the text;
--- engine/README.md describes the language. One or two seconds.
--- Run it with: limax scripts/experiments/own_forces.lua

local limax = require "limax"

local robot = limax.robot { voxels = "e.c\ne.c\n\nsss\nsss" }
local function shown(point) return ("%.3f, %.3f, %.3f m"):format(point[1], point[2], point[3]) end

-- A force towards `centre` that depends on the distance r as r / (r^2 + reach^2). Its gradient is
-- largest at the centre, strength / reach^2: the bound for the automatic time step. Drag lets the
-- body come to rest there.
local strength, reach = 0.5, 0.2 -- N m, m
local centre = { 1, 0, 0.5 } -- m, in the world
local pulled = robot:simulate {
  duration = 10, -- s
  scene = {
    damping = true,
    wind = { velocity = { 0, 0, 0 }, drag = 0.1 }, -- N s/m
    magnet = {
      force = [[
        vec offset = centre - x;
        f = strength * offset / (dot(offset, offset) + reach * reach);
      ]],
      centre = centre, strength = strength, reach = reach,
      bound = { stiffness = strength / reach ^ 2 }, -- N/m
    },
  },
  record = { center_of_mass = 20 }, -- Hz
}
local path = pulled:trace "center_of_mass"
print(("magnet: at %s; the centre of mass moves from %s to %s"):format(shown(centre),
  shown(path[1]), shown(path[path:size()])))

-- A belt that drags everything within `height` of the ground.
local speed = -0.2 -- m/s
local function walk_on(belt_speed)
  return robot:simulate {
    duration = 5, -- s
    scene = limax.scenes.land {
      friction = false,
      treadmill = {
        force = [[
          vec slip = vec(speed, 0, 0) - v;
          f = x.z < height ? grip * vec(slip.x, slip.y, 0) : vec(0, 0, 0);
        ]],
        speed = belt_speed, height = 0.01, grip = 5, -- m/s, m, N s/m
        bound = { damping = 5 }, -- N s/m
      },
    },
  }
end
local still, moving = walk_on(0):displacement(), walk_on(speed):displacement()
print(("treadmill: along x %.3f m in 5 s on a belt at rest, %.3f m on one at %.1f m/s"):format(
  still[1], moving[1], speed))
