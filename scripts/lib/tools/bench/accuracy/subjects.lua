--- subjects.lua: the four scenes of the work-precision diagrams: a free body that vibrates, a body
--- that works in the air, a drop, and a walk. The first two are smooth: no contact switches. SI
--- units.

local bodies = require "limax.tools.bench.bodies"
local engine = require "limax.engine"
local rescore = require "limax.evolution.rescore"
local scenes = require "limax.scenes"
local walkers = require "limax.tools.bench.accuracy.walkers"

local subjects = {}

subjects.NAMES = { "free", "air", "drop", "walk" }

--- What a figure calls them.
subjects.TITLES = {
  free = "free body, vibrating", air = "actuated body in the air", drop = "drop from 0.1 m",
  walk = "walk, before chaos",
}

--- Is the scene without contact, so that every integrator keeps its order?
subjects.SMOOTH = { free = true, air = true }

-- s of simulated time: some periods of the free body's slowest mode; the fall from 0.1 m takes
-- 0.14 s; and in contact two steps tell the same story for about half a second
local DURATION = 0.4

-- m/s across the body: strains of some per cent, as muscles make
local SHAKEN = 0.5

-- Velocities that stretch, bend and twist at once, with no momentum to speak of.
local function shake(simulation, robot)
  local places = (simulation:state(robot)):table()
  local low, high = { unpack(places[1]) }, { unpack(places[1]) }
  for _, p in ipairs(places) do
    for axis = 1, 3 do
      low[axis], high[axis] = math.min(low[axis], p[axis]), math.max(high[axis], p[axis])
    end
  end
  local velocities = {}
  for mass, p in ipairs(places) do
    local u = {}
    for axis = 1, 3 do
      u[axis] = (p[axis] - low[axis]) / math.max(high[axis] - low[axis], 1e-9) - 0.5
    end
    velocities[mass] = { SHAKEN * (u[1] + u[3] * u[3] - 1 / 12), SHAKEN * u[3] * u[1],
      -SHAKEN * (u[3] + u[1] * u[2]) }
  end
  simulation:place(robot, nil, velocities)
end

-- The best walker among the first bodies of the quickstart, as a population and a place in it.
local function walker(given)
  local n = given.lattice
  local experiment = walkers.experiment(walkers.CASES[1], { "population=24",
    ("lattice=[%d,%d,%d]"):format(n[1], n[2], n[3]), "simulation.duration=1", "record={}",
    -- small lattices need it to be of several materials at all
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

-- A population that holds the body of a scene, and its place there.
local function body_of(name, given)
  if name == "walk" then return walker(given) end
  return bodies.population(given.materials, given.lattice, 1, { first = given.number }), 1
end

--- The subject of a name, with `count` equal bodies.
---@param name string of subjects.NAMES
---@param given { materials: limax.materials, lattice: integer[], count: integer,
--- duration: number|nil, number: integer|nil } `number`: of the body, 1 if left out
---@return limax.accuracy.subject
function subjects.get(name, given)
  local materials = given.materials
  local origin, place = body_of(name, given)
  local population = engine.population { lattice = given.lattice, count = given.count }
  for robot = 1, given.count do
    population:set_body(robot, origin:voxels(place), origin:weights(place))
  end
  population:check(materials, { require_muscle = false })
  local subject = { name = name, population = population, materials = materials, settle = 0,
    duration = given.duration or DURATION }
  if name == "free" then
    subject.scene = engine.scene { damping = true }
    subject.place = shake
  elseif name == "air" then
    subject.scene = engine.scene(scenes.air { gravity = false })
  elseif name == "drop" then
    subject.scene = engine.scene(scenes.land { actuation = false })
    subject.position = { 0, 0, 0.1 }
  else
    subject.scene = engine.scene(scenes.land())
  end
  return subject
end

return subjects
