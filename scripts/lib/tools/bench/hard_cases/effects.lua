--- effects.lua: hard cases of planes, obstacles, terrain, anchors, wind, drag and self-collision.
--- Where an engine lists no such effect a case is skipped, with the reason. SI units.

local cases = {}

local function case(fields) cases[#cases + 1] = fields end

case { name = "a tilted plane holds half a degree below the angle of friction", brief = true,
  needs = { "planes" }, run = function(c)
    local mu = 0.5
    local angle = math.atan(mu) - math.rad(0.5)
    local normal = { math.sin(angle), 0, math.cos(angle) }
    local function turned(p)
      return { math.cos(angle) * p[1] + math.sin(angle) * p[3], p[2],
        -math.sin(angle) * p[1] + math.cos(angle) * p[3] }
    end
    local run = c:run { lattice = { 4, 4, 1 }, settle = 2, duration = c.full and 60 or 4,
      materials = { b = { damping_ratio = 1 } },
      scene = { gravity = true, planes = { normal = normal, offset = 0 }, damping = true,
        friction = { static = mu, kinetic = mu } },
      place = function(positions)
        for i, p in ipairs(positions) do positions[i] = turned(p) end
      end }
    local outcome = run:outcome()
    for axis = 1, 3 do
      c:at_most("creep (m/s)",
        math.abs(outcome.center_end[axis] - outcome.center_start[axis]) / outcome.time, 1e-5)
    end
  end }

case { name = "in the corner of two planes", needs = { "planes" }, run = function(c)
  local run = c:run { lattice = { 2, 2, 2 }, duration = 4,
    materials = { b = { damping_ratio = 1 } },
    scene = { gravity = true, damping = true, friction = true,
      planes = { { normal = { 1, 0, 1 }, offset = 0 }, { normal = { -1, 0, 1 }, offset = 0 } } },
    place = function(positions)
      -- turned by 45 degrees, so that it fits, and a little above
      local s = math.sqrt(0.5)
      for i, p in ipairs(positions) do
        positions[i] = { s * (p[1] - p[3]), p[2], s * (p[1] + p[3]) + 0.05 }
      end
    end }
  local positions = run:state()
  c:at_most("speed", run:fastest(), 0.05)
  for _, p in ipairs(positions) do c:at_least("height over the planes", p[3] - math.abs(p[1]),
    -0.01) end
end }

case { name = "on a step of a height field", needs = { "terrain" }, brief = true, run = function(c)
  local heights = {}
  for x = 1, 12 do
    heights[x] = {}
    for y = 1, 12 do heights[x][y] = x > 6 and 0.15 or 0 end
  end
  local run = c:run { lattice = { 4, 3, 2 }, duration = 3, position = { 0.35, 0.3, 0.2 },
    materials = { b = { damping_ratio = 1 } },
    scene = { gravity = true, damping = true, friction = true,
      terrain = { heights = heights, spacing = 0.1 } } }
  local low = math.huge
  for _, p in ipairs((run:state())) do low = math.min(low, p[3]) end
  c:at_least("lowest mass", low, -0.02)
end }

case { name = "a mass at the centre of a sphere, a body inside a box",
  needs = { "spheres", "boxes" }, run = function(c)
    for _, obstacle in ipairs {
      { spheres = { center = { 0.1, 0.1, 0.1 }, radius = 0.3 } },
      { boxes = { from = { -1, -1, -1 }, to = { 1, 1, 1 } } },
    } do
      obstacle.damping = true
      local run = c:run { lattice = { 2, 2, 2 }, scene = obstacle, duration = 0.5,
        may_diverge = { "stretch", "speed" } }
      if run.verdict == "holds" then
        local center = run:outcome().center_end
        c:at_least("way out", math.abs(center[1] - 0.1) + math.abs(center[2] - 0.1)
          + math.abs(center[3] - 0.1), 1e-3)
      end
    end
    c.reported = nil
  end }

case { name = "hung up by its upper face", needs = { "anchors" }, run = function(c)
  local run = c:run { lattice = { 2, 2, 4 }, voxels = "s", duration = 5, center = false,
    materials = { s = { damping_ratio = 1 } },
    scene = { gravity = true, damping = true,
      anchors = { from = { -0.01, -0.01, 0.39 }, to = { 0.21, 0.21, 0.41 } } } }
  local positions, velocities = run:state()
  for i = #positions - 8, #positions do
    c:same_bits("velocity of what is held", velocities[i], { 0, 0, 0 })
    c:near("height of what is held", positions[i][3], 0.4, { atol = 1e-7 })
  end
  c:at_most("speed", run:fastest(), 0.01)
  c:at_most("lowest mass", positions[1][3], 0)
end }

case { name = "wind of 1000 m/s", needs = { "wind" }, run = function(c)
  -- an impossible storm takes masses along at its own speed, and never faster
  local run = c:run { lattice = { 2, 2, 2 }, duration = 0.5, energy = false, max_speed = 1e4,
    scene = { damping = true, wind = { velocity = { 1000, 0, 0 }, drag = 1000 } } }
  c:at_most("speed", run:fastest(), 1010)
end }

case { name = "drag at absurd speed", needs = { "drag" }, run = function(c)
  -- an impulse that opposes a motion never reverses it: speed alone goes down
  for _, speed in ipairs { 100, 900 } do
    local run = c:run { lattice = { 2, 2, 2 }, duration = 0.5, energy = false,
      velocity = { speed, 0, 0 }, scene = { damping = true, drag = true },
      record = { energy = 100 } }
    local rows = run:trace "energy"
    c:at_most("energy at the end", rows[#rows][1] + rows[#rows][2], rows[1][1] * (1 + 1e-6))
    local first, last = run:outcome().center_start, run:outcome().center_end
    c:at_least("way", last[1] - first[1], 0)
  end
end }

case { name = "a body that folds onto itself", needs = { "self_collision" }, run = function(c)
  local run = c:run { lattice = { 8, 1, 1 }, voxels = "s", duration = 1, energy = false,
    scene = { damping = true, self_collision = true }, may_diverge = { "stretch" },
    place = function(_, velocities)
      for i = 1, #velocities do
        local arm = ((i - 1) % 9 - 4) / 4
        velocities[i] = { -5 * arm, 0, 3 * arm * arm }
      end
    end, record = { energy = 100 } }
  local rows = run:trace "energy"
  if run.verdict == "holds" then
    c:at_most("energy at the end", rows[#rows][1], rows[1][1])
  end
end }

return cases
