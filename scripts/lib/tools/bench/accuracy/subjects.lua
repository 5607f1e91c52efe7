--- subjects.lua: the four scenes of the work-precision diagrams: a free body that vibrates, an
--- actuated body in the air, a drop, and a walk. SI units.

local bodies = require "limax.tools.bench.bodies"
local engine = require "limax.engine"
local rescore = require "limax.evolution.rescore"
local scenes = require "limax.scenes"
local walkers = require "limax.tools.bench.accuracy.walkers"

local subjects = {}

-- s: some periods of the free body's slowest mode; the fall from 0.1 m takes 0.14 s; in contact two
-- steps agree for about half a second
local DURATION = 0.4

-- m/s across the body: strains of some per cent, as of muscles
local SHAKEN = 0.5

-- Velocities that stretch, bend and twist at once, with almost no momentum.
local function shake(simulation, robot)
  local positions = (simulation:state(robot)):table()
  local low, high = { unpack(positions[1]) }, { unpack(positions[1]) }
  for _, p in ipairs(positions) do
    for axis = 1, 3 do
      low[axis], high[axis] = math.min(low[axis], p[axis]), math.max(high[axis], p[axis])
    end
  end
  local velocities = {}
  for mass, p in ipairs(positions) do
    local u = {}
    for axis = 1, 3 do
      u[axis] = (p[axis] - low[axis]) / math.max(high[axis] - low[axis], 1e-9) - 0.5
    end
    velocities[mass] = { SHAKEN * (u[1] + u[3] * u[3] - 1 / 12), SHAKEN * u[3] * u[1],
      -SHAKEN * (u[3] + u[1] * u[2]) }
  end
  simulation:place(robot, nil, velocities)
end

-- The best walker among the first bodies of the quickstart: its population and index.
local function walker(lattice)
  local experiment = walkers.experiment(walkers.CASES[1], { "population=24",
    ("lattice=[%d,%d,%d]"):format(unpack(lattice)), "simulation.duration=1", "record={}",
    -- otherwise small bodies are of one material
    "genome.sigma=1" })
  local robots = walkers.random(experiment, engine.device("cpu", { threads = 1 }))
  local fitness = rescore.population(robots, { accuracy = "evolve" }).fitness
  local best
  for i = 1, #robots do
    if fitness[i] and (not best or fitness[i] > fitness[best]) then best = i end
  end
  if not best then error("none of the first bodies of walk.lua can walk", 0) end
  return robots.engine, best
end

-- What the subjects are: `smooth` has no contact.
local SUBJECTS = {
  { name = "free", title = "free body, vibrating", smooth = true, place = shake,
    scene = function() return { damping = true } end },
  { name = "air", title = "actuated body in the air", smooth = true,
    scene = function() return scenes.air { gravity = false } end },
  { name = "drop", title = "drop from 0.1 m", position = { 0, 0, 0.1 },
    scene = function() return scenes.land { actuation = false } end },
  { name = "walk", title = "walk, before chaos", scene = scenes.land },
}

subjects.NAMES, subjects.TITLES = {}, {}
for k, each in ipairs(SUBJECTS) do
  subjects.NAMES[k], subjects.TITLES[each.name], SUBJECTS[each.name] = each.name, each.title, each
end

--- The subject of a name, with `count` equal bodies.
---@param options { lattice: integer[], count: integer, duration: number|nil }
function subjects.get(name, options)
  local subject, materials = SUBJECTS[name], engine.materials "paper"
  local origin, index
  if name == "walk" then
    origin, index = walker(options.lattice)
  else
    origin, index = bodies.population(materials, options.lattice, 1), 1
  end
  local population = engine.population { lattice = options.lattice, count = options.count }
  for robot = 1, options.count do
    population:set_body(robot, origin:voxels(index), origin:weights(index))
  end
  population:check(materials, { require_muscle = false })
  return { name = name, population = population, materials = materials, settle = 0,
    duration = options.duration or DURATION, scene = engine.scene(subject.scene()),
    smooth = subject.smooth, place = subject.place, position = subject.position }
end

return subjects
