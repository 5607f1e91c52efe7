--- bound_check.lua: does the `bound` of a scripted force cover its slopes? One that is too small
--- makes the automatic time step too long, and results wrong or unstable. One robot's first steps
--- are repeated on the CPU and the slopes of the force taken at its masses.

local engine = require "limax.engine"

local bound_check = {}

-- Steps that are repeated, and those between two looks.
local STEPS, BETWEEN = 2000, 50

-- A slope may be above its bound by this share: differences are not exact.
local TOLERANCE = 1.1

-- What a bound limits, its unit, and how much of it makes up the limit of a leapfrog step dt of a
-- mass m: 4 m / dt^2 and 2 m / dt (engine/physics/bound.h). Less than a hundredth of that does not
-- matter.
local UNITS = {
  { "stiffness", "N/m", function(mass, step) return 4 * mass / step ^ 2 end },
  { "damping", "N s/m", function(mass, step) return 2 * mass / step end },
}
local SHARE = 0.01

-- The largest slopes of each force along a run.
local function largest(found, slopes)
  for _, slope in ipairs(slopes) do
    local entry = found[slope.name]
    if not entry then
      found[#found + 1], found[slope.name] = slope, slope
    else
      for _, unit in ipairs(UNITS) do
        local kind = unit[1]
        entry.found[kind] = math.max(entry.found[kind], slope.found[kind])
      end
    end
  end
end

-- The masses that anchors hold: they limit no step. `start` are the places of all masses.
local function held_of(anchors, start)
  local held, corner, slack = {}, {}, 1e-6 -- m, as in engine/physics/effects/anchors.h
  for c = 1, anchors and 3 or 0 do
    corner[c] = math.huge
    for _, place in ipairs(start) do corner[c] = math.min(corner[c], place[c]) end
  end
  for m, place in ipairs(anchors and start or {}) do
    local is_held = true
    for c = 1, 3 do
      local x = place[c] - corner[c]
      is_held = is_held and x >= anchors.from[c] - slack and x <= anchors.to[c] + slack
    end
    held[m] = is_held or nil
  end
  return held
end

-- Forces with their bounds that were tested in this process.
local tested = {}

-- Has the scene a force with a bound that was not tested? Notes it down.
local function is_untested(scene)
  local found = false
  for name, effect in pairs(scene:table()) do
    if effect.force and effect.bound then
      local key = ("%s\n%s\n%.17g %.17g"):format(name, effect.force, effect.bound.stiffness,
        effect.bound.damping)
      found, tested[key] = found or not tested[key], true
    end
  end
  return found
end

--- Notes about the scripted forces whose bound is too small; none for those that this process
--- tested before.
---@param population limax.population
---@param mask boolean[]|nil robots of which the first with a valid body is tested; all if left out
---@param materials limax.materials
---@param scene limax.scene
---@param options table of the engine's simulation
---@return string[]
function bound_check.notes(population, mask, materials, scene, options)
  local notes, only, found, i = {}, {}, {}, nil
  if type(options.time_step) == "number" or not is_untested(scene) then return notes end
  for robot = 1, population.count do
    local is_valid = (not mask or mask[robot]) and population:body(robot).status == "valid"
    only[robot] = is_valid and not i
    if only[robot] then i = robot end
  end
  if not i then return notes end
  local simulation = engine.simulation(population, materials, scene, options,
    engine.device "cpu", only)
  local held = held_of(scene:table().anchors, (simulation:state(i)))
  for _ = 0, STEPS, BETWEEN do
    largest(found,
      engine.script_slopes(population, i, materials, scene, options, simulation, held))
    if simulation:advance(1, BETWEEN).finished then break end
  end
  local outcome = simulation:outcome(i)
  local mass, step = outcome.mass / outcome.masses, outcome.time_step_bound
  simulation:free()
  if not step then return notes end
  for _, slope in ipairs(found) do
    for _, unit in ipairs(UNITS) do
      local kind = unit[1]
      local reached, stated = slope.found[kind], slope.stated[kind]
      if slope.bounded and reached > TOLERANCE * stated
        and reached - stated > SHARE * unit[3](mass, step) then
        notes[#notes + 1] = ("scene.%s.bound.%s is %.4g %s, and the force has a slope of %.4g %s in"
          .. " the first %d steps of a robot: the automatic time step is too long; state at least"
          .. " that"):format(slope.name, kind, stated, unit[2], reached, unit[2],
          outcome.step)
      end
    end
  end
  return notes
end

return bound_check
