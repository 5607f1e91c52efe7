--- own_forces.lua: two effects of a script's own, each a few lines of text in its scene: a magnet
--- that pulls a robot through the air, and a treadmill that carries it back while it walks. The
--- engine compiles the text; engine/README.md has its language. A second or two.
--- Run it with: limax scripts/experiments/own_forces.lua

local limax = require "limax"

local robot = limax.robot { voxels = "e.c\ne.c\n\nsss\nsss" }
local function shown(place) return ("%.3f, %.3f, %.3f m"):format(place[1], place[2], place[3]) end

-- A force towards `centre` that weakens with the distance r as r / (r^2 + reach^2). Its gradient is
-- largest at the centre, strength / reach^2: that is its bound for the automatic step. The air
-- slows the body, so that it comes to rest there.
local strength, reach = 0.5, 0.2 -- N m, m
local centre = { 1, 0, 0.5 } -- m, in the world
local pulled = robot:simulate {
  duration = 10, -- s
  scene = {
    damping = true,
    wind = { velocity = { 0, 0, 0 }, drag = 0.1 }, -- N s/m
    magnet = {
      force = [[
        vec way = centre - x;
        f = strength * way / (dot(way, way) + reach * reach);
      ]],
      centre = centre, strength = strength, reach = reach,
      bound = { stiffness = strength / reach ^ 2 }, -- N/m
    },
  },
  record = { center_of_mass = 20 }, -- Hz
}
local path = pulled:trace "center_of_mass"
print(("magnet: at %s; from %s the centre of mass comes to %s"):format(shown(centre),
  shown(path[1]), shown(path[path:size()])))

-- A belt that drags along whatever is within `height` of the ground.
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
