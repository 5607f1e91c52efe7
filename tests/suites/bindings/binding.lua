--- binding.lua: the engine's objects as Lua sees them: misuse raises at the caller's line, freed
--- objects, and memory that the garbage collector cannot see.

local engine = require "limax.engine"
local fixture = require "support.binding.fixture"
local limax = require "limax"
local test = require "limax.test"

local MATERIALS, LATTICE, ALL = fixture.MATERIALS, fixture.LATTICE, fixture.ALL
local robots, simulated, raises_there = fixture.robots, fixture.simulated, fixture.raises_there

local misuse = test.suite "misuse"

misuse:test("raises at the caller's line, with the expected value", function(t)
  local p, scene = robots(2), engine.scene(ALL)
  local function there(pattern, call) raises_there(t, pattern, call) end
  there("population.lattice[2]: expected a whole number",
    function() engine.population { lattice = { 1, "x", 1 }, count = 1 } end)
  there('population.conut: unknown field; did you mean "count"?',
    function() engine.population { lattice = { 1, 1, 1 }, conut = 1 } end)
  there("population:genome: expected an index from 1 to 2, got 3", function() p:genome(3) end)
  there("expected a material table, got a device", function() p:express(engine.device "cpu") end)
  there("expected a pair for each of 2 children", function() p:breed(p, { { 1, 1 } }, {}) end)
  there("expected 19008 bytes (2 robots of 2376 genes)", function() p:set_genomes "abc" end)
  there("bytes (2 robots of 2376 genes), or as many floats as from genomes_array, got 9504",
    function() p:set_genomes(robots(1):genomes_array()) end)
  -- methods called with a point instead of a colon
  for name, call in pairs {
    ["population:genomes_bytes"] = function() p.genomes_bytes(3) end,
    ["view:copy"] = function() p:genome(1).copy(3) end,
    ["robot:edit"] = function() limax.robot({ voxels = "e" }).edit { 1, 1, 1 } end,
  } do there(name .. " is called with a colon, not with a dot", call) end
  there("population:genomes_bytes: expected a population, got a scene",
    function() p.genomes_bytes(scene) end)
end)

misuse:test("of scenes, masks and random numbers too", function(t)
  local p, scene = robots(1), engine.scene(ALL)
  local function there(pattern, call) raises_there(t, pattern, call) end
  for pattern, heights in pairs { ["[2]: expected a list of 2 numbers"] = { { 0, 0 }, { 0 } },
    ["heights: expected a list of rows, each a list of numbers"] = { 1, 2 } } do
    there(pattern, function() engine.scene { terrain = { heights = heights } } end)
  end
  there("expected a list of 1, true or false",
    function() engine.simulation(p, MATERIALS, scene, {}, nil, { true, true }) end)
  local random = engine.random(1, 1, "user")
  for _, wrong in ipairs { { 0 }, { 1.5 }, { 0 / 0 }, { "3" }, { 5, 4 }, { 1, 2 ^ 32 } } do
    there("random:integer: expected a whole number from 1 to 2^32 - 1, or two of them",
      function() random:integer(unpack(wrong)) end)
  end
end)

misuse:test("of fields, by which memory is read, is refused", function(t)
  local p, scene = robots(2), engine.scene(ALL)
  local function there(pattern, call) raises_there(t, pattern, call) end
  for _, name in ipairs { "count", "genes", "lattice", "handle", "own" } do
    there(name .. ": the fields of a population are read-only", function() p[name] = 1e8 end)
  end
  there("count: the fields of a material table", function() MATERIALS.count = 9 end)
  there("own: the fields of a scene are read-only", function() scene.own = true end)
  p.lattice[1] = 1e8
  t:equal(p:voxels(1).shape, LATTICE)
end)

misuse:test("of a body changes nothing", function(t)
  local p = robots(1)
  local before, weights = p:voxels(1):table(), p:weights(1):table()
  local voxels = {}
  for i = 1, 24 do voxels[i] = 1 end
  local function there(pattern, call) raises_there(t, pattern, call) end
  there("voxels[1]: expected a material index from 0 to 15",
    function() p:set_body(1, { 16, unpack(voxels, 1, 23) }) end)
  there("letters need the material table",
    function() p:set_body(1, { "e", unpack(voxels, 1, 23) }) end)
  there('a material of materials "paper" (5), got "x"',
    function() p:set_body(1, { "x", unpack(voxels, 1, 23) }, nil, MATERIALS) end)
  there("weights.phase[1]: expected a number from 0 to 1, got 2",
    function() p:set_body(1, voxels, { phase = 2 }) end)
  t:equal(p:voxels(1), before)
  t:equal(p:weights(1), weights)
end)

local lifetimes = test.suite "lifetimes"

lifetimes:test("using a freed object raises with the line of free", function(t)
  local encoding = engine.encoding { lattice = LATTICE }
  local population = engine.population { count = 1, encoding = encoding }
  local scene, materials, device = engine.scene(ALL), MATERIALS:copy(), engine.device "cpu"
  for _, object in ipairs { encoding, population, scene, materials, device } do
    object:free()
    object:free()
    t:ok(tostring(object):find "^freed ", tostring(object))
  end
  local here = debug.getinfo(1, "S").short_src
  raises_there(t, "this population was freed (" .. here, function() population:initialize() end)
  raises_there(t, "this population was freed (" .. here, function() population:genome(1) end)
  raises_there(t, "this material table was freed", function() materials:get(1) end)
  raises_there(t, "this scene was freed", function() scene:table() end)
  raises_there(t, "this device was freed", function() device:describe() end)
  raises_there(t, "this encoding was freed",
    function() engine.population { count = 1, encoding = encoding } end)
end)

lifetimes:test("objects can be freed in any order", function(t)
  local expected =
    simulated({ center_of_mass = 50 }, engine.device "cpu"):trace(1, "center_of_mass"):table()
  for _, order in ipairs { "12345", "54321", "24135", "31524", "45312" } do
    local encoding = engine.encoding { lattice = LATTICE }
    local population = engine.population { count = 1, encoding = encoding }
    local materials, scene, device = MATERIALS:copy(), engine.scene(ALL),
      engine.device("cpu", { threads = 1 })
    local voxels = {}
    for i = 1, 24 do voxels[i] = "e" end
    population:set_body(1, voxels, nil, materials)
    population:check(materials)
    local simulation = engine.simulation(population, materials, scene,
      { duration = 0.2, record = { center_of_mass = 50 } }, device)
    local objects = { encoding, population, materials, scene, device }
    for k in order:gmatch "%d" do
      simulation:advance(10, 40)
      objects[tonumber(k)]:free()
    end
    simulation:run()
    t:same_bits(simulation:trace(1, "center_of_mass"), expected)
    simulation:free()
  end
end)

local pressure = test.suite "memory"

pressure:test("stays bounded when thousands of objects are dropped", function(t)
  collectgarbage "collect"
  local before, most = engine.bytes_held(), 0
  -- an unused population holds no memory yet
  local function touched()
    local population = engine.population { lattice = { 10, 10, 10 }, count = 100 }
    population:voxels(1)
    return population
  end
  local one = touched()
  local each = engine.bytes_held() - before
  t:ok(each > 1e6, "a population of 100 holds its voxels and weights")
  for i = 1, 3000 do
    one = touched()
    most = math.max(most, engine.bytes_held())
    if i % 3 == 0 then engine.scene(ALL) end
  end
  t:ok(one.count == 100)
  t:note(("3000 dropped populations of %.1f MB: at most %.0f MB held"):format(each / 1e6,
    most / 1e6))
  t:ok(most - before < 200e6, ("%.0f MB were held"):format(most / 1e6))
  one:free()
  -- the first collection drops views, the second what they owned
  collectgarbage "collect"
  collectgarbage "collect"
  t:ok(engine.bytes_held() <= before + 1e6)
end)
