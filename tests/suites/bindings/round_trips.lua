--- round_trips.lua: values written to objects of the engine are read back unchanged; slices, masks
--- and limits of simulations.

local ffi = require "ffi"
local engine = require "limax.engine"
local fixture = require "support.binding.fixture"
local test = require "limax.test"

local MATERIALS, LATTICE, ALL = fixture.MATERIALS, fixture.LATTICE, fixture.ALL
local robots = fixture.robots

local trips = test.suite "round trips"

trips:test("materials", function(t)
  local plain = MATERIALS:table()
  local again = engine.materials(plain)
  t:same_bits(again:table(), plain)
  t:equal({ again.name, again.count, again:index "c", again:index "bone" },
    { MATERIALS.name, MATERIALS.count, MATERIALS:index "c", MATERIALS:index "bone" })
  t:equal(again:index "no such material", nil)
  for i = 1, again.count do t:same_bits(again:get(i), MATERIALS:get(i)) end
  local copy = again:copy()
  copy:set(2, "stiffness", 12345)
  t:equal({ copy:get(2).stiffness, again:get(2).stiffness }, { 12345, MATERIALS:get(2).stiffness })
  t:same_bits(engine.materials(copy:table()):get(2), copy:get(2))
end)

trips:test("genomes", function(t)
  local from, to = robots(3), robots(3, 2)
  local bytes = from:genomes_bytes()
  t:equal(#bytes, 3 * from.genes * 4)
  to:set_genomes(bytes)
  t:equal(to:genomes_bytes() == bytes, true)
  t:same_bits(to:genome(3), from:genome(3))
  t:equal(ffi.cast("const float *", bytes)[from.genes], from:genome(2)[1])
  local all = from:genomes_array()
  t:equal(all.shape, { 3, from.genes })
  for i = 1, 3 do t:same_bits(all[i], from:genome(i)) end
end)

trips:test("bodies", function(t)
  local from = robots(4)
  local to = engine.population { lattice = LATTICE, count = 4 }
  for i = 1, 4 do
    to:set_body(i, from:voxels(i), from:weights(i))
    t:same_bits(to:voxels(i), from:voxels(i))
    t:same_bits(to:weights(i), from:weights(i))
    to:set_body(i, from:voxels(i):table(), {
      stiffness = from:weights(i)[1]:table(), amplitude = from:weights(i)[2], phase = 0.5,
    })
    t:same_bits(to:weights(i)[1], from:weights(i)[1])
    t:equal(to:weights(i)[3][3][2][4], 0.5)
    t:equal(to:body(i).status, "unknown")
  end
  to:check(MATERIALS)
  for i = 1, 4 do t:equal(to:body(i), from:body(i)) end
end)

trips:test("scenes", function(t)
  local plain = engine.scene { gravity = { acceleration = { 1, 2, -3 } }, ground = true,
    friction = { kinetic = 0.25 } }:table()
  t:equal(plain.gravity, { acceleration = { 1, 2, -3 } })
  t:equal(plain.friction, { static = 1, kinetic = 0.25 })
  t:equal(engine.scene(plain):table(), plain)
  t:equal(engine.scene({}):table(), {})
  t:equal(engine.scene({ gravity = false, springs = true }):table(), {})
end)

trips:test("seeds as numbers, digits and 64-bit integers", function(t)
  local function first(seed) return engine.random(seed, 1, "user"):uniform() end
  t:same_bits(first "12345", first(12345))
  t:same_bits(first "00012345", first(12345))
  t:same_bits(first(12345ULL), first(12345))
  t:same_bits(first "18446744073709551615", first(0xffffffffffffffffULL))
  t:ok(first "9007199254740993" ~= first "9007199254740992")
end)

local objects = test.suite "simulation objects"

objects:test("slices, outcomes and masks", { threads = { 1, 2 } }, function(t)
  local population = robots(4)
  local options = { duration = 0.2, settle = 0.1, record = { center_of_mass = 20 } }
  local whole = engine.simulation(population, MATERIALS, engine.scene(ALL), options, t.device)
  local calls = 0
  local progress = whole:run(function(now)
    calls = calls + 1
    t:ok(now.done <= now.robots and now.steps <= now.steps_total)
  end)
  t:ok(calls >= 1 and progress.finished and not progress.interrupted)
  t:equal({ progress.done, progress.robots, progress.steps }, { 4, 4, progress.steps_total })
  local part = engine.simulation(population, MATERIALS, engine.scene(ALL), options, t.device,
    { true, false, true, false })
  repeat until part:advance(1, 7).finished
  for i = 1, 4 do
    if i % 2 == 1 then
      t:same_bits(part:outcome(i), whole:outcome(i))
      t:same_bits(part:trace(i, "center_of_mass"), whole:trace(i, "center_of_mass"))
    else
      t:equal(part:outcome(i).status, "skipped")
      t:equal(part:trace(i, "center_of_mass"):size(), 0)
    end
  end
  local outcome = whole:outcome(1)
  t:equal({ outcome.status, outcome.reason, outcome.strain }, { "done", nil, nil })
  t:near(outcome.time, 0.2)
  t:ok(outcome.path_length >= 0 and outcome.time_step <= outcome.time_step_bound)
end)
