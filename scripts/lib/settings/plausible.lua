--- plausible.lua: settings of an experiment that are valid but probably unintended, such as wrong
--- units or signs. Each gives one note before the first generation. SI units.

local plausible = {}

-- Largest share of its length by which one site's weight may shorten a spring: a quarter, as the
-- paper's muscles do.
local MOST_SAG = 0.25

-- Gravity that lifts bodies off the ground.
local function upwards(scene)
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

-- A fall that takes longer than the run.
local function falling(config)
  local scene, simulation = config.scene, config.simulation
  local down = scene.gravity and -scene.gravity.acceleration[3] or 0
  if down <= 0 or not scene.ground then return nil end
  local height, speed = simulation.position[3] - scene.ground.height, simulation.velocity[3]
  local time = (speed + math.sqrt(speed * speed + 2 * down * math.max(0, height))) / down
  local run_time = simulation.settle + simulation.duration
  if height <= 0 or time <= run_time then return nil end
  return ("simulation.position: from %.4g m above scene.ground a body falls for %.4g s, and a run"
    .. " takes %.4g s: it never lands"):format(height, time, run_time)
end

-- A start below the ground, which throws the body out.
local function buried(config)
  local ground, height = config.scene.ground, config.simulation.position[3]
  if not ground or height >= ground.height then return nil end
  return "simulation." .. plausible.buried(height, ground.height)
end

-- Muscles in a scene that does not drive them.
local function idle_muscles(config)
  if config.scene.actuation then return nil end
  return "scene names no actuation: no muscle moves; actuation = { frequency = 2 } drives them"
end

-- A fall through the whole run.
local function bottomless(config)
  local scene = config.scene
  local down = scene.gravity and -scene.gravity.acceleration[3] or 0
  if down <= 0 or scene.drag then return nil end
  for _, name in ipairs { "ground", "planes", "spheres", "boxes", "terrain", "anchors" } do
    if scene[name] then return nil end
  end
  return "scene has gravity and nothing to stand on: bodies fall all the time; ground = true is"
    .. " flat ground"
end

-- Offspring that cannot differ from their parents.
local function no_variation(config)
  local breeding = config.breeding
  local mutates = config.genome.mutation or breeding.mutation_rate * breeding.mutation_scale > 0
  if mutates or breeding.crossover_rate > 0 then return nil end
  return "breeding: without mutation (mutation_rate, mutation_scale) and crossover_rate, offspring"
    .. " are copies of their parents"
end

-- A tournament that the best robot always wins.
local function large_tournament(config)
  local selection = config.selection
  local size = type(selection) == "table" and selection.name == "tournament" and selection.size
  if not size or size <= config.population then return nil end
  return ("selection: a tournament of %d in a population of %d nearly always picks the best")
    :format(size, config.population)
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

--- A note about a body that starts below the ground.
---@param height number m, of its lowest corner
---@param ground number m
function plausible.buried(height, ground)
  return ("position: z = %.4g m is %.4g m below scene.ground: contact throws the body out")
    :format(height, ground - height)
end

--- Notes with field, value and consequence.
---@param config table a resolved configuration
function plausible.notes(config)
  local list = {}
  list[#list + 1] = sticking(config)
  list[#list + 1] = upwards(config.scene)
  list[#list + 1] = collapse(config)
  list[#list + 1] = falling(config)
  list[#list + 1] = slow_muscles(config)
  list[#list + 1] = buried(config)
  list[#list + 1] = idle_muscles(config)
  list[#list + 1] = bottomless(config)
  return list
end

--- Notes on breeding and selection.
function plausible.breeding_notes(config)
  local list = {}
  list[#list + 1] = no_variation(config)
  list[#list + 1] = large_tournament(config)
  return list
end

return plausible
