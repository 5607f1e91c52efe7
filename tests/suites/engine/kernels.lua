--- kernels.lua: the origin of a GPU's kernel and the state of its cache do not change results, and
--- problems are reported once; bad input gives the same errors on every device. Damaged caches and
--- LIMAX_KERNELS are tested in tests/engine/backend/cuda.

local bodies = require "limax.tools.bench.bodies"
local engine = require "limax.engine"
local host = require "limax.host"
local process = require "support.process"

local suite = require("limax.test").suite "kernels"

-- ---- origin of a kernel -------------------------------------------------------------------------

-- Simulates bodies and prints a hash of the results. Two kernels: one steps, the other measures
-- energies.
local PROGRAM = [[
local bodies = require "limax.tools.bench.bodies"
local engine = require "limax.engine"
local host = require "limax.host"
local materials = engine.materials "paper"
local device = engine.device "cuda"
local lattice = {}
for voxels in (os.getenv "LATTICE" or "5 5 5"):gmatch "%d+" do
  lattice[#lattice + 1] = tonumber(voxels)
end
local population = bodies.population(materials, lattice, 12, { hollow = true })
local scene = {}
for name in (os.getenv "EFFECTS" or ""):gmatch "%a+" do scene[name] = true end
local simulation = engine.simulation(population, materials,
  engine.scene(next(scene) and scene or bodies.ALL), {
  time_step = 1e-4, duration = 0.1, settle = 0.02, record = { center_of_mass = 50, energy = 50 } },
  device)
simulation:run()
local parts = {}
for robot = 1, population.count do
  local positions, velocities = simulation:state(robot)
  parts[#parts + 1] = host.json.encode { positions:table(), velocities:table(),
    simulation:trace(robot, "energy"):table(), simulation:outcome(robot) }
end
local how = simulation:describe()
print(host.json.encode { hash = host.sha256(table.concat(parts, "\n")), origin = how.origin,
  effects = how.effects, made_for = how.made_for, form = how.form,
  gpus = #device:describe().gpus })
]]

-- Runs it with environment variables; its output, decoded, and its warnings.
local function simulate(t, folder, environment)
  assert(host.file.write_atomic(folder .. "/program.lua", PROGRAM))
  local done = process.completes(t, folder, { "program.lua" }, { before = environment })
  -- a slow compilation is announced
  return assert(host.json.decode(done.stdout, "the program")),
    (done.stderr:gsub("limax: compiled the kernel [^\n]*\n", ""))
end

local function cache_in(folder) return "XDG_CACHE_HOME=" .. process.quote(folder) end

-- Skips a test if kernels cannot be compiled.
local function need_compiler(t)
  local nvrtc = t.device:describe().nvrtc
  if not nvrtc:match "^%d" then t:skip(nvrtc) end
end

suite:test("a kernel built ahead of time, compiled or cached gives the same bits",
  { devices = { "cuda" } }, function(t)
    need_compiler(t)
    local folder = t:folder()
    local compiled, warnings =
      simulate(t, folder, cache_in(folder) .. " LIMAX_KERNELS=cached,compiled")
    t:equal({ compiled.origin, warnings }, { "compiled", "" })
    local cached
    cached, warnings = simulate(t, folder, cache_in(folder) .. " LIMAX_KERNELS=cached")
    t:equal({ cached.origin, warnings }, { "cached", "" })
    local usual = simulate(t, folder, cache_in(folder))
    t:equal({ cached.hash, usual.hash }, { compiled.hash, compiled.hash })
    t:note("without LIMAX_KERNELS: " .. usual.origin)
    -- with an empty cache
    local wiped = simulate(t, t:folder(), cache_in(t:folder()) .. " LIMAX_KERNELS=cached,compiled")
    t:equal(wiped, compiled)
  end)

suite:test("without a compiler a kernel for more effects, or any lattice, gives the same bits",
  { devices = { "cuda" } }, function(t)
    need_compiler(t)
    local folder = t:folder()
    for words, made_for in pairs { ["EFFECTS=gravity"] = true, ["EFFECTS=gravity,ground"] = true,
      ["EFFECTS=damping,actuation"] = true, ["LATTICE='3 2 4'"] = false,
      ["LATTICE='4 7 3'"] = false, ["LATTICE='10 10 10'"] = false,
      ["LATTICE='20 6 9'"] = false } do
      local environment = ("%s %s LIMAX_KERNELS="):format(cache_in(folder), words)
      local compiled = simulate(t, folder, environment .. "compiled")
      local served = simulate(t, folder, environment .. "ahead-of-time")
      t:equal({ compiled.origin, served.origin }, { "compiled", "ahead of time" })
      t:equal({ compiled.made_for, served.made_for ~= nil }, { nil, made_for })
      t:ok(made_for or compiled.form == "one robot" and served.form == "any lattice", served.form)
      t:equal(served.hash, compiled.hash)
    end
  end)

suite:test("one GPU gives the same bits as all", { devices = { "cuda" } }, function(t)
  local folder = t:folder()
  local one = simulate(t, folder, cache_in(folder) .. " CUDA_VISIBLE_DEVICES=0")
  local all = simulate(t, folder, cache_in(folder))
  t:equal(one.gpus, 1)
  t:equal(all.gpus, #t.device:describe().gpus)
  t:equal(one.hash, all.hash)
  t:note(("%d GPUs"):format(all.gpus))
end)

-- ---- bad input ----------------------------------------------------------------------------------

local materials = engine.materials "paper"

local function begin(device, options, scene, mask)
  local population = bodies.population(materials, { 3, 3, 3 }, 2)
  options.duration = options.duration or 0.1
  return engine.simulation(population, materials, engine.scene(scene or bodies.ALL), options,
    device, mask)
end

-- Each raises the same message on every device.
local BAD = {
  { "settle", function(device) begin(device, { settle = -1 }) end },
  { "record", function(device)
    begin(device, { time_step = 1e-4, record = { center_of_mass = 3333 } })
  end },
  { "more traces than memory", function(device)
    begin(device, { duration = 1e5, record = { position = 100000 } })
  end },
  { "a trace that was not recorded", function(device)
    begin(device, {}):trace(1, "energy")
  end },
  { "the state of a robot that is left out", function(device)
    begin(device, {}, nil, { true, false }):state(2)
  end },
  { "placing a robot that is left out", function(device)
    begin(device, {}, nil, { true, false }):place(2, {})
  end },
  { "placing after the first step", function(device)
    local simulation = begin(device, {})
    local places = simulation:state(1)
    simulation:advance(0, 1)
    simulation:place(1, places)
  end },
  { "a place that is not finite", function(device)
    local simulation = begin(device, {})
    local places = (simulation:state(1)):table()
    places[2][3] = math.huge
    simulation:place(1, places)
  end },
  { "more robots than memory", function()
    engine.population { lattice = { 64, 64, 64 }, count = 2000000 }
  end },
  { "a body that was not checked", function(device)
    local population = engine.population { lattice = { 2, 2, 2 }, count = 1 }
    population:set_body(1, { 1, 1, 1, 1, 1, 1, 1, 1 })
    engine.simulation(population, materials, engine.scene {}, { duration = 1 }, device)
  end },
}

suite:test("bad input gives the same errors on every device", { devices = { "cuda" } },
  function(t)
    local cpu = engine.device "cpu"
    for _, case in ipairs(BAD) do
      local name, call = unpack(case)
      local expected = t:raises(".", function() call(cpu) end)
      local fine, message = pcall(call, t.device)
      t:ok(not fine, name .. ": it is not refused")
      t:ok(tostring(message) == tostring(expected), ("%s: %s\non the CPU: %s"):format(name,
        tostring(message), tostring(expected)))
    end
  end)

suite:test("bad input is refused on the CPU", function(t)
  local cpu = engine.device "cpu"
  for _, case in ipairs(BAD) do
    local fine, message = pcall(case[2], cpu)
    t:ok(not fine, case[1] .. ": it is not refused")
    t:ok(message:find "kernels%.lua:%d+: %l", tostring(message))
  end
end)

suite:test("without a GPU the error names the reason, and `auto` uses the CPU", function(t)
  local folder = t:folder()
  assert(host.file.write_atomic(folder .. "/program.lua",
    "print(require('limax.engine').device(arg[1]).kind)"))
  local hidden = { before = "CUDA_VISIBLE_DEVICES=" }
  local done = process.ends(folder, { "program.lua", "auto" }, hidden)
  t:equal({ done.status, done.stdout, done.stderr }, { 0, "cpu\n", "" })
  done = process.ends(folder, { "program.lua", "cuda" }, hidden)
  t:equal(done.status, 1)
  t:ok(done.stderr:find "device 'cuda': .+; use 'cpu' or 'auto'", done.stderr)
end)
