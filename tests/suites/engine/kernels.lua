--- kernels.lua: whatever a GPU's kernel came from, and whatever lies in the way of its cache, the
--- bits are the same and a user is told once; and bad input is refused in the CPU's words.

local bodies = require "limax.tools.bench.bodies"
local engine = require "limax.engine"
local host = require "limax.host"
local process = require "support.process"

local suite = require("limax.test").suite "kernels"

-- ---- where a kernel comes from ------------------------------------------------------------------

-- Simulates the bodies that kernels built with limax serve, and says what came out. Two kernels:
-- one steps, the other measures energies.
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

-- Runs it with variables of the environment; what it printed, decoded, and its warnings.
local function simulate(t, folder, environment)
  assert(host.file.write_atomic(folder .. "/program.lua", PROGRAM))
  local done = process.completes(t, folder, { "program.lua" }, { before = environment })
  return assert(host.json.decode(done.stdout, "the program")), done.stderr
end

local function cache_in(folder) return "XDG_CACHE_HOME=" .. process.quote(folder) end

-- Ends a test where kernels cannot be compiled.
local function need_compiler(t)
  local nvrtc = t.device:describe().nvrtc
  if not nvrtc:match "^%d" then t:skip(nvrtc) end
end

local function count(text, pattern) return select(2, text:gsub(pattern, "")) end

suite:test("built with limax, compiled or cached, a kernel gives the same bits",
  { devices = { "cuda" } }, function(t)
    need_compiler(t)
    local folder = t:folder()
    local compiled, said =
      simulate(t, folder, cache_in(folder) .. " LIMAX_KERNELS=cached,compiled")
    t:equal({ compiled.origin, said }, { "compiled", "" })
    local cached
    cached, said = simulate(t, folder, cache_in(folder) .. " LIMAX_KERNELS=cached")
    t:equal({ cached.origin, said }, { "cached", "" })
    local usual = simulate(t, folder, cache_in(folder))
    t:equal({ cached.hash, usual.hash }, { compiled.hash, compiled.hash })
    t:note("without LIMAX_KERNELS: " .. usual.origin)
    -- after a wipe
    local wiped = simulate(t, t:folder(), cache_in(t:folder()) .. " LIMAX_KERNELS=cached,compiled")
    t:equal(wiped, compiled)
  end)

suite:test("without a compiler the smallest kernel that covers a scene serves it, with its bits",
  { devices = { "cuda" }, limit = 120 }, function(t)
    need_compiler(t)
    local folder = t:folder()
    for _, effects in ipairs { "gravity", "gravity,ground", "damping,actuation" } do
      local environment = cache_in(folder) .. " EFFECTS=" .. effects .. " LIMAX_KERNELS="
      local compiled = simulate(t, folder, environment .. "compiled")
      local covering = simulate(t, folder, environment .. "ahead-of-time")
      t:equal({ compiled.made_for, covering.origin }, { nil, "ahead of time" })
      t:equal(covering.effects, compiled.effects)
      t:equal(covering.made_for, "springs, damping, actuation, gravity, ground, friction")
      t:equal(covering.hash, compiled.hash)
    end
  end)

suite:test("without a compiler a kernel for any lattice serves the others, with their bits",
  { devices = { "cuda" }, limit = 120 }, function(t)
    need_compiler(t)
    local folder = t:folder()
    for _, lattice in ipairs { "3 2 4", "4 7 3", "10 10 10", "20 6 9" } do
      local environment = cache_in(folder) .. (" LATTICE='%s' LIMAX_KERNELS="):format(lattice)
      local compiled = simulate(t, folder, environment .. "compiled")
      local served = simulate(t, folder, environment .. "ahead-of-time")
      t:equal({ compiled.form, served.form }, { "alone", "any lattice" })
      t:equal({ compiled.origin, served.origin }, { "compiled", "ahead of time" })
      t:equal(served.hash, compiled.hash)
    end
  end)

suite:test("one GPU gives the bits of all", { devices = { "cuda" } }, function(t)
  local folder = t:folder()
  local one = simulate(t, folder, cache_in(folder) .. " CUDA_VISIBLE_DEVICES=0")
  local all = simulate(t, folder, cache_in(folder))
  t:equal(one.gpus, 1)
  t:equal(all.gpus, #t.device:describe().gpus)
  t:equal(one.hash, all.hash)
  t:note(("%d GPUs"):format(all.gpus))
end)

suite:test("a damaged cache is made again, and said once", { devices = { "cuda" } }, function(t)
  need_compiler(t)
  local folder = t:folder()
  local environment = cache_in(folder) .. " LIMAX_KERNELS=cached,compiled"
  local whole = simulate(t, folder, environment)
  local cache = folder .. "/limax"
  local damaged = 0
  for _, name in ipairs(host.file.list(cache)) do
    local path = cache .. "/" .. name
    local file = assert(io.open(path, "r+b"))
    local middle = math.floor(file:seek "end" / 2)
    file:seek("set", middle)
    local byte = file:read(1):byte()
    file:seek("set", middle)
    file:write(string.char((byte + 1) % 256))
    file:close()
    damaged = damaged + 1
  end
  -- one that steps and one that measures
  t:ok(damaged >= 2)
  local again, said = simulate(t, folder, environment)
  t:equal({ again.origin, again.hash }, { "compiled", whole.hash })
  t:equal(count(said, "\n"), 1)
  t:ok(said:find "^limax: the kernel cache's file .* is damaged %(its checksum is wrong%)", said)
  again, said = simulate(t, folder, environment)
  t:equal({ again.origin, again.hash, said }, { "cached", whole.hash, "" })
end)

suite:test("a cache that cannot be written is left out, and said once", { devices = { "cuda" } },
  function(t)
    need_compiler(t)
    local folder = t:folder()
    -- a file, where a folder would have to be made: closed to every user
    assert(host.file.write_atomic(folder .. "/file", ""))
    local without, said =
      simulate(t, folder, cache_in(folder .. "/file") .. " LIMAX_KERNELS=cached,compiled")
    t:equal(without.origin, "compiled")
    t:equal(count(said, "\n"), 1)
    t:ok(said:find "^limax: kernels are not kept for the next run: .*/file/limax cannot be written",
      said)
    t:equal(without.hash, simulate(t, folder, cache_in(folder)).hash)
  end)

-- ---- bad input ----------------------------------------------------------------------------------

local materials = engine.materials "paper"

local function begin(device, options, scene, mask)
  local population = bodies.population(materials, { 3, 3, 3 }, 2)
  options.duration = options.duration or 0.1
  return engine.simulation(population, materials, engine.scene(scene or bodies.ALL), options,
    device, mask)
end

-- Each raises; what is said must not depend on the device.
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

suite:test("bad input is refused in the same words on every device", { devices = { "cuda" } },
  function(t)
    local cpu = engine.device "cpu"
    for _, case in ipairs(BAD) do
      local name, call = unpack(case)
      local said = t:raises(".", function() call(cpu) end)
      local fine, message = pcall(call, t.device)
      t:ok(not fine, name .. ": it is not refused")
      t:ok(tostring(message) == said, ("%s: %s\non the CPU: %s"):format(name, message, said))
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

suite:test("LIMAX_KERNELS with another word is refused", { devices = { "cuda" } }, function(t)
  local folder = t:folder()
  assert(host.file.write_atomic(folder .. "/program.lua", PROGRAM))
  local done =
    process.ends(folder, { "program.lua" }, { before = "LIMAX_KERNELS=fast" })
  t:equal(done.status, 1)
  t:ok(done.stderr:find("LIMAX_KERNELS names 'fast'; it is a list of ahead-of-time", 1, true),
    done.stderr)
end)

suite:test("a machine without a GPU says why, and `auto` takes the CPU", function(t)
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

return suite
