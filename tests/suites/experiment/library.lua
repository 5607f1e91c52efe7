--- library.lua: fitness functions on outcomes made by hand, scenes, and diversity by name. The
--- engine's tests compare diversity with its definition.

local limax = require "limax"
local rows = require "limax.robot.rows"
local scored_robot = require "limax.robot.scored_robot"
local engine = limax.engine

local fitness = require("limax.test").suite "fitness"

-- A robot that came from (0, 0) over (1, 2) to (4, 6) in 5 s: 2 kg, three voxels of 0.1 m long.
local function walker(changes)
  local one = rows.new({ letters = 8 }, 1)
  local each = one.data[0]
  for name in ([[path_length height contact kinetic elastic muscle_work strain strain_most
      ]]):gmatch "%S+" do each.outcome[name] = 0 / 0 end
  local outcome = { status = 2, time = 5, center_start = { 0, 0, 0.3 },
    center_middle = { 1, 2, 0.4 }, center_end = { 4, 6, 0.5 } }
  for key, value in pairs(changes or {}) do outcome[key] = value end
  for key, value in pairs(outcome) do each.outcome[key] = value end
  each.body = { status = 1, voxels = 6, size = { 2, 3, 1 } }
  each.id, each.mass = 1, 2
  rows.set_status(one, 1)
  return scored_robot.new(one[1], { options = { edge = 0.1, record = {} } })
end

local WORK = { kinetic = 1, elastic = 1, muscle_work = 40 }
local TREMBLING = { path_length = 0.05, center_end = { 0.04, 0, 0.3 } }

-- fitness, changes of the outcome, score
local SCORES = {
  { "walk", {}, 10 },
  { { "walk", axis = "x" }, {}, 6 },
  { { "walk", axis = "y" }, { center_end = { 4, 1, 0.5 } }, -2 },
  { "distance", {}, math.sqrt(52) },
  { { "distance", axis = "y" }, {}, 6 },
  { "speed", {}, math.sqrt(52) / 5 },
  { { "speed", axis = "x" }, {}, 0.8 },
  -- three voxels of 0.1 m are one body length
  { { "speed", axis = "x", body_lengths = true }, {}, 0.8 / 0.3 },
  { "height", { height = 0.7 }, 0.7 },
  { { "efficiency", idle_power = 0 }, WORK, 2 * 9.81 * math.sqrt(52) / 40 },
  -- 0.1 W/kg for 2 kg and 5 s is one joule more
  { "efficiency", WORK, 2 * 9.81 * math.sqrt(52) / 41 },
  { { "efficiency", idle_power = 0 },
    { kinetic = 0, elastic = 0, muscle_work = 0, center_end = { 0, 0, 0.3 } }, 0 },
  { "straightness", { path_length = 10 }, math.sqrt(52) / 10 },
  { "straightness", TREMBLING, 0 },
  { { "straightness", least_path = 0.01 }, TREMBLING, 0.8 },
  { { "straightness", least_path = 0 }, { path_length = 0 }, 0 },
}

fitness:test("each has its formula", function(t)
  for _, case in ipairs(SCORES) do
    local spec, changes, expected = unpack(case)
    t:near(limax.fitness.get(spec).call(walker(changes)), expected)
  end
end)

fitness:test("a measure of what was not recorded names the entry to add", function(t)
  local robot = walker()
  robot.context.options.record = { energy = 100 }
  t:raises("record = { center_of_mass = 50, energy = 100 }", function() robot:height() end)
  t:raises("record = { position = 50, energy = 100 }", function() robot:trace "position" end)
  local message = t:raises("was not recorded", function() robot:trace "contact" end)
  t:ok(message:match "^[^\n]*library.lua:%d+: ", message)
  t:raises('did you mean "energy"?', function() robot:trace "enrgy" end)
  t:raises("robot 1: its trace", function() robot:trace "energy" end)
end)

local scenes = require("limax.test").suite "scenes"

scenes:test("a slope is tilted gravity", function(t)
  local slope = limax.scenes.slope { angle = math.pi / 6, friction = { static = 0.5 } }
  t:near(slope.gravity.acceleration, { 4.905, 0, -9.81 * math.sqrt(3) / 2 })
  t:equal(slope.friction, { static = 0.5 })
  local turned = limax.scenes.slope { angle = math.pi / 6, direction = math.pi / 2, gravity = 2 }
  t:near(turned.gravity.acceleration, { 0, 1, -math.sqrt(3) }, { atol = 1e-12 })
  t:raises("math.rad(20)", function() limax.scenes.slope { angle = 20 } end)
  t:raises("scenes.slope.angle", function() limax.scenes.slope {} end)
end)

scenes:test("stairs, a corner, and rough land that follows its seed", function(t)
  local stairs = limax.scenes.stairs { step = 0.1, depth = 0.5, count = 3, start = 2 }
  t:equal(#stairs.boxes, 3)
  t:equal(stairs.boxes[3], { from = { 3, -2, 0 }, to = { 3.5, 2, 0.1 * 3 } })
  local one, same = limax.scenes.rough { size = 2 }, limax.scenes.rough { size = 2 }
  local other = limax.scenes.rough { size = 2, seed = 2 }
  t:equal(one, same)
  t:ok(one.terrain.heights[1][1] ~= other.terrain.heights[1][1], "another seed, another land")
  t:equal(#one.terrain.heights, 11)
  t:near(one.terrain.origin[1], -1)
  for _, row in ipairs(one.terrain.heights) do
    for _, height in ipairs(row) do t:ok(height <= 0 and height >= -0.05) end
  end
  t:raises("2 to 512 are possible", function() limax.scenes.rough { size = 1000 } end)
end)

local diversity = require("limax.test").suite "diversity"

local MATERIALS = engine.materials "paper"

diversity:test("the better half is rounded up, and order changes no bit", function(t)
  local population = engine.population { lattice = { 1, 1, 1 }, count = 5 }
  for i, letter in ipairs { "e", "c", "s", "e", "b" } do
    population:set_body(i, { letter }, nil, MATERIALS)
  end
  population:check(MATERIALS)
  local values = limax.diversity.measure(population, { 1, 4, 2, 5, 3 }, MATERIALS)
  t:equal({ values.top.robots, values.top.distinct }, { 3, 2 })
  local other = limax.diversity.measure(population, { 4, 2, 1, 3, 5 }, MATERIALS)
  t:same_bits(other.all, values.all)
  t:same_bits(other.top, values.top)
  t:equal(limax.diversity.measure(population, {}, MATERIALS), {})
end)
