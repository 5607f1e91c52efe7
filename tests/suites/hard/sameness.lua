--- sameness.lua: hard cases where two runs must agree: mirrored, beside others, with an effect that
--- never acts, and evolved against a short step. SI units.

local bodies = require "limax.tools.bench.bodies"
local case = require("limax.tools.bench.hard_cases").suite "sameness"
local limax = require "limax"

local LAND = bodies.ALL

local function letter(k) return ("ecsb"):sub(k % 4 + 1, k % 4 + 1) end

for _, ground in ipairs { false, true } do
  case { row = 49, name = "mirror symmetry " .. (ground and "on the ground" or "in the air"),
    smooth = not ground,
    run = function(c)
      -- materials and phases are their own mirror image at y = 0.2 m
      local positions = c:run({ lattice = { 4, 4, 2 }, duration = ground and 0.25 or 1,
        voxels = function(x, y, z) return letter(2 * x + 3 * math.min(y, 5 - y) + z) end,
        weights = { phase = function(x, y) return (3 * x + math.min(y, 5 - y)) % 7 / 7 end },
        energy = false, center_tolerance = 10, position = { 0, 0, ground and 0.01 or 0 },
        scene = { gravity = ground or { acceleration = { 0, 0, -0.5 } }, ground = ground,
          friction = ground, damping = true, actuation = true } }):state()
      local mirrored = {}
      for i = 1, #positions do
        local row = math.floor((i - 1) / 5) % 5
        local p = positions[i + (4 - 2 * row) * 5]
        mirrored[i] = { p[1], 0.4 - p[2], p[3] }
      end
      -- sums in another order differ by their last bits, which contact amplifies
      c:near_rows("mirror image", positions, mirrored, ground and { double = 1e-6, fp32 = 1e-3 }
        or { double = 1e-9, fp32 = 1e-5, single = 1e-4 })
    end }
end

case { row = 49, name = "the same body in a larger lattice", run = function(c)
  -- an edge of 1/8 m keeps every position exact
  local function ends(margin)
    local function inside(x, y, z)
      return x >= 1 and x <= 3 and y >= 1 and y <= 2 and z <= 2
    end
    return (c:run({ lattice = { 3 + 2 * margin, 2 + margin, 2 + margin }, edge = 0.125,
      duration = 0.5, scene = LAND, energy = false, time_step = 2e-4, position = { 0, 0, 0.25 },
      voxels = function(x, y, z)
        x, y = x - margin, y - margin
        return inside(x, y, z) and letter(2 * x + 3 * y + z) or "."
      end, weights = { phase = function(x, y) return (3 * (x - margin) + y - margin + 9) % 7 / 7
      end } }):state())
  end
  local small, large = ends(0), ends(2)
  if c.device.kind == "cpu" then c:same_bits("positions", large, small) end
  -- a GPU shares the springs of a mass among threads by the number of sites
  c:near_rows("positions", large, small, { double = 1e-9, fp32 = 1e-3 })
end }

case { row = 52, name = "by itself and among thousands, some of which diverge", brief = true,
  run = function(c)
    local count = c.full and 4096 or 512
    local slots = { 1, 18, count }
    -- the same robot in these slots, a bursting one after each
    local function crowd(size, same, thrown)
      return c:run { lattice = { 2, 1, 1 }, count = size, duration = 0.2, scene = LAND,
        energy = false, center = false, may_diverge = { "speed", "nonfinite", "stretch" },
        voxels = function(x, _, _, robot) return letter(x + (same[robot] and 2 or robot)) end,
        place = function(_, velocities, robot)
          if not thrown[robot] then return false end
          for i = 1, #velocities do velocities[i] = { 1e30 * (-1) ^ i, 0, 1e30 } end
        end }
    end
    local expected, speeds = crowd(1, { true }, {}):state()
    local among = crowd(count, { true, [18] = true, [count] = true }, { [2] = true, [19] = true })
    for _, slot in ipairs(slots) do
      local positions, velocities = among:state(slot)
      c:same_bits(("positions in slot %d"):format(slot), positions, expected)
      c:same_bits(("velocities in slot %d"):format(slot), velocities, speeds)
    end
    for _, slot in ipairs { 2, 19 } do
      c:same_bits("a thrown robot", among:outcome(slot).status, "diverged")
      c:at_most("step of the report", among:outcome(slot).step, 64)
    end
    c.reported = nil -- the verdict is not about these
  end }

case { row = 53, name = "an effect that never acts", run = function(c)
  local function ends(scene)
    scene.gravity, scene.damping = true, true
    return (c:run({ lattice = { 3, 2, 2 }, voxels = "s", position = { 0, 0, 100 }, duration = 0.5,
      time_step = 2e-4, scene = scene, center_tolerance = 10 }):state())
  end
  -- the fall ends high above the ground
  c:same_bits("positions", ends { ground = true, friction = true }, ends {})
end }

case { row = 57, name = "a walk on ice does not exploit the time step", brief = true,
  run = function(c)
    local experiment = limax.experiment { lattice = { 3, 3, 3 }, fitness = "walk", seed = 57,
      genome = { sigma = 1 },
      population = c.full and 32 or 12, generations = c.full and 50 or 4, repetitions = 1,
      supervisor = "fixed", record = { energy = 200 },
      simulation = { duration = 2, settle = 0.5, time_step = "auto", bound_fraction = 0.9,
        time_step_most = 0, integrator = c.integrator, precision = c.precision },
      scene = { gravity = true, ground = true, damping = true, actuation = true,
        friction = { static = 1e-3, kinetic = 1e-3 } } }
    local best
    for robots in limax.start(experiment, { device = c.device, say = function() end })
      :generations() do
      robots:score()
      for i, robot in ipairs(robots) do
        local outcome = robot.record.outcome
        local name = ("generation %d, robot %d"):format(robots.generation, i)
        if outcome.status == "diverged" then
          error(("%s diverged: %s"):format(name, outcome.reason), 0)
        elseif outcome.status == "done" then
          -- muscles pay for motion; their sampled work is known to a few per cent
          c:at_most(name .. ": kinetic energy", outcome.kinetic, 1.1 * outcome.muscle_work + 0.5)
        end
      end
      best = robots[robots.ranked[1]]
    end
    -- the ledger is recorded only on the CPU
    local cpu = c.device.kind == "cpu"
    local again = best:simulate { bound_fraction = 0.09, device = c.device,
      record = { [cpu and "ledger" or "energy"] = 200 } }
    c:note("distance %.4g m, at a tenth of the step %.4g m", best:distance(), again:distance())
    c:at_least("distance at a tenth of the step", again:distance(), 0.8 * best:distance())
    if cpu then
      -- leapfrog: twice what EXTENDING.md states for an eighth of the automatic step
      c:at_most("balance error of the ledger", again:ledger().closure,
        c.integrator == "leapfrog" and 2e-5 or 2e-3)
    end
  end }
