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
local what = arg[1] and host.json.decode(arg[1]) or {}
local population = bodies.population(materials, what.lattice or { 5, 5, 5 }, 12, { hollow = true })
local simulation = engine.simulation(population, materials,
  engine.scene(what.scene or bodies.ALL), { time_step = 1e-4, duration = 0.1, settle = 0.02,
    record = { center_of_mass = 50, energy = 50 } }, device)
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

-- Runs it with environment variables and a cache in a folder; its output, decoded. `what` replaces
-- its lattice or scene. Only a slow compilation may be announced.
local function simulate(t, folder, environment, what)
  process.write(folder .. "/program.lua", PROGRAM)
  local done = process.completes(t, folder, { "program.lua", what },
    { before = ("XDG_CACHE_HOME=%s %s"):format(process.quote(folder), environment or "") })
  t:equal((done.stderr:gsub("limax: compiled the kernel [^\n]*\n", "")), "")
  return assert(host.json.decode(done.stdout, "the program"))
end

-- Skips a test if kernels cannot be compiled.
local function need_compiler(t)
  local nvrtc = t.device:describe().nvrtc
  if not nvrtc:match "^%d" then t:skip(nvrtc) end
end

suite:test("a kernel built ahead of time, compiled or cached gives the same bits",
  { devices = { "cuda" } }, function(t)
    need_compiler(t)
    local folder = t:folder()
    local compiled = simulate(t, folder, "LIMAX_KERNELS=cached,compiled")
    local cached = simulate(t, folder, "LIMAX_KERNELS=cached")
    t:equal({ compiled.origin, cached.origin }, { "compiled", "cached" })
    local usual = simulate(t, folder)
    t:equal({ cached.hash, usual.hash }, { compiled.hash, compiled.hash })
    t:note("without LIMAX_KERNELS: " .. usual.origin)
  end)

suite:test("without a compiler a kernel for more effects, or any lattice, gives the same bits",
  { devices = { "cuda" } }, function(t)
    need_compiler(t)
    local folder = t:folder()
    for what, made_for in pairs { ['{"scene":{"gravity":true}}'] = true,
      ['{"scene":{"gravity":true,"ground":true}}'] = true, ['{"lattice":[3,2,4]}'] = false,
      ['{"lattice":[10,10,10]}'] = false, ['{"lattice":[20,6,9]}'] = false } do
      local compiled = simulate(t, folder, "LIMAX_KERNELS=compiled", what)
      local served = simulate(t, folder, "LIMAX_KERNELS=ahead-of-time", what)
      t:equal({ compiled.origin, served.origin }, { "compiled", "ahead of time" })
      t:equal({ compiled.made_for, served.made_for ~= nil }, { nil, made_for })
      t:ok(made_for or compiled.form == "one robot" and served.form == "any lattice", served.form)
      t:equal(served.hash, compiled.hash)
    end
  end)

suite:test("one GPU gives the same bits as all", { devices = { "cuda" } }, function(t)
  local folder = t:folder()
  local one = simulate(t, folder, "CUDA_VISIBLE_DEVICES=0")
  local all = simulate(t, folder)
  t:equal({ one.gpus, all.gpus }, { 1, #t.device:describe().gpus })
  t:equal(one.hash, all.hash)
end)

-- ---- bad input ----------------------------------------------------------------------------------

local function begin(device, options, mask)
  local materials = engine.materials "paper"
  options.duration = options.duration or 0.1
  return engine.simulation(bodies.population(materials, { 3, 3, 3 }, 2), materials,
    engine.scene(bodies.ALL), options, device, mask)
end

-- What each backend checks by itself.
local BAD = {
  { "more traces than memory", function(device)
    begin(device, { duration = 1e5, record = { position = 100000 } })
  end },
  { "the state of a robot that is left out", function(device)
    begin(device, {}, { true, false }):state(2)
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
}

suite:test("bad input gives the same errors on every device", { devices = "all" }, function(t)
  local cpu = engine.device "cpu"
  for _, case in ipairs(BAD) do
    local name, call = unpack(case)
    local expected = t:raises("kernels%.lua:%d+: %l", function() call(cpu) end)
    local fine, message = pcall(call, t.device)
    t:equal({ name, fine, tostring(message) }, { name, false, tostring(expected) })
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
