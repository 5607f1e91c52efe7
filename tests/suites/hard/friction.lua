--- friction.lua: hard cases of Coulomb friction. A slope is flat ground under tilted gravity.
--- SI units.

local context = require "limax.tools.bench.hard_cases.context"
local invariants = require "limax.tools.bench.hard_cases.invariants"
local case = require("limax.tools.bench.hard_cases").suite "friction"

local GRAVITY = context.GRAVITY
local MU = 0.5

-- A flat, well damped sheet, which does not topple and loads the ground evenly, under gravity with
-- these components along x and down.
local function sheet(along, friction, fields)
  local spec = { lattice = { 4, 4, 1 }, materials = { b = { damping_ratio = 1 } },
    scene = { gravity = { acceleration = { along, 0, -GRAVITY } }, ground = true, damping = true,
      friction = friction } }
  for name, value in pairs(fields) do spec[name] = value end
  return spec
end

local function both(mu) return { static = mu, kinetic = mu } end

local function slope(angle, fields)
  local spec = sheet(0, both(MU), fields)
  spec.scene.gravity.acceleration =
    { GRAVITY * math.sin(angle), 0, -GRAVITY * math.cos(angle) }
  return spec
end

-- Starts the sheet at its penetration at rest, at `speed` along `heading`, rad.
local function resting(speed, heading)
  return function(positions, velocities)
    for i, p in ipairs(positions) do
      -- each of the 25 columns of two masses rests on its lower one
      p[3] = p[3] - 2 * 0.1 * GRAVITY / context.GROUND
      velocities[i] = { speed * math.cos(heading or 0), speed * math.sin(heading or 0), 0 }
    end
  end
end

for _, fraction in ipairs { 0.9, 0.225 } do
  case { row = 24, brief = true,
    name = ("holds half a degree below the angle of friction, %g of the bound"):format(fraction),
    run = function(c)
      local run = c:run(slope(math.atan(MU) - math.rad(0.5), { settle = 2,
        duration = c.full and 60 or 3, bound_fraction = fraction }))
      for axis = 1, 2 do
        c:at_most("creep (m/s)", math.abs(run:moved(axis)) / run:outcome().time, 1e-5)
      end
    end }
end

case { row = 25, name = "slides half a degree above the angle of friction", run = function(c)
  local angle = math.atan(MU) + math.rad(0.5)
  local path = c:run(slope(angle, { settle = 1, duration = 2, record = { center_of_mass = 20 } }))
    :trace "center_of_mass"
  -- second difference over the last second: the first is its start
  local last = #path
  c:near("acceleration",
    (path[last][1] - 2 * path[last - 10][1] + path[last - 20][1]) / 0.5 ^ 2,
    GRAVITY * (math.sin(angle) - MU * math.cos(angle)), { rtol = 0.02 })
end }

case { row = 26, name = "stopping distance at mu = 0.2, 0.4 and 0.7", run = function(c)
  for _, mu in ipairs { 0.2, 0.4, 0.7 } do
    local speed = 2
    local run = c:run(sheet(0, both(mu), { duration = 0.3 + speed / (mu * GRAVITY),
      place = resting(speed), energy = false }))
    c:near("distance", run:moved(1), speed ^ 2 / (2 * mu * GRAVITY), { rtol = 0.01 })
  end
end }

case { row = 27, name = "the same distance in every direction", run = function(c)
  local first
  for _, degrees in ipairs { 0, 30, 45, 90, 150, 210, 300 } do
    local heading = math.rad(degrees)
    local run = c:run(sheet(0, both(0.4), { duration = 0.4, place = resting(1, heading),
      energy = false }))
    local x, y = run:moved(1), run:moved(2)
    local along = x * math.cos(heading) + y * math.sin(heading)
    first = first or along
    c:near(("distance at %d degrees"):format(degrees), along, first, { rtol = 0.005 })
    c:near("path to the side", y * math.cos(heading) - x * math.sin(heading), 0,
      { atol = 0.005 * first })
  end
end }

for _, share in ipairs { 0.9, 1.1 } do
  case { row = 28, name = ("a push of %g static mu N on a sheet at rest"):format(share),
    run = function(c)
      -- brought to rest by friction of 1.05 times the push, so that no foot slips at the start
      local push = 0.5 -- of the weight
      local rest = c:run(sheet(push * GRAVITY, both(1.05 * push), { duration = 3 })):state()
      local gone = c:run(sheet(push * GRAVITY, { static = push / share, kinetic = 0.1 }, {
        duration = 1, energy = false, place = function(positions, velocities)
          for i, p in ipairs(rest) do positions[i], velocities[i] = p, { 0, 0, 0 } end
        end })):moved(1)
      if share < 1 then
        c:near("motion", gone, 0, { atol = { double = 1e-9, fp32 = 1e-6 } })
      else
        c:near("motion", gone, 0.5 * (push - 0.1) * GRAVITY, { rtol = 0.05 })
      end
    end }
end

case { row = 29, name = "mu = 0 and mu = 1000", run = function(c)
  local function slide(mu)
    return c:run(sheet(0, both(mu), { duration = 0.5, place = resting(1), energy = false }))
  end
  c:near("speed without friction", invariants.motion(slide(0):state()).velocity[1], 1,
    { rtol = { double = 1e-12, fp32 = 1e-5, single = 1e-4 } })
  -- the feet stop at once and the upper half leans over them
  c:at_most("distance where nothing slips", math.abs(slide(1000):moved(1)), 0.1)
  -- the first step stops every foot: mu N h / m is 2 m/s, half of that in leapfrog's first step
  local run = c:prepare(sheet(0, both(1000), { place = resting(0.5), time_step = 1e-4,
    energy = false }))
  local before = run:state()
  run:advance(1)
  for i, p in ipairs((run:state())) do
    if before[i][3] < 0 then
      c:same_bits("position of a foot", { p[1], p[2] }, { before[i][1], before[i][2] })
    else
      c:at_least("motion of an upper mass", p[1] - before[i][1], 4e-5)
    end
  end
end }

case { row = 30, name = "static below kinetic friction is kinetic friction", run = function(c)
  local function ends(static, kinetic)
    return (c:run(sheet(0, { static = static, kinetic = kinetic }, { duration = 1, energy = false,
      place = resting(1) })):state())
  end
  c:same_bits("positions", ends(0.6, 1), ends(1, 1))
  -- a slow push between both coefficients is held, one above both slides against the kinetic one
  for _, share in ipairs { 0.8, 1.1 } do
    local run = c:run(sheet(share * GRAVITY, { static = 0.6, kinetic = 1 }, { settle = 3,
      duration = 1, record = { energy = 20 } }))
    local gone, rows = run:moved(1), run:trace "energy"
    if share < 1 then
      c:near("motion", gone, 0, { atol = { double = 1e-9, fp32 = 1e-6 } })
    else
      c:at_least("motion", gone, 0.4)
      c:near("work of gravity less friction's", rows[#rows][1] - rows[1][1],
        (share - 1) * run:weight() * gone, { rtol = 0.01 })
    end
  end
end }
