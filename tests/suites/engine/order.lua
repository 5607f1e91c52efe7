--- order.lua: how the error in `double` falls as the step is halved, for each integrator with each
--- effect, in motions in which no contact begins or ends and no slip stops. SI units.

local limax = require "limax"
local engine = require "limax.engine"

local suite = require("limax.test").suite "order of the integrators"

local WEIGHTS = { phase = 0.3 }
local CUBE = { voxels = "es\nbc\n\nse\ncs", weights = WEIGHTS }
local HAIRPIN = { voxels = "eee\n\nb.b\n\ns.s", weights = WEIGHTS }
local ORDERS = { symplectic_euler = 1, leapfrog = 2, rk4 = 4 }

-- Springs, dashpots and muscles move every body; `scene` is added. Contacts are soft and the whole
-- body is deep in them, so that what touches goes on touching. RK4 refuses some effects.
local SOFT = { stiffness = 200, offset = 0.4, normal = { 0.1, 0.2, 1 } }
local NOT_SMOOTH = { rk4 = "integrates smooth scenes only" }
local CASES = {
  springs = { scene = { damping = false, actuation = { frequency = 12, ramp = 0 } } },
  damping = {}, actuation = { scene = { actuation = { frequency = 20, ramp = 1 } } },
  -- without sensors, so that the rounding of rest lengths is the same with every step
  control = { scene = { actuation = false,
    control = { rate = 200, signal = "a = sin(300 * t + phase);" } } },
  target = { scene = { target = true } },
  gravity = { scene = { gravity = { acceleration = { 1, 2, -30 } } } },
  wind = { scene = { wind = { velocity = { 5, -3, 2 }, drag = 1 } } },
  drag = { scene = { drag = { density = 100 } }, velocity = { 2, 1, 1 }, refused = NOT_SMOOTH },
  self_collision = { robot = HAIRPIN, refused = NOT_SMOOTH,
    scene = { self_collision = { reach = 1.25, stiffness = 500 } } },
  anchors = { scene = { anchors = { to = { 1, 1, 0.01 } } } },
  -- touched by the lowest masses from t = 0
  ground = { scene = { ground = { stiffness = 300, damping_ratio = 0 } },
    velocity = { 0.5, 0.3, -3 }, refused = NOT_SMOOTH },
  planes = { scene = { planes = SOFT }, refused = NOT_SMOOTH },
  spheres = { refused = NOT_SMOOTH,
    scene = { spheres = { center = { 0.1, 0.1, -1 }, radius = 1.4, stiffness = 200 } } },
  boxes = { refused = NOT_SMOOTH,
    scene = { boxes = { from = { -1, -1, -1 }, to = { 1.2, 1.2, 0.4 }, stiffness = 200 } } },
  terrain = { refused = NOT_SMOOTH, scene = { terrain = { spacing = 2, origin = { -1, -1, 0.4 },
    heights = { { 0.1, 0 }, { 0, -0.1 } }, stiffness = 200 } } },
  -- second order along a straight line; its direction is that of the slip half a step later
  friction = { velocity = { 3, 2, 0 }, refused = NOT_SMOOTH, orders = { leapfrog = 1 },
    scene = { planes = SOFT, friction = { kinetic = 0.3, static = 0.3 } } },
  block = { refused = NOT_SMOOTH, scene = { block = { position = { -0.6, -1.4, -1.4 },
    size = { 1, 3, 3 }, mass = 50, stiffness = 200, spin = { 1, 2, 3 } } } },
  patches = { velocity = { 3, 2, 0 }, refused = NOT_SMOOTH, orders = { leapfrog = 1 },
    scene = { planes = SOFT, friction = { kinetic = 0.3, static = 0.3 },
      patches = { from = { -9, -9, -9 }, factor = 0.5 } } },
  moving_boxes = { refused = NOT_SMOOTH, scene = { moving_boxes = { from = { -1, -1, -1 },
    to = { 1.2, 1.2, 0.4 }, stiffness = 200, velocity = { 0.5, -0.3, 2 } } } },
  moving_spheres = { refused = NOT_SMOOTH, scene = { moving_spheres = { center = { 0.1, 0.1, -1 },
    radius = 1.4, stiffness = 200, velocity = { 0.5, -0.3, 2 } } } },
  damage = { scene = { actuation = false, damage = { time = 0.01, from = { -1, -1, -1 } },
    control = { rate = 200, signal = "a = sin(300 * t + phase);" } } },
  growth = { scene = { actuation = false, growth = { strain = 0.3, duration = 0.1 },
    control = { rate = 200, signal = "a = sin(300 * t + phase);" } } },
  -- the second touches only the first
  ["two blocks"] = { refused = NOT_SMOOTH, scene = { block = { { position = { -0.6, -1.4, -1.4 },
    size = { 1, 3, 3 }, mass = 50, stiffness = 200, spin = { 1, 2, 3 } },
    { position = { -1.4, -0.9, -0.8 }, size = { 1, 2, 1.8 }, mass = 5, stiffness = 300,
      spin = { 2, -1, 1 } } } } },
  -- the ball touches a face of the block, and not the body
  edges = { refused = NOT_SMOOTH, scene = { edges = true, block = { position = { -0.6, -1.4, -1.4 },
    size = { 1, 3, 3 }, mass = 50, stiffness = 200, spin = { 1, 2, 3 } },
    spheres = { center = { -0.9, 0.1, 0.1 }, radius = 0.5, stiffness = 200 } } },
  ["a scripted force"] = { scene = { own = { k = 20, turn = 2, push = 3,
    force = "f = cross(vec(0, 0, turn), v) - k * x + vec(0, push * sin(40 * t), 0);" } } },
}

local function distance(a, b)
  local sum = 0
  for i = 1, #a do for axis = 1, 3 do sum = sum + (a[i][axis] - b[i][axis]) ^ 2 end end
  return math.sqrt(sum / (3 * #a))
end

-- Positions and velocities at the end, and places of several blocks.
local function ends(case, integrator, time_step)
  local scene = { damping = true, actuation = { frequency = 5, ramp = 0 } }
  for name, value in pairs(case.scene or {}) do scene[name] = value or nil end
  local done = limax.robot(case.robot or CUBE):simulate { device = "cpu", precision = "double",
    integrator = integrator, time_step = time_step, scene = scene, settle = 0, duration = 0.02,
    velocity = case.velocity or { 0.5, 0.3, -0.2 }, record = { position = 100, velocity = 100,
      block = scene.block and 100 } }
  if done.status ~= "done" then error(done.status) end
  local state = {}
  for _, name in ipairs { "position", "velocity" } do
    local samples = done:trace(name):table()
    state[name] = samples[#samples]
  end
  if scene.block and scene.block[1] then state.block = done:trace("block")[3]:table() end
  return state
end

local function check(t, name, case, integrator, expected)
  local states = {}
  for halving = 0, 2 do
    local time_step = (integrator == "rk4" and 2.5e-4 or 2e-5) / 2 ^ halving
    states[halving] = ends(case, integrator, time_step)
  end
  for what, first in pairs(states[0]) do
    local error, next_error = distance(first, states[1][what]),
      distance(states[1][what], states[2][what])
    local order = math.log(error / next_error) / math.log(2)
    t:ok(math.abs(order - expected) < 0.1, ("%s with %s: %s of order %.3f, not %d"):format(name,
      integrator, what, order, expected))
  end
end

local names = { "a scripted force", "two blocks" }
for _, effect in ipairs(engine.effects()) do names[#names + 1] = effect.name end

for _, name in ipairs(names) do
  suite:test(name, function(t)
    local case = CASES[name]
    for integrator, order in pairs(ORDERS) do
      local refused = case.refused and case.refused[integrator]
      if refused then
        t:raises(refused, function() ends(case, integrator, 1e-4) end)
      else
        check(t, name, case, integrator, case.orders and case.orders[integrator] or order)
      end
    end
  end)
end
