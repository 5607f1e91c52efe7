--- general.lua: the checks that every hard case is held to, whatever else it asks. SI units.

local general = {}

local function fail(pattern, ...) error(pattern:format(...), 0) end

local function finite(value) return value == value and math.abs(value) < math.huge end

-- Effects that take energy out or move it about, and never put any in.
local PASSIVE = {
  gravity = true, ground = true, friction = true, damping = true, planes = true, terrain = true,
  spheres = true, boxes = true, anchors = true,
}
-- Effects that leave the centre of mass to gravity alone.
local INTERNAL = { gravity = true, damping = true, actuation = true, self_collision = true }

--- Integrators in which a kick lasts a whole step and the move that follows sees all of it.
general.WHOLE_KICKS = { symplectic_euler = true, xpbd = true }

local function all_in(scene, known)
  for name, value in pairs(scene or {}) do
    if value and not known[name] then return false end
  end
  return true
end

--- Whether a run is to be watched for energy that comes from nowhere.
---@param spec table
---@return boolean
function general.wants_energy(spec)
  return spec.energy ~= false and all_in(spec.scene, PASSIVE) and not spec.diverges
end

-- Mass-weighted means need the masses, which scripts do not see: only a body whose masses are all
-- equal, or whose velocity is the same everywhere, has a centre whose speed is known here.
local function mean(rows)
  local sum = { 0, 0, 0 }
  for _, row in ipairs(rows) do
    for axis = 1, 3 do sum[axis] = sum[axis] + row[axis] / #rows end
  end
  return sum
end

-- Angular momentum about the centre of equal masses of 1 kg, and what it is a sum of: the sizes of
-- lever and momentum, kg m^2/s.
local function spin_of(positions, velocities)
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
  return spin, size
end

--- What a run must remember of its start.
---@param run limax.hard_cases.run
---@return table
function general.start(run)
  local spec = run.spec
  if spec.center == false or not all_in(spec.scene, INTERNAL)
    or (spec.settle or 0) > 0 or (spec.count or 1) > 1 or spec.materials or spec.diverges
    or spec.table_of_materials or run.simulation.masses[1] > 2000 or run.simulation.masses[1] == 0
  then
    return {}
  end
  local positions, velocities = run:state(1)
  local spin, size = spin_of(positions, velocities)
  return { velocity = mean(velocities), spin = spin, size = size }
end

-- How far the whole energy may stand above an earlier value in a scene that adds none. The
-- measured energy differs from the one that an integrator keeps, in a mode of frequency w:
-- symplectic Euler keeps v^2 + w^2 x^2 - h w^2 x v, leapfrog v^2 + w^2 x^2 (1 - (w h / 2)^2). With
-- s = w h / 2, at most the step over the bound, since the bound is where s = 1, the ratio of any
-- two measured values is at most (1 + s) / (1 - s) and 1 / (1 - s^2).
local function ratio_allowed(outcome, integrator)
  local s = math.min(outcome.time_step / outcome.time_step_bound, 0.95)
  if general.WHOLE_KICKS[integrator] then return (1 + s) / (1 - s) end
  return 1 / (1 - s * s)
end

-- The whole energy of each sample, from the lowest that the weight gets to.
local function whole_energies(rows)
  local lowest = math.huge
  for _, row in ipairs(rows) do lowest = math.min(lowest, row[3]) end
  local list = {}
  for sample, row in ipairs(rows) do list[sample] = row[1] + row[2] + row[3] - lowest end
  return list
end

-- Rounding, as a share of the largest energy: MuJoCo's figures for the same check.
local ROUNDING = { double = 1e-9, mixed = 1e-4, compensated = 1e-4, single = 1e-4 }

-- J: what a spring of 1e4 N/m holds whose ends are rounded at a metre
local SPRING_ROUNDING = { double = 1e-27, mixed = 1e-10, compensated = 1e-10, single = 1e-10 }

local function check_energy(run, robot)
  local options = run.options
  local energies = whole_energies(run:trace("energy", robot))
  local largest = 0
  for _, energy in ipairs(energies) do largest = math.max(largest, energy) end
  -- gravitational energies have their zero at z = 0, so that their rounding grows with height
  local row, outcome = run:trace("energy", robot)[1], run:outcome(robot)
  local rounding = ROUNDING[options.precision]
    * math.max(energies[1], math.abs(row and row[3] or 0))
    + outcome.springs * SPRING_ROUNDING[options.precision]
  -- a case with springs beyond the bound's reach states what that brings
  local ratio = ratio_allowed(outcome, options.integrator) * (1 + (run.spec.energy_rise or 0))
  local least = math.huge
  for sample, energy in ipairs(energies) do
    if not finite(energy) then fail("energy at sample %d is %s", sample, tostring(energy)) end
    if energy > ratio * least + rounding then
      fail("energy of a passive scene rises from %.6g to %.6g J at sample %d; %.3g times is what "
        .. "this step may show", least, energy, sample, ratio)
    end
    least = math.min(least, energy)
  end
end

-- Where gravity alone takes a centre of mass.
local function check_center(c, run)
  local outcome, spec, velocity = run:outcome(1), run.spec, run.start.velocity
  if not velocity then return end
  local gravity, scene_gravity = { 0, 0, 0 }, spec.scene and spec.scene.gravity
  if scene_gravity then
    gravity = type(scene_gravity) == "table" and scene_gravity.acceleration or { 0, 0, -9.81 }
  end
  local h, time = outcome.time_step, outcome.time
  -- the sum of n (n + 1) / 2 kicks where each moves the masses at once
  local whole_kicks = general.WHOLE_KICKS[run.options.integrator]
  local discrete = whole_kicks and time + h or time
  -- a rounding per step of the distance gone, and in fp32 of forces that nearly cancel
  local reach = 0.1
  for axis = 1, 3 do
    reach = math.max(reach, math.abs(velocity[axis] * time),
      math.abs(0.5 * gravity[axis] * time * time))
  end
  local allowed = c:by_precision { double = 1e-11, compensated = 5e-6, mixed = 5e-6, single = 2e-3 }
  for axis = 1, 3 do
    local expected = outcome.center_start[axis] + velocity[axis] * time
      + 0.5 * gravity[axis] * time * discrete
    c:near(("centre of mass %s"):format(({ "x", "y", "z" })[axis]), outcome.center_end[axis],
      expected, { atol = (spec.center_tolerance or 1) * allowed * reach })
  end
end

-- Forces along the lines between masses turn nothing; nor does uniform gravity about the centre.
local function check_spin(c, run)
  if not run.start.spin or (run.spec.scene or {}).self_collision then return end
  local positions, velocities = run:state(1)
  local spin, size = spin_of(positions, velocities)
  local speed = 0 -- m/s, whose rounding is in every lever
  for _, v in ipairs(mean(velocities)) do speed = math.max(speed, math.abs(v)) end
  -- RK4 keeps it to its order alone
  local share = c.integrator == "rk4" and 1e-3
    or c:by_precision { double = 1e-10, compensated = 1e-4, mixed = 1e-4, single = 1e-2 }
  local allowed = (run.spec.center_tolerance or 1) * share
    * math.max(size, run.start.size, run:outcome().masses * 1e-3 * math.max(1, speed))
  for axis = 1, 3 do
    c:near(("angular momentum about %s"):format(({ "x", "y", "z" })[axis]), spin[axis],
      run.start.spin[axis], { atol = allowed })
  end
end

local function contains(list, value)
  for _, each in ipairs(type(list) == "table" and list or { list }) do
    if each == value then return true end
  end
  return false
end

--- Holds a run that has ended to the general checks. Sets `run.verdict`: "holds", or the reason for
--- which a robot was reported as it should be.
---@param c limax.hard_cases.context
---@param run limax.hard_cases.run
function general.check(c, run)
  local spec = run.spec
  run.verdict = "holds"
  for robot = 1, spec.count or 1 do
    local outcome = run:outcome(robot)
    local must = robot == 1 and spec.diverges or nil
    if outcome.status == "diverged" then
      local honest = contains(must, outcome.reason) or contains(spec.may_diverge, outcome.reason)
      if not honest then
        fail("robot %d diverged (%s) at step %d, %.4g s", robot, outcome.reason, outcome.step,
          outcome.time)
      end
      run.verdict = "reported: " .. outcome.reason
      c.reported = outcome.reason
    elseif outcome.status ~= "done" and outcome.status ~= spec.status then
      fail("robot %d is %s%s", robot, outcome.status,
        outcome.reason and " (" .. outcome.reason .. ")" or "")
    elseif must then
      fail("robot %d ended well, and should have been reported as diverged", robot)
    elseif outcome.status == "done" then
      local positions, velocities = run:state(robot)
      for _, rows in ipairs { positions, velocities } do
        for mass, row in ipairs(rows) do
          for axis = 1, 3 do
            if not finite(row[axis]) then fail("mass %d of robot %d is at %s", mass, robot,
              tostring(row[axis])) end
          end
        end
      end
      if run.simulation.record.energy and general.wants_energy(spec) then
        check_energy(run, robot)
      end
      if robot == 1 then
        check_center(c, run)
        check_spin(c, run)
      end
    end
  end
end

return general
