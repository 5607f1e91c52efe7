--- invariants.lua: the checks of every hard case: numbers are finite, robots end as the case
--- expects, the energy of a passive scene never rises, and without external forces the centre of
--- mass moves by Newton's laws and angular momentum is kept. SI units.

local choice = require "limax.base.choice"

local invariants = {}

local function fail(pattern, ...) error(pattern:format(...), 0) end

local function finite(value) return math.abs(value) < math.huge end

-- Effects that dissipate or store energy and never add any.
local PASSIVE = { gravity = true, ground = true, friction = true, damping = true, planes = true,
  terrain = true, spheres = true, boxes = true, anchors = true, target = true, patches = true }
-- Effects after which only gravity moves the centre of mass.
local INTERNAL = { gravity = true, damping = true, actuation = true, self_collision = true,
  control = true, target = true, damage = true, growth = true }

local function all_in(scene, effects)
  for name, value in pairs(scene or {}) do
    if value and not effects[name] then return false end
  end
  return true
end

--- Whether the energy of a spec's runs must not rise.
function invariants.passive(spec)
  return spec.energy ~= false and all_in(spec.scene, PASSIVE) and not spec.diverges
end

local function mean(rows)
  local sum = { 0, 0, 0 }
  for _, row in ipairs(rows) do
    for axis = 1, 3 do sum[axis] = sum[axis] + row[axis] / #rows end
  end
  return sum
end

--- Motion of equal masses of 1 kg.
---@return { center: number[], velocity: number[], spin: number[], size: number } centre, mean
--- velocity, angular momentum about the centre, and the sum of the lengths of lever times momentum
function invariants.motion(positions, velocities)
  local center, drift = mean(positions), mean(velocities)
  local spin, size = { 0, 0, 0 }, 0
  for i, p in ipairs(positions) do
    local x, y, z = p[1] - center[1], p[2] - center[2], p[3] - center[3]
    local u, v, w = velocities[i][1] - drift[1], velocities[i][2] - drift[2],
      velocities[i][3] - drift[3]
    spin[1] = spin[1] + y * w - z * v
    spin[2] = spin[2] + z * u - x * w
    spin[3] = spin[3] + x * v - y * u
    size = size + math.sqrt((x * x + y * y + z * z) * (u * u + v * v + w * w))
  end
  return { center = center, velocity = drift, spin = spin, size = size }
end

--- Motion at the start, where the centre of mass is predicted. Scripts do not see the masses, so
--- that needs equal ones.
function invariants.start(run)
  local spec, masses = run.spec, run.simulation.masses[1]
  if spec.center == false or not all_in(spec.scene, INTERNAL) or (spec.settle or 0) > 0
    or (spec.count or 1) > 1 or spec.materials or spec.diverges or masses > 2000 or masses == 0 then
    return nil
  end
  return invariants.motion(run:state())
end

-- The measured energy differs from the one that an integrator keeps, in a mode of frequency w:
-- symplectic Euler keeps v^2 + w^2 x^2 - h w^2 x v, leapfrog v^2 + w^2 x^2 (1 - (w h / 2)^2). With
-- s = w h / 2, at most the step over its bound, the ratio of two measured values is at most
-- (1 + s) / (1 - s) and 1 / (1 - s^2).
local function ratio_allowed(outcome, integrator)
  local s = math.min(outcome.time_step / outcome.time_step_bound, 0.95)
  if integrator == "symplectic_euler" then return (1 + s) / (1 - s) end
  return 1 / (1 - s * s)
end

-- Rounding as a share of the largest energy (MuJoCo uses the same), and of a spring of 1e4 N/m
-- whose ends are rounded at 1 m, J.
local ROUNDING = { double = 1e-9, fp32 = 1e-4 }
local SPRING_ROUNDING = { double = 1e-27, fp32 = 1e-10 }

local function check_energy(run, robot)
  local rows, outcome = run:trace("energy", robot), run:outcome(robot)
  if not rows[1] then return end
  local lowest = math.huge
  for _, row in ipairs(rows) do lowest = math.min(lowest, row[3]) end
  local kind = run.options.precision == "double" and "double" or "fp32"
  -- gravitational energies are zero at z = 0, so that their rounding grows with the height
  local first = rows[1][1] + rows[1][2] + rows[1][3] - lowest
  local rounding = ROUNDING[kind] * math.max(first, math.abs(rows[1][3]))
    + outcome.springs * SPRING_ROUNDING[kind]
  local ratio = ratio_allowed(outcome, run.options.integrator) * (1 + (run.spec.energy_rise or 0))
  local least = math.huge
  for sample, row in ipairs(rows) do
    local energy = row[1] + row[2] + row[3] - lowest
    if not finite(energy) then fail("energy at sample %d is %s", sample, tostring(energy)) end
    if energy > ratio * least + rounding then
      fail("energy of a passive scene rises from %.6g to %.6g J at sample %d; this step may show "
        .. "%.3g times", least, energy, sample, ratio)
    end
    least = math.min(least, energy)
  end
end

local AXES = { "x", "y", "z" }

local function check_center(c, run)
  local outcome, velocity = run:outcome(), run.start.velocity
  local scene_gravity, gravity = (run.spec.scene or {}).gravity, { 0, 0, 0 }
  if scene_gravity then
    gravity = type(scene_gravity) == "table" and scene_gravity.acceleration or { 0, 0, -9.81 }
  end
  local time = outcome.time
  -- the sum of n (n + 1) / 2 kicks if the first lasts a whole step
  local discrete = c.integrator == "symplectic_euler" and time + outcome.time_step or time
  -- a rounding per step of the distance, and in fp32 of forces that nearly cancel
  local reach = 0.1
  for axis = 1, 3 do
    reach = math.max(reach, math.abs(velocity[axis] * time),
      math.abs(0.5 * gravity[axis] * time * time))
  end
  local allowed = c:tolerance { double = 1e-11, fp32 = 5e-6, single = 2e-3 }
  for axis = 1, 3 do
    c:near("centre of mass " .. AXES[axis], outcome.center_end[axis], outcome.center_start[axis]
      + velocity[axis] * time + 0.5 * gravity[axis] * time * discrete,
      { atol = (run.spec.center_tolerance or 1) * allowed * reach })
  end
end

local function check_spin(c, run)
  if (run.spec.scene or {}).self_collision then return end
  local now, start = invariants.motion(run:state()), run.start
  local speed = 1 -- m/s, whose rounding is in every lever
  for _, v in ipairs(now.velocity) do speed = math.max(speed, math.abs(v)) end
  -- RK4 keeps it only to its order
  local share = c.integrator == "rk4" and 1e-3
    or c:tolerance { double = 1e-10, fp32 = 1e-4, single = 1e-2 }
  local allowed = (run.spec.center_tolerance or 1) * share
    * math.max(now.size, start.size, run:outcome().masses * 1e-3 * speed)
  for axis = 1, 3 do
    c:near("angular momentum about " .. AXES[axis], now.spin[axis], start.spin[axis],
      { atol = allowed })
  end
end

local function check_done(c, run, robot)
  for _, rows in ipairs { run:state(robot) } do
    for mass, row in ipairs(rows) do
      for axis = 1, 3 do
        if not finite(row[axis]) then
          fail("mass %d of robot %d is at %s", mass, robot, tostring(row[axis]))
        end
      end
    end
  end
  if run.simulation.record.energy and invariants.passive(run.spec) then check_energy(run, robot) end
  if robot == 1 and run.start then
    check_center(c, run)
    check_spin(c, run)
  end
end

--- Checks a run that has ended and sets `run.verdict`.
function invariants.check(c, run)
  local spec = run.spec
  run.verdict = "holds"
  for robot = 1, spec.count or 1 do
    local outcome = run:outcome(robot)
    local must = robot == 1 and spec.diverges
    if outcome.status == "diverged" then
      if not choice.contains(must or {}, outcome.reason)
        and not choice.contains(spec.may_diverge or {}, outcome.reason) then
        fail("robot %d diverged (%s) at step %d, %.4g s", robot, outcome.reason, outcome.step,
          outcome.time)
      end
      run.verdict, c.reported = "reported", outcome.reason
    elseif must then
      fail("robot %d ended well; it should have diverged", robot)
    elseif outcome.status == "done" then
      check_done(c, run, robot)
    elseif outcome.status ~= spec.status then
      fail("robot %d is %s%s", robot, outcome.status,
        outcome.reason and " (" .. outcome.reason .. ")" or "")
    end
  end
end

return invariants
