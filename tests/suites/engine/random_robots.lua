--- random_robots.lua: no random robot diverges because of the automatic step. Case N depends only
--- on N: scene, materials and settings of its batch of 64, and its own body. Soft,
--- heavy bodies that hit the ground at 100 m/s stretch to many times their length, at any step; so
--- the limits of stretch and speed are very large, and only what grows without end diverges. A
--- diverged case runs again at an eighth of the step: if it ends well, the step is the cause.
--- SI units.

local engine = require "limax.engine"
local source = require "limax.base.source"

local suite = require("limax.test").suite "random robots"

local BATCH = 64
local SEED, REPETITION = 20240501, 1 -- arbitrary; part of the definition of a case
local DURATION, EDGE = 2, 0.1 -- s, m
local FASTEST, QUICKEST = 100, 20 -- m/s, Hz
local STRONGEST = 100 -- m/s^2, of gravity
-- s: the least sqrt(m / k) of a mass and a spring or the ground. A step is about a fifth of it, so
-- that two seconds take 10^4 steps.
local LEAST_PERIOD = 1e-3
local FINER = 8
-- limits of stretch and speed, m/s
local LONGEST, WILDEST = 1e6, 1e8

-- Few, because each needs a kernel on a GPU.
local LATTICES = { { 1, 1, 1 }, { 2, 2, 2 }, { 3, 3, 3 }, { 4, 4, 4 }, { 5, 5, 5 }, { 6, 1, 1 },
  { 1, 1, 6 }, { 5, 5, 1 } }

local function random_of(batch, individual)
  return engine.random(SEED, REPETITION, "user", batch, individual)
end

local function between(random, low, high) return low + (high - low) * random:uniform() end
local function decades(random, low, high)
  return math.exp(between(random, math.log(low), math.log(high)))
end

-- A random material table, and the stiffness of ground that its lightest mass allows. Half of the
-- batches draw uniformly from the ranges, half by decades.
local function draw_materials(random)
  local materials = engine.materials "paper"
  local draw = random:uniform() < 0.5 and between or decades
  local function set(i, field, law, least)
    local range = materials:field(field)
    local value = law(random, least or range.minimum, range.maximum)
    materials:set(i, field, value)
    return value
  end
  local stiffest, lightest = 0, math.huge
  for i = 2, materials.count do stiffest = math.max(stiffest, set(i, "stiffness", draw)) end
  local least = math.max(materials:field("mass_per_site").minimum, stiffest * LEAST_PERIOD ^ 2)
  for i = 2, materials.count do
    lightest = math.min(lightest, set(i, "mass_per_site", draw, least))
    set(i, "damping_ratio", between)
    local kind = materials:get(i).kind
    if kind == "expanding" or kind == "contracting" then
      set(i, "amplitude", between)
      set(i, "phase", between)
    end
  end
  return materials, lightest / LEAST_PERIOD ^ 2
end

local function chosen(random, list) return list[random:integer(#list)] end

-- Adds the stiffness and damping of a contact.
local function surface(random, stiffest, fields)
  fields.stiffness = decades(random, 1, math.min(1e9, math.max(2, stiffest)))
  fields.damping_ratio = between(random, 0, 2)
  return fields
end

-- A vector of this length in a direction drawn by its angles from an axis and around it.
local function directed(length, tilt, heading)
  return { length * math.sin(tilt) * math.cos(heading), length * math.sin(tilt) * math.sin(heading),
    length * math.cos(tilt) }
end

-- The horizontal velocity of a wind or a current, m/s.
local function flow(random) return { between(random, -100, 100), between(random, -100, 100), 0 } end

-- A point about where bodies start.
local function point(random)
  return { between(random, -2, 2), between(random, -2, 2), between(random, -1, 1) }
end

-- Worlds around a body. They are few, because each needs a kernel on a GPU.
local WORLDS = {
  { "air", function() return {} end },
  { "land", function(random, stiffest) return { ground = surface(random, stiffest, {}) } end },
  { "corner", function(random, stiffest)
    local planes = {}
    for i = 1, 1 + random:integer(3) do
      local heading, tilt = between(random, 0, 2 * math.pi), between(random, 0, math.pi / 2)
      planes[i] = surface(random, stiffest, { offset = between(random, -3, 0.1),
        normal = directed(1, tilt, heading) })
    end
    return { planes = planes }
  end },
  { "obstacles", function(random, stiffest)
    local low = point(random)
    local high = {}
    for axis = 1, 3 do high[axis] = low[axis] + between(random, 0.1, 2) end
    return { ground = surface(random, stiffest, {}),
      spheres = surface(random, stiffest, { center = point(random),
        radius = between(random, 0.05, 1) }),
      boxes = surface(random, stiffest, { from = low, to = high }) }
  end },
  { "rough land", function(random, stiffest)
    local heights = {}
    local height = between(random, 0, 1)
    for x = 1, 16 do
      heights[x] = {}
      for y = 1, 16 do heights[x][y] = height * random:uniform() end
    end
    return { terrain = surface(random, stiffest, { heights = heights,
      spacing = between(random, 0.05, 1), origin = { -2, -2, 0 } }) }
  end },
  { "storm", function(random, stiffest)
    return { ground = surface(random, stiffest, {}),
      wind = { drag = decades(random, 1e-3, 1e3), velocity = flow(random) } }
  end },
  { "own surface", function(random, stiffest)
    return { ground = surface(random, stiffest, {}), self_collision = {
      stiffness = decades(random, 1, math.min(1e7, math.max(2, stiffest))),
      damping_ratio = between(random, 0, 2), reach = between(random, 0.1, 1.5) } }
  end },
  { "river", function(random)
    return { drag = { density = decades(random, 1, 1e5), coefficient = between(random, 0, 10),
      current = flow(random) } }
  end },
  { "beside a block", function(random, stiffest)
    local size = {}
    for axis = 1, 3 do size[axis] = between(random, 0.05, 1) end
    -- a corner has a quarter of the block's mass
    return { ground = surface(random, stiffest, {}), block = surface(random, stiffest, {
      size = size, position = { between(random, -1.5, 1.5), between(random, -1.5, 1.5),
        between(random, 0, 1) },
      mass = decades(random, 4 * stiffest * LEAST_PERIOD ^ 2, 1e6) }) }
  end },
}

-- Worlds without contact.
local UNTOUCHED = { air = true, river = true }

local function draw_scene(random, stiffest_ground)
  local world = chosen(random, WORLDS)
  local scene = world[2](random, stiffest_ground)
  if not UNTOUCHED[world[1]] and random:uniform() < 0.8 then
    scene.friction = { static = between(random, 0, 2), kinetic = between(random, 0, 2) }
  end
  if random:uniform() < 0.9 then
    local strength = between(random, 0, STRONGEST)
    local tilt, heading = between(random, 0, math.pi / 2), between(random, 0, 2 * math.pi)
    scene.gravity = { acceleration = directed(strength, tilt, heading) }
    scene.gravity.acceleration[3] = -scene.gravity.acceleration[3]
  end
  scene.damping = random:uniform() < 0.8
  if random:uniform() < 0.8 then
    scene.actuation = { frequency = between(random, 0.001, QUICKEST),
      ramp = random:uniform() < 0.5 and 0 or 0.25 }
  end
  return scene
end

-- Draws the settings that the cases of a batch share.
local function draw_batch(number)
  local random = random_of(number, 0)
  local lattice = chosen(random, LATTICES)
  local materials, stiffest_ground = draw_materials(random)
  local scene = draw_scene(random, stiffest_ground)
  local speed = between(random, 0, FASTEST)
  local tilt, heading = math.acos(between(random, -1, 1)), between(random, 0, 2 * math.pi)
  return { number = number, lattice = lattice, materials = materials, scene = scene, options = {
    integrator = chosen(random, { "symplectic_euler", "leapfrog" }),
    precision = chosen(random, engine.names.precision.names),
    sharing = chosen(random, engine.names.sharing.names), bound = "voxels",
    time_step = "auto", bound_fraction = 0.9, duration = DURATION, settle = 0, edge = EDGE,
    max_stretch = LONGEST, max_speed = WILDEST,
    position = { 0, 0, between(random, 0, 1) }, velocity = directed(speed, tilt, heading) } }
end

-- A population of cases `first` to `last` of a batch, 1 to 64.
local function population_of(batch, first, last)
  local population = engine.population { lattice = batch.lattice, count = last - first + 1 }
  local n = batch.lattice[1] * batch.lattice[2] * batch.lattice[3]
  for index = first, last do
    local random = random_of(batch.number, index)
    local holes = random:uniform() < 0.5 and 0 or between(random, 0, 0.6)
    local voxels, stiffness, amplitude, phase = {}, {}, {}, {}
    local any = random:integer(n)
    for i = 1, n do
      local empty = random:uniform() < holes and i ~= any
      local material = random:integer(batch.materials.count - 1)
      voxels[i] = empty and 0 or material
      stiffness[i], amplitude[i], phase[i] = random:uniform(), random:uniform(), random:uniform()
    end
    population:set_body(index - first + 1, voxels,
      { stiffness = stiffness, amplitude = amplitude, phase = phase })
  end
  population:check(batch.materials, { require_muscle = false })
  return population
end

local function simulate(batch, population, device, fraction)
  local options = source.copy(batch.options)
  options.bound_fraction = fraction or options.bound_fraction
  return engine.simulation(population, batch.materials, engine.scene(batch.scene), options, device)
end

-- The end of a case at a shorter step.
local function finer_end(batch, index, device)
  local again = simulate(batch, population_of(batch, index, index), device,
    batch.options.bound_fraction / FINER)
  again:run()
  local outcome = again:outcome(1)
  return outcome.status == "done" and "done"
    or ("%s at %.4g s"):format(outcome.reason, outcome.time)
end

-- Runs cases 1 to `count`; returns how many diverge because of the step.
local function search(t, count)
  local caused = 0
  for number = 0, math.ceil(count / BATCH) - 1 do
    local batch, robots = draw_batch(number), math.min(BATCH, count - number * BATCH)
    local simulation = simulate(batch, population_of(batch, 1, robots), t.device)
    simulation:run()
    for index = 1, robots do
      local outcome = simulation:outcome(index)
      if outcome.status == "diverged" then
        local finer = finer_end(batch, index, t.device)
        caused = caused + (finer == "done" and 1 or 0)
        t:note(("case %d: %s at step %d, %.4g s; at an eighth of the step: %s"):format(
          number * BATCH + index, outcome.reason, outcome.step, outcome.time, finer))
      else
        t:equal(outcome.status, "done")
      end
    end
    collectgarbage "collect"
  end
  return caused
end

for count, tags in pairs { [64] = {}, [10000] = { "full" } } do
  suite:test(("the step causes none of %d robots' divergence"):format(count),
    { devices = "all", tags = tags }, function(t) t:equal(search(t, count), 0) end)
end
