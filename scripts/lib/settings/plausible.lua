--- plausible.lua: settings of an experiment that are valid but probably unintended, such as wrong
--- units or signs. Each gives one note before the first generation. SI units.

local choice = require "limax.base.choice"
local engine = require "limax.engine"

local plausible = {}

-- Fewer samples in a period of the muscles give measures of a trace that depend on the rate.
local SAMPLES_OF_PERIOD = 8

-- Largest share of its length by which one site's weight may shorten a spring: a quarter, as the
-- paper's muscles do.
local MOST_SAG = 0.25

-- Body lengths per second beyond those of any robot: the fastest of EVOLUTION.md have five.
local FASTEST = 6

-- Gravity that lifts bodies off the ground.
local function upwards(scene)
  local up = scene.gravity and scene.ground and scene.gravity.acceleration[3] or 0
  if up <= 0 then return nil end
  return ("scene.gravity: its acceleration points up, away from scene.ground (z is %.6g m/s^2):"
    .. " bodies fly off"):format(up)
end

-- Gravity that pulls along the ground rather than onto it.
local function sideways(scene)
  local gravity = scene.ground and scene.gravity
  if not gravity then return nil end
  local x, y, z = unpack(gravity.acceleration)
  if x * x + y * y <= z * z then return nil end
  return ("scene.gravity: { %.6g, %.6g, %.6g } pulls along scene.ground more than onto it: bodies"
    .. " fall sideways; down is -z"):format(x, y, z)
end

-- Anchors beyond every body, or of bodies on the ground.
local function odd_anchors(config)
  local anchors, lattice = config.scene.anchors, config.lattice
  if not anchors or not lattice then return nil end
  for axis = 1, 3 do
    local most = lattice[axis] * config.simulation.edge
    if anchors.from[axis] > most or anchors.to[axis] < 0 then
      return ("scene.anchors hold nothing: a body reaches from 0 to at most %.4g m along %s")
        :format(most, ("xyz"):sub(axis, axis))
    end
  end
  return config.scene.ground and "scene.anchors hold bodies where they start: on scene.ground they"
    .. " cannot walk" or nil
end

-- Terrain that no body starts on.
local function terrain_beside(config)
  local terrain, lattice = config.scene.terrain, config.lattice
  if not terrain or not lattice then return nil end
  for axis, count in ipairs { #terrain.heights, #terrain.heights[1] } do
    local low, start = terrain.origin[axis], config.simulation.position[axis]
    local high, finish = low + (count - 1) * terrain.spacing,
      start + lattice[axis] * config.simulation.edge
    if start > high or finish < low then
      return ("scene.terrain is beside the body: along %s it reaches from %.4g to %.4g m, and a"
        .. " full body starts at %.4g to %.4g m; set scene.terrain.origin"):format(
        ("xyz"):sub(axis, axis), low, high, start, finish)
    end
  end
end

-- Terrain that the ground covers.
local function covered_terrain(scene)
  local terrain, ground = scene.terrain, scene.ground
  if not terrain or not ground then return nil end
  local lowest = math.huge
  for _, row in ipairs(terrain.heights) do lowest = math.min(lowest, unpack(row)) end
  lowest = lowest + terrain.origin[3]
  if lowest >= ground.height then return nil end
  return ("scene.terrain lies below scene.ground: it reaches down to %.4g m, and the ground at"
    .. " %.4g m covers it there; set ground = false"):format(lowest, ground.height)
end

-- What no controller of the scene senses: its target, and noise and delay of sensors.
local function not_sensed(scene, inputs, fitness)
  local sensed, is_measured, list = {}, false, {}
  for _, input in ipairs(inputs) do sensed[input:match "^[^.]*"] = true end
  for _, sensor in ipairs(engine.sensors()) do
    is_measured = is_measured or sensor.measured and sensed[sensor.name]
  end
  if scene.target and fitness ~= "target" and not sensed.target and not sensed.target_distance then
    list[1] = "scene.target acts only on a controller that reads target or target_distance, and"
      .. " none does"
  end
  for _, name in ipairs { "noise", "delay" } do
    if scene.control and scene.control[name] > 0 and not is_measured then
      list[#list + 1] = ("scene.control.%s changes nothing: it acts on measured sensors such as"
        .. " strain, and the signal reads none"):format(name)
    end
  end
  return list
end

-- Muscles that do not reach their amplitude in the run.
local function slow_ramp(config)
  local actuation, duration = config.scene.actuation, config.simulation.duration
  if not actuation then return nil end
  local periods = actuation.frequency * duration
  if periods < 1 or actuation.ramp <= periods then return nil end
  return ("scene.actuation.ramp is %.4g periods, and the run has %.4g: muscles never reach their"
    .. " amplitude"):format(actuation.ramp, periods)
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

-- Muscles in a scene that does not drive them.
local function idle_muscles(config)
  if config.scene.actuation or config.scene.control then return nil end
  return "scene names no actuation: no muscle moves; actuation = { frequency = 2 } drives them"
end

-- What a body can push itself off from: contacts, and forces of a medium.
local CONTACTS = { "ground", "planes", "spheres", "boxes", "terrain" }
local OTHERS = { "drag", "wind", "anchors", "block" }

local function has_any(scene, names)
  for _, name in ipairs(names) do
    if scene[name] then return name end
  end
end

-- A fall through the whole run.
local function bottomless(config)
  local scene = config.scene
  local down = scene.gravity and -scene.gravity.acceleration[3] or 0
  if down <= 0 or scene.drag then return nil end
  if has_any(scene, CONTACTS) or scene.anchors then return nil end
  return "scene has gravity and nothing to stand on: bodies fall all the time; ground = true is"
    .. " flat ground"
end

-- Boxes that no body reaches on its own legs in the run.
local function far_boxes(config)
  local scene, lattice, simulation = config.scene, config.lattice, config.simulation
  if not scene.boxes or not lattice or not scene.ground then return nil end
  local low, length, nearest = simulation.position, 0, math.huge
  for axis = 1, 2 do length = math.max(length, lattice[axis] * simulation.edge) end
  for _, box in ipairs(scene.boxes) do
    local away = 0
    for axis = 1, 2 do
      local high = low[axis] + lattice[axis] * simulation.edge
      away = math.max(away, box.from[axis] - high, low[axis] - box.to[axis])
    end
    nearest = math.min(nearest, away)
  end
  if nearest <= FASTEST * length * simulation.duration then return nil end
  return ("scene.boxes are out of reach: the nearest is %.4g m from the body, which is %.4g m long,"
    .. " and simulation.duration is %.4g s"):format(nearest, length, simulation.duration)
end

-- Muscles in a scene where they cannot move the body.
local function nothing_to_push(config)
  local scene = config.scene
  for _, effect in pairs(scene) do
    if effect.force then return nil end
  end
  if not (scene.actuation or scene.control) or has_any(scene, OTHERS) then return nil end
  local contact = has_any(scene, CONTACTS)
  if not contact then
    if scene.gravity then return nil end -- bottomless() has a note on it
    return "scene names nothing that a body can push itself off from, and no gravity: muscles"
      .. " deform it, and its centre of mass stays; limax.scenes.land { actuation = ... } is"
      .. " gravity, ground, friction, damping and muscles"
  elseif not scene.gravity then
    return ("scene names %s and no gravity: nothing presses bodies onto it; gravity = true does")
      :format(contact)
  end
  local friction = scene.friction
  if friction and friction.static + friction.kinetic > 0
    or contact ~= "ground" or has_any(scene, { unpack(CONTACTS, 3) }) then
    return nil
  end
  return (friction and "scene.friction is 0" or "scene names no friction")
    .. ": on smooth ground no muscle moves a body along; friction = true does"
end

-- Voxels of a size that a wrong unit explains.
local function odd_size(config)
  local edge, lattice = config.simulation.edge, config.lattice
  if edge >= 1e-3 and edge <= 1 then return nil end
  return ("simulation.edge is %.4g m, so a full body is %.4g x %.4g x %.4g m; lengths are in m")
    :format(edge, edge * lattice[1], edge * lattice[2], edge * lattice[3])
end

-- Inputs of the network that turn more than once between neighbouring voxels.
local function noise(config)
  local sigma, longest = config.genome.sigma, math.max(unpack(config.lattice))
  local most = (longest - 1) / 2 -- voxel centres are from -1 to 1
  -- in small lattices every voxel is near every other
  if not sigma or longest < 4 or sigma <= most then return nil end
  return ("genome.sigma is %.4g: the network's inputs turn more than once from voxel to voxel, so"
    .. " bodies are noise; below %.2g neighbours resemble each other"):format(sigma, most / 2)
end

-- Offspring that cannot differ from their parents.
local function no_variation(config)
  local breeding = config.breeding
  local mutates = config.genome.mutation or breeding.mutation_rate * breeding.mutation_scale > 0
  local of_control = (breeding.control_mutation_rate or 0) * (breeding.control_mutation_scale or 0)
  if mutates or of_control > 0 or breeding.crossover_rate > 0 then return nil end
  return "breeding: without mutation (mutation_rate, mutation_scale) and crossover_rate, offspring"
    .. " are copies of their parents"
end

-- Genes of control that are 0 in all robots and stay so.
local function constant_control(config, supervisor)
  local breeding, genome = config.breeding, config.genome
  local own = type(genome.encoding) == "table" and genome.encoding[1] == nil
  if not breeding.control_mutation_rate or genome.control_spread > 0 or own then return nil end
  if genome.mutation and genome.mutation ~= "none" then return nil end
  local constant = genome.mutation
  for _, name in ipairs { "control_mutation_rate", "control_mutation_scale" } do
    local changes = supervisor.changes
    constant = constant or breeding[name] == 0 and changes and not choice.contains(changes, name)
  end
  return constant and "genome.control_spread is 0, and no mutation changes genes of control: they"
    .. " are 0 in every robot; set genome.control_spread, or breeding.control_mutation_rate and"
    .. " control_mutation_scale" or nil
end

-- A tournament that the best robot always wins.
local function large_tournament(config)
  local selection = config.selection
  local size = type(selection) == "table" and selection.name == "tournament" and selection.size
  if not size or size <= config.population then return nil end
  return ("selection: a tournament of %d in a population of %d nearly always picks the best")
    :format(size, config.population)
end

-- A share of survivors that leaves only the place that one offspring, or the newcomers, must have.
local function few_offspring(config, survival)
  local size = config.population / (config.islands and config.islands.count or 1)
  local places = survival.newcomers or 1
  if not survival.share or math.floor(survival.share * size + 0.5) <= size - places then
    return nil
  end
  return ("survival.share is %.4g of %d robots: only %d of them %s new in each generation; share ="
    .. " 0.5 renews half"):format(survival.share, size, places, places == 1 and "is" or "are")
end

-- The score as an objective beside the measure that the fitness is.
local function same_objectives(parts)
  local fitness, signs = parts.fitness, {}
  for _, measure in ipairs((parts.measured or {}).objectives or {}) do
    signs[measure.name] = measure.sign
  end
  local sign = next(fitness.options) == nil and signs[fitness.name]
  if not sign or signs.fitness ~= sign then return nil end
  return ('objectives: "fitness" and %q are the same number, because the fitness is %q: name'
    .. " another one instead of either"):format(fitness.name, fitness.name)
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

--- A note about bodies that begin inside an obstacle, which throws them out; nil if none does.
---@param found limax.overlap|nil
---@return string|nil
function plausible.overlap(found)
  if not found then return nil end
  local others = found.robots > 1 and (" (%d robots begin inside something)"):format(found.robots)
    or ""
  return ("position: %s begins %.3g m inside %s%s: contact throws it out; begin outside%s"):format(
    found.subject, found.depth, found.obstacle, others,
    found.obstacle:find("plane", 1, true) and ", to which a plane's normal points" or "")
end

--- A note about a scene of a simulation that was probably meant to change another one; nil if not.
---@param named table as a script wrote it
---@param scene table its effects
---@return string|nil
function plausible.replaced(named, scene)
  local ground = has_any(scene, CONTACTS)
  if ground and not scene.gravity then
    return ("scene replaces that of the robot: it has %s and no gravity, so nothing presses bodies"
      .. " onto it; limax.scenes.land { ... } has both"):format(ground)
  end
  if type(named) ~= "table" or next(named) == nil then return nil end
  for _, effect in pairs(named) do
    if effect then return nil end
  end
  return "scene replaces that of the robot: every effect in it is false, so nothing acts;"
    .. " limax.scenes.land { friction = false } is land without friction"
end

--- Notes about a robot by hand in a scene where it collapses or its muscles cannot move it.
---@param counts integer[] its voxels of each material
---@param materials table as a material file holds it
---@param scene table its effects
---@param edge number m
---@return string[]
function plausible.by_hand(counts, materials, scene, edge)
  local used, has_muscle, list = {}, false, {}
  for m, material in ipairs(materials.materials) do
    used[#used + 1] = counts[m] > 0 and material or nil
    has_muscle = has_muscle or counts[m] > 0 and material.amplitude ~= nil
  end
  list[1] = collapse { scene = scene, materials = { materials = used },
    simulation = { edge = edge } }
  if not has_muscle then return list end
  list[#list + 1] = bottomless { scene = scene }
  -- replaced() has a note on contacts without gravity
  if scene.gravity or not has_any(scene, CONTACTS) then
    list[#list + 1] = nothing_to_push { scene = scene }
  end
  return list
end

--- A note about genes of control in a scene that has no controller; nil if it has one.
---@param description limax.robot.description
---@param scene table its effects
---@return string|nil
function plausible.idle_genes(description, scene)
  if not description.control or description.trials or scene.control then return nil end
  return "the scene has no control, so the robot's genes of control do nothing; scene = { control ="
    .. " ... } reads them"
end

--- A note about the scene of a trial that lacks what bodies stand on; nil if it does not.
---@param scene table of the trial
---@param common table that of the experiment, which it replaces
---@return string|nil
function plausible.dropped(scene, common)
  if scene.gravity or scene.drag or has_any(scene, CONTACTS) or not has_any(common, CONTACTS) then
    return nil
  end
  local lost = {}
  for name in pairs(common) do lost[#lost + 1] = not scene[name] and name or nil end
  table.sort(lost)
  return ("scene replaces that of the experiment, so it lacks its %s; name these too, as"
    .. " limax.scenes.land { ... } does"):format(table.concat(lost, ", "))
end

--- A note on a rate that is too low for the measures of a trace; nil if it is not.
---@param rate number samples per second
---@param scene table effects with all their fields
---@param enough? number a rate that is never too low
function plausible.sparse(kind, rate, scene, enough)
  local least = scene.actuation and SAMPLES_OF_PERIOD * scene.actuation.frequency or 0
  least = math.min(least, enough or least)
  if rate == 0 or rate >= least then return nil end
  return ("record.%s is %g Hz, fewer than %d samples in a period of the muscles: measures of this"
    .. " trace depend on it; record at least %g Hz"):format(kind, rate, SAMPLES_OF_PERIOD, least)
end

--- Notes with field, value and consequence.
---@param config table a resolved configuration
---@param inputs string[] what the scene's controller reads
function plausible.notes(config, inputs)
  local list = not_sensed(config.scene, inputs, config.fitness)
  list[#list + 1] = sticking(config)
  list[#list + 1] = upwards(config.scene)
  list[#list + 1] = sideways(config.scene)
  list[#list + 1] = odd_anchors(config)
  list[#list + 1] = terrain_beside(config)
  list[#list + 1] = far_boxes(config)
  list[#list + 1] = covered_terrain(config.scene)
  list[#list + 1] = slow_ramp(config)
  list[#list + 1] = collapse(config)
  list[#list + 1] = falling(config)
  list[#list + 1] = slow_muscles(config)
  list[#list + 1] = idle_muscles(config)
  list[#list + 1] = bottomless(config)
  list[#list + 1] = nothing_to_push(config)
  return list
end

--- Notes on size, encoding, breeding, selection and survival.
---@param config table a resolved configuration
---@param parts { fitness: limax.fitness, supervisor: { changes: string[]|nil }, survival:
--- limax.survival, measured: limax.measured|nil } `changes` are the fields that the supervisor may
--- set; nil for all
function plausible.notes_of_whole(config, parts)
  local list = {}
  list[#list + 1] = odd_size(config)
  list[#list + 1] = noise(config)
  list[#list + 1] = no_variation(config)
  list[#list + 1] = constant_control(config, parts.supervisor)
  list[#list + 1] = large_tournament(config)
  list[#list + 1] = few_offspring(config, parts.survival)
  list[#list + 1] = same_objectives(parts)
  return list
end

return plausible
