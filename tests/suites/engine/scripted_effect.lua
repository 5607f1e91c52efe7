--- scripted_effect.lua: effects that a script defines by a text: closed forms, every word of the
--- language, the same bits however the work is divided, and errors with their line.

local bodies = require "limax.tools.bench.bodies"
local limax = require "limax"
local engine = require "limax.engine"
local evolution = require "support.evolution"
local host = require "limax.host"
local process = require "support.process"

local suite = require("limax.test").suite "scripted effects"

-- A body in the air in this scene.
local function flown(scene, options)
  return limax.robot { voxels = "ecs\nece\n\nsbs\ncec" }:simulate(evolution.with({ scene = scene,
    device = "cpu", settle = 0, duration = 1, precision = "double", time_step = 1e-3 }, options))
end

suite:test("a weight as a text equals gravity", function(t)
  local own = flown { weight = { force = "f = m * g;", g = { 0.5, 0, -9.81 } } }
  local built_in = flown { gravity = { acceleration = { 0.5, 0, -9.81 } } }
  -- of sums of 1000 steps in double
  t:near(own:displacement(), built_in:displacement(), { rtol = 1e-12, atol = 1e-15 })
end)

suite:test("a linear pull is a harmonic oscillation about its centre", function(t)
  local scene = { damping = true,
    pull = { force = "f = -k * m * (x - centre);", k = 40, centre = { 0.1, -0.2, 3 } } }
  for _, integrator in ipairs { "leapfrog", "rk4" } do
    local trace = flown(scene, { integrator = integrator, record = { center_of_mass = 20 } })
      :trace "center_of_mass"
    local start = trace[1]
    for i = 1, trace:size() do
      local share = math.cos(math.sqrt(40) * (i - 1) / 20)
      for axis = 1, 3 do
        local centre = scene.pull.centre[axis]
        -- m: leapfrog's phase is late by (w dt)^2 / 24 of 6.3 rad, 1e-5 of a swing of 3 m
        t:near(trace[i][axis], centre + (start[axis] - centre) * share, { atol = 1e-4 })
      end
    end
  end
end)

suite:test("a text reads velocity, mass and time", function(t)
  -- dv/dt = -c v from 2 m/s
  local slowed = flown({ brake = { force = "f = -c * m * v;", c = 3 } }, { velocity = { 2, 0, 0 } })
  t:near(slowed:displacement()[1], 2 / 3 * (1 - math.exp(-3)), { rtol = 1e-5 })
  -- a = sin(w t) from rest at t = 0
  local shaken = flown { shake = { force = "f = vec(0, m * sin(w * t), 0);", w = 7 } }
  t:near(shaken:displacement()[2], (7 - math.sin(7)) / 49, { rtol = 1e-5 })
  -- t < 0 while a body settles; leapfrog applies a force that sets in half a step too long
  local late = flown({ push = { force = "f.z = t < 0 ? 0 : m;" } }, { settle = 0.5 })
  t:near(late:displacement()[3], 0.5005, { rtol = 1e-9 })
  -- the force of every step at the current position, in fp32 too
  local far = flown({ push = { force = "f.x = x.z > 500 ? m : 0;" } },
    { position = { 0, 0, 1000 }, precision = "compensated" })
  t:near(far:displacement()[1], 0.5, { rtol = 1e-4 })
end)

-- The value of each text with a = 3, b = -0.5, u = { 1, 2, 3 }, w = { -2, 0.5, 1 }.
local MEANINGS = {
  { "a + b * 2 - -1", 3 }, { "(a + b) * 2", 5 }, { "a / b / 2", -3 },
  { "sqrt(a)", math.sqrt(3) }, { "sin(a)", math.sin(3) }, { "cos(b)", math.cos(-0.5) },
  { "exp(b)", math.exp(-0.5) }, { "abs(b)", 0.5 }, { "min(a, b)", -0.5 }, { "max(a, b)", 3 },
  { "a < b", 0 }, { "a > b", 1 }, { "a <= 3", 1 }, { "a >= 3.5", 0 }, { "a == 3", 1 },
  { "a != 3", 0 }, { "a > 1 && b > 1", 0 }, { "a > 1 || b > 1", 1 }, { "!a", 0 }, { "!0", 1 },
  { "a > 1 ? b : 7", -0.5 }, { "a < 1 ? 1 : b < 0 ? 2 : 4", 2 }, { "dot(u, w)", 2 },
  { "cross(u, w).x", 0.5 }, { "cross(u, w).y", -7 }, { "cross(u, w).z", 4.5 },
  { "length(u)", math.sqrt(14) }, { "(2 * u - w / 2).x", 3 }, { "(-u * 2).z", -6 },
  { "(a > 1 ? u : w).y", 2 }, { "vec(1, a, 2).y", 3 }, { "1e-1 + .5", 0.6 },
}

suite:test("every word of the language means what it does in C", function(t)
  for _, case in ipairs(MEANINGS) do
    local text, expected = unpack(case)
    -- a constant acceleration for 1 s
    local force = "real r = 1; // unused\nr = " .. text .. ";\nf.x += m * r;\n"
    local own = { force = force }
    for name, value in pairs { a = 3, b = -0.5, u = { 1, 2, 3 }, w = { -2, 0.5, 1 } } do
      own[name] = text:find("%f[%w]" .. name .. "%f[%W]") and value or nil
    end
    local moved = flown { own = own }:displacement()
    t:near(moved[1], expected / 2, { rtol = 1e-9, atol = 1e-12 })
  end
end)

-- ---- bits ---------------------------------------------------------------------------------------

local MAGNET = { force = [[
  vec d = centre - x;
  f = strength * d / (dot(d, d) + 1e-2);
]], centre = { 0, 0.3, 0.2 }, strength = 0.2, bound = { stiffness = 20 } }

suite:test("the same bits with any instruction set, threads, slices and order", function(t)
  local function ended(isa, threads, slice, precision)
    local scene = limax.scenes.land { magnet = MAGNET,
      breeze = { force = "f = c * (air - v);", air = { 1, 0, 0 }, c = 0.01,
        bound = { damping = 0.01 } } }
    local device = engine.device("cpu", { isa = isa, threads = threads })
    local materials = engine.materials "paper"
    -- more masses than one block of the pass
    local simulation = engine.simulation(bodies.population(materials, { 5, 5, 5 }, 3), materials,
      engine.scene(scene), { duration = 0.1, precision = precision }, device)
    while not simulation:advance(1, slice).finished do end
    local states = {}
    for i = 1, 3 do states[i] = simulation:state(i):table() end
    return states
  end
  for _, precision in ipairs { "compensated", "double" } do
    local expected = ended(nil, 1, 100000, precision)
    t:same_bits(ended(nil, 3, 7, precision), expected)
    t:same_bits(ended("baseline", 2, 100000, precision), expected)
  end
end)

-- ---- the time step ------------------------------------------------------------------------------

suite:test("the automatic step uses a bound, and without one it is refused", function(t)
  local function bound_with(bound)
    local robot = flown({ damping = true, pull = { force = "f = -1 * x;", bound = bound } },
      { time_step = "auto", duration = 0.1 })
    return robot.record.outcome.time_step_bound
  end
  local loose = bound_with {}
  t:ok(bound_with { stiffness = 1e7 } < 0.5 * loose)
  t:ok(bound_with { damping = 1e3 } < 0.5 * loose)
  t:raises("scene.pull states no bound", function() bound_with(nil) end)
  t:raises("scene.pull.bound.stiffness is %-1", function() bound_with { stiffness = -1 } end)
  t:raises("scene: pull.bound.stifness: unknown field", function() bound_with { stifness = 1 } end)
end)

-- ---- refusals -----------------------------------------------------------------------------------

local REFUSED = {
  { "f = strngth * x;", "line 1: unknown name 'strngth'" }, { "f = system(1);", "'system'" },
  { "f = vec(1, 2)\n\n;", "line 1: vec takes 3 values, not 2" },
  { "\nf.x = sin(x)\n;", "line 2: sin takes numbers" }, { "f = x;\nf = -\n\nq;", "line 4: " },
  { "#include <stdio.h>\nf = x;", "'#' is not a character" },
  { "f = x;\nf = v;", "line 2: 'f' is set again before its value is read" },
  { "f.x = m;\n\nf = v;", "line 3: 'f' is set again" }, { "f = v; f = x + f; f.y = 0;", nil },
  { "f = x;\nf += v; f.x = 1; f.z += 1;", nil }, { "f = x + f;", "'f' is read before it is set" },
  { "x = f;", "'x' is an input" }, { "f = 1;", "'f' is a vector" }, { "", "never sets the force" },
  { "real a = 1; real a = 2; f = x;", "the name 'a' is taken" }, { "f = x * v;", "dot and cross" },
  { "f = x + 1;", "added" }, { "f = x", nil }, { "f = x\n.w;", "line 2: a vector has x, y and z" },
  { "f = m.x;", "no components" }, { "f = x * 1..2;", "expected ';'" },
  { "f = \195\164;", "byte 195" },
  { "f = " .. ("("):rep(1000) .. "x" .. (")"):rep(1000) .. ";", "levels" },
  { "f = x" .. (" + x"):rep(1000) .. ";", "more than 2000" },
  { "f = x;" .. (" "):rep(70000), "bytes long" },
}

suite:test("other text is refused, with its line", function(t)
  for _, case in ipairs(REFUSED) do
    local ok, message = pcall(engine.scene, { own = { force = case[1] } })
    t:ok(ok == (case[2] == nil), case[1]:sub(1, 60))
    if case[2] then t:ok(tostring(message):find(case[2], 1, true), tostring(message)) end
  end
end)

suite:test("an experiment's error names the line in its file, with either line ending",
  function(t)
    local text = [==[
local limax = require "limax"
return limax.experiment { fitness = "walk", scene = { own = { force = [[
  vec towards = centre - x;
  f = strength * toward;
]], centre = { 0, 0, 1 }, strength = 1 } } }
]==]
    for _, ending in ipairs { "\n", "\r\n" } do
      local folder = t:folder()
      process.write(folder .. "/mine.lua", (text:gsub("\n", ending)))
      process.fails(t, folder, 2, { "run", "mine.lua" }, "(mine.lua:4)")
    end
  end)

suite:test("parameters and names are checked", function(t)
  local function refused(pattern, scene)
    t:raises(pattern, function() engine.scene(scene) end)
  end
  refused("scene: own.a: expected a number, got nan", { own = { force = "f = a * x;", a = 0 / 0 } })
  refused("no parameter can be called 't'", { own = { force = "f = t * x;", t = 1 } })
  refused("own.gain: unknown field.*the force names no such",
    { own = { force = "f = x;", gain = 3 } })
  refused("expected effects named by letters", { ["a b"] = { force = "f = x;" } })
  refused("own.force: expected a text", { own = { force = 3 } })
  refused("own: unknown field.*a force of your own has a text, force =",
    { own = { strength = 1 } })
  local many = {}
  for i = 1, 9 do many["own" .. i] = { force = "f = x;" } end
  refused("at most 8 scripted effects", many)
end)

-- ---- experiments --------------------------------------------------------------------------------

suite:test("an experiment stores it, and its parameters can be overridden", function(t)
  local experiment = evolution.small { scene = limax.scenes.land { magnet = MAGNET } }
  local magnet = experiment:override({ "scene.magnet.strength=0.5" }).config.scene.magnet
  t:equal({ magnet.strength, magnet.force, magnet.centre }, { 0.5, MAGNET.force, MAGNET.centre })
  local again = engine.scene(host.json.decode(host.json.encode(experiment.config.scene)))
  t:equal(again:table(), experiment.config.scene)
  t:raises("record.ledger: .* 'magnet'", function()
    flown({ magnet = MAGNET }, { record = { ledger = 10 } })
  end)
end)
