--- plausible.lua: settings of an experiment that are valid but probably unintended, such as wrong
--- units or signs. Each gives one note before the first generation. SI units.

local plausible = {}

-- Largest share of its length by which one site's weight may shorten a spring: a quarter, as the
-- paper's muscles do.
local MOST_SAG = 0.25

-- Gravity that lifts bodies off the ground.
local function upwards(config)
  local scene = config.scene
  local up = scene.gravity and scene.ground and scene.gravity.acceleration[3] or 0
  if up <= 0 then return nil end
  return ("scene.gravity: its acceleration points up, away from scene.ground (z is %.6g m/s^2):"
    .. " bodies fly off"):format(up)
end

-- Bodies that collapse under their own weight.
local function collapse(config)
  local gravity = config.scene.gravity
  if not gravity then return nil end
  local x, y, z = unpack(gravity.acceleration)
  local strength, softest, most = math.sqrt(x * x + y * y + z * z), nil, 0
  for _, material in ipairs(config.materials.materials) do
    local sag = material.stiffness and material.mass_per_site * strength / material.stiffness or 0
    if sag > most then softest, most = material, sag end
  end
  if most <= MOST_SAG * config.simulation.edge then return nil end
  return ("simulation.edge is %.4g m, and the weight of one site of %s (%.4g kg) shortens its"
    .. " spring of %.4g N/m by %.4g m: bodies collapse; are lengths in m, masses in kg, stiffnesses"
    .. " in N/m?"):format(config.simulation.edge, softest.name, softest.mass_per_site,
    softest.stiffness, most)
end

-- A start below the ground, which throws the body out.
local function buried(config)
  local ground, height = config.scene.ground, config.simulation.position[3]
  if not ground or height >= ground.height then return nil end
  return ("simulation.position: z = %.4g m is %.4g m below scene.ground: contact throws the body"
    .. " out"):format(height, ground.height - height)
end

-- Muscles in a scene that does not drive them.
local function idle_muscles(config)
  if config.scene.actuation then return nil end
  return "scene names no actuation: no muscle moves; actuation = { frequency = 2 } drives them"
end

--- A note about offspring that cannot differ from their parents; nil if they can.
---@param config table a resolved configuration
function plausible.no_variation(config)
  local breeding = config.breeding
  local mutates = config.genome.mutation or breeding.mutation_rate * breeding.mutation_scale > 0
  if mutates or breeding.crossover_rate > 0 then return nil end
  return "breeding: without mutation (mutation_rate, mutation_scale) and crossover_rate, offspring"
    .. " are copies of their parents"
end

-- Muscles that do not complete one cycle in the run.
local function slow_muscles(config)
  local actuation, duration = config.scene.actuation, config.simulation.duration
  local frequency = actuation and actuation.frequency or 0
  if frequency <= 0 or frequency * duration >= 1 then return nil end
  return ("scene.actuation.frequency is %.4g Hz, a period of %.4g s, and simulation.duration is"
    .. " %.4g s: no muscle completes a cycle; at least %.4g Hz lets it"):format(frequency,
    1 / frequency, duration, 1 / duration)
end

-- Friction that does not have to be overcome.
local function sticking(config)
  local friction = config.scene.friction
  if not friction or friction.static >= friction.kinetic then return nil end
  return ("scene.friction: static %.6g is below kinetic %.6g; the law is then plain Coulomb"
    .. " friction at %.6g"):format(friction.static, friction.kinetic, friction.kinetic)
end

local CHECKS = { sticking, upwards, collapse, slow_muscles, buried, idle_muscles }

--- Notes with field, value and consequence.
---@param config table a resolved configuration
function plausible.notes(config)
  local list = {}
  for _, check in ipairs(CHECKS) do list[#list + 1] = check(config) end
  return list
end

return plausible
