--- views.lua: the engine's arrays in Lua: shapes, bounds, lifetimes, copies.

local engine = require "limax.engine"
local fixture = require "support.binding.fixture"
local test = require "limax.test"

local MATERIALS, ALL = fixture.MATERIALS, fixture.ALL
local robots, simulated, raises_there = fixture.robots, fixture.simulated, fixture.raises_there

local views = test.suite "views"

views:test("read the engine's memory, x fastest", function(t)
  local population = robots(2)
  local voxels, weights = population:voxels(2), population:weights(2)
  local raw, raw_weights = voxels:pointer(), weights:pointer()
  for place = 0, 23 do
    local x, y, z = place % 3 + 1, math.floor(place / 3) % 2 + 1, math.floor(place / 6) + 1
    t:equal(voxels[x][y][z], raw[place])
    for w = 0, 2 do t:equal(weights[w + 1][x][y][z], tonumber(raw_weights[24 * w + place])) end
  end
  local _, strides = weights:pointer()
  t:equal(strides, { 24, 1, 3, 6 })
end)

views:test("refuse an index that is out of range, with the shape", function(t)
  local population = robots(1)
  local voxels, genome = population:voxels(1), population:genome(1)
  raises_there(t, "index 4 is out of range: this view of voxels is [3][2][4]",
    function() return voxels[4] end)
  raises_there(t, "index 0 is out of range: this view of voxels is [2][4]",
    function() return voxels[1][0] end)
  raises_there(t, "expected a whole number from 1 to 4", function() return voxels[1][1][5] end)
  for _, index in ipairs { 1.5, -1, 0 / 0 } do
    t:raises("is out of range", function() return genome[index] end)
  end
  raises_there(t, 'has no field "lenght"', function() return genome.lenght end)
  raises_there(t, "read-only", function() genome[1] = 2 end)
  raises_there(t, "read-only", function() voxels[1][1][1] = 2 end)
  raises_there(t, "an index from 1 to 3, got 4", function() voxels:size(4) end)
end)

views:test("of genomes and bodies can be written, checked", function(t)
  local population = robots(3)
  local genome, voxels, weights = population:genome_view(2), population:voxels_view(2),
    population:weights_view(2)
  t:equal({ genome.shape, voxels.shape, weights.shape, population:weights_view().shape },
    { { population.genes }, { 24 }, { 3, 24 }, { 3, 3, 24 } })
  t:equal(population:body(2).status, "unknown")
  genome[3], voxels[1 + 2 + 3 * (1 + 2 * 3)], weights[2][24] = -2.5, 4, 0.25
  t:equal({ population:genome(2)[3], population:voxels(2)[3][2][4],
    population:weights(2)[2][3][2][4] }, { -2.5, 4, 0.25 })
  local all = population:genome_view()
  all[3][1] = 7
  t:equal({ population:genome(3)[1], all[2][3] }, { 7, -2.5 })
  raises_there(t, "genome 2[1]: expected a number from -3.40282346639e+38 to 3.40282346639e+38",
    function() genome[1] = 0 / 0 end)
  raises_there(t, "genome 2[1]: expected a number", function() genome[1] = "1" end)
  raises_there(t, "index 0 is out of range: this view of genome 2 is", function() genome[0] = 1 end)
  raises_there(t, "voxels of robot 2[5]: expected a whole number from 0 to 15, got 1.5",
    function() voxels[5] = 1.5 end)
  raises_there(t, "index 25 is out of range: this view of voxels of robot 2 is [24]",
    function() voxels[25] = 1 end)
  raises_there(t, "weights of robot 2[3]: expected a number from 0 to 1, got 1.01",
    function() weights[1][3] = 1.01 end)
  t:raises("constant", function() voxels.count_ = 100 end)
  raises_there(t, "weights of robot 2: give an index for each of the axes [3][24]",
    function() weights[1] = 0 end)
end)

views:test("through which bodies are written end when the bodies are checked", function(t)
  local population = robots(2)
  local voxels = population:voxels_view(1)
  for v = 1, 24 do voxels[v] = v == 1 and 3 or v > 22 and 2 or 0 end
  t:raises("it must be expressed or checked before it is simulated",
    function() engine.simulation(population, MATERIALS, engine.scene(ALL), { duration = 0.05 }) end)
  population:check(MATERIALS, { largest_part = true })
  t:equal({ population:body(1).voxels, population:voxels(1)[1][1][1], population:body(1).status },
    { 2, 0, "valid" })
  raises_there(t, "this view of voxels of robot 1 ended when its population was checked",
    function() voxels[1] = 1 end)
end)

views:test("copies and tables outlive their population", function(t)
  local population = robots(1)
  local weights = population:weights(1)
  local copy, plain, part = weights:copy(), weights:table(), weights[2][3]:copy()
  t:same_bits(copy, weights)
  t:equal({ copy.shape, part.shape }, { { 3, 3, 2, 4 }, { 2, 4 } })
  population:free()
  collectgarbage "collect"
  t:same_bits(copy, plain)
  t:same_bits(part, plain[2][3])
end)

views:test("are invalid once their data are replaced; the error gives cause and line", function(t)
  local population = robots(2)
  local function ended(make, why, act)
    local view = make()
    local part = #view.shape > 2 and view[1] or nil
    act()
    local line = debug.getinfo(act, "S").linedefined
    local pattern = ("ended when %s (%s:%d)"):format(why, debug.getinfo(1, "S").short_src, line)
    t:raises(pattern, function() return part and part[1][1] or view[1] end)
    t:raises(pattern, function() return view:copy() end)
    t:raises(pattern, function() return view:table() end)
    t:raises(pattern, function() return view:pointer() end)
    t:equal(#view.shape > 0, true)
  end
  local function genome() return population:genome(1) end
  local function voxels() return population:voxels(1) end
  local parents, pairs_of_parents = robots(2, 7), { { 1, 2 }, { 2, 1 } }
  local breeding = {
    mutation_rate = 0.1, mutation_scale = 0.1, crossover_rate = 0.4,
    seed = 1, repetition = 1, generation = 1,
  }
  ended(genome, "its population was initialized", function() population:initialize() end)
  ended(genome, "its population was bred",
    function() population:breed(parents, pairs_of_parents, breeding) end)
  ended(genome, "its genomes were set",
    function() population:set_genomes(parents:genomes_bytes()) end)
  ended(voxels, "its population was expressed", function() population:express(MATERIALS) end)
  ended(voxels, "a body of its population was set",
    function() population:set_body(1, population:voxels(2)) end)
  local simulation = simulated { center_of_mass = 50 }
  ended(function() return simulation:trace(1, "center_of_mass") end, "its simulation was freed",
    function() simulation:free() end)
  ended(genome, "its population was freed", function() population:free() end)
end)

views:test("keep their owner alive", function(t)
  local expected = robots(1):genome(1):table()
  local genome, row = robots(1):genome(1), robots(1):weights(1)[2]
  local state = simulated({}):state(1)
  for _ = 1, 3 do collectgarbage "collect" end
  t:same_bits(genome, expected)
  t:ok(row[1][1][1] >= 0 and row[3][2][4] <= 1)
  t:ok(state[1][3] > -1)
end)

views:test("of traces have rate, unit and samples", function(t)
  local simulation = simulated { center_of_mass = 50, position = 20, contact = 20, energy = 20,
    strain = 20 }
  local masses = simulation:outcome(1).masses
  local center = simulation:trace(1, "center_of_mass")
  t:equal({ center.rate, center.unit, center.samples, center:size(1), center:size(2) },
    { 50, "m", 11, 11, 3 })
  t:equal(simulation:trace(1, "position").shape, { 5, masses, 3 })
  t:equal(simulation:trace(1, "strain").shape, { 5, 2 })
  t:equal(center:copy().rate, 50)
  t:equal(center[1].rate, nil)
  t:equal(simulation:sites(1):size(), masses)
  local positions, velocities = simulation:state(1)
  t:equal({ positions.shape, velocities.shape, velocities.unit },
    { { masses, 3 }, { masses, 3 }, "m/s" })
  t:same_bits(positions, simulation:trace(1, "position")[5])
  t:raises("add record = { velocity = 50 }", function() simulation:trace(1, "velocity") end)
  t:raises('expected one of "center_of_mass"', function() simulation:trace(1, "centre") end)
end)
