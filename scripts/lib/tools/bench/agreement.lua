--- agreement.lua: checks of a GPU before it is timed: every mass within a tolerance of its position
--- on the CPU, and the bits that were stored for this GPU model, one file per model in hashes/. SI
--- units.

local bodies = require "limax.tools.bench.bodies"
local engine = require "limax.engine"
local failure = require "limax.base.failure"
local host = require "limax.host"
local source = require "limax.base.source"

local agreement = {}

--- Times of the check, s: long enough to fall, touch and bend, well before chaos.
agreement.SETTLE, agreement.DURATION, agreement.TIME_STEP = 0.05, 0.1, 1e-4

--- Largest distance of a mass between two devices after 1500 steps, m. The laws are the same source
--- on both, so that only the order of summing forces and the last bit of an inverse length differ.
--- In double that stays in the last bits (2e-15 m measured on an H200). In fp32 positions are
--- rounded to 6e-8 m at a metre, which 1500 steps add up to 1e-6 m. On the ground a rounding
--- decides when a mass touches and whether friction holds it, in every precision that rounds
--- forces: damped bodies stay within 4.4e-5 m on an H200; the CPU's own undamped `single` is
--- up to 3.4e-4 m from its `double` (10x10x10, symplectic Euler). The tolerances are three to ten
--- times what was measured.
function agreement.tolerance(precision, scene)
  if precision == "double" then return 2e-14 end
  if not scene.ground then return 1.1e-5 end
  return scene.damping and 3e-4 or 1e-3
end

-- Coordinates of all masses at the end, flat, and a hash of the whole state.
local function last_state(population, materials, precision, device)
  local simulation = engine.simulation(population, materials, engine.scene(bodies.ALL), {
    precision = precision, time_step = agreement.TIME_STEP, settle = agreement.SETTLE,
    duration = agreement.DURATION }, device)
  simulation:run()
  local coordinates, text = {}, {}
  for robot = 1, population.count do
    local status = simulation:outcome(robot).status
    assert(status == "done", status)
    for k, view in ipairs { simulation:state(robot) } do
      for _, row in ipairs(view:table()) do
        for _, value in ipairs(row) do
          if k == 1 then coordinates[#coordinates + 1] = value end
          text[#text + 1] = ("%a"):format(value)
        end
      end
    end
  end
  simulation:free()
  return coordinates, host.sha256(table.concat(text, " "))
end

--- Compares a device with the CPU, with all effects, and raises if they differ too much.
---@return table<string, string> hashes of the last state on the device, by "5x5x5 single"
---@return number worst distance over the tolerance
function agreement.check(materials, device, lattices, precisions)
  local cpu, hashes, worst = engine.device "cpu", {}, 0
  for _, lattice in ipairs(lattices) do
    local population = bodies.population(materials, lattice, 2)
    for _, precision in ipairs(precisions) do
      local name = ("%dx%dx%d %s"):format(lattice[1], lattice[2], lattice[3], precision)
      local got, hash = last_state(population, materials, precision, device)
      local expected = last_state(population, materials, precision, cpu)
      local allowed, off = agreement.tolerance(precision, bodies.ALL), 0
      for i, value in ipairs(expected) do off = math.max(off, math.abs(got[i] - value)) end
      if not (off <= allowed) then
        failure.raise(1, ("%s: a mass is %.3g m from its position on the CPU after %g s; %.3g m "
          .. "are allowed: nothing is timed"):format(name, off,
          agreement.SETTLE + agreement.DURATION, allowed))
      end
      hashes[name], worst = hash, math.max(worst, off / allowed)
    end
    population:free()
  end
  return hashes, worst
end

-- ---- stored hashes ------------------------------------------------------------------------------

local function path_of(model, folder)
  return ("%s/%s.json"):format(folder or host.home .. "/scripts/lib/tools/bench/hashes",
    (model:gsub("[^%w%-]", "_")))
end

--- Compares with the stored hashes of a GPU model; a difference raises.
---@param found table<string, string> hash of each scene
---@param folder string|nil of the hashes; limax's own if left out
function agreement.compare_hashes(model, found, folder)
  local path = path_of(model, folder)
  if not host.file.exists(path) then
    return ("no stored hash for this GPU model (%s)"):format(model)
  end
  local stored, message = source.read_json(path)
  if not stored then failure.raise(1, message) end
  local compared, count = 0, 0
  for name, hash in pairs(found) do
    local expected = stored.hashes[name]
    if expected and expected ~= hash then
      failure.raise(1, ("%s: the last state has other bits than limax %s gave on %s: nothing is "
        .. "timed. If the physics changed on purpose, --store stores the new ones"):format(name,
        stored.version, model))
    end
    compared, count = compared + (expected and 1 or 0), count + 1
  end
  return ("%d of %d last states have hashes stored for %s, and have those bits"):format(compared,
    count, model)
end

--- Stores hashes of a GPU model.
function agreement.store_hashes(model, found, folder)
  local path = path_of(model, folder)
  assert(host.file.mkdir(path:match "^(.*)/"))
  source.write(path, host.json.encode({ schema = "limax.bench_hashes/1", gpu = model,
    version = host.version, hashes = found }, { indent = 2 }) .. "\n")
  return path
end

return agreement
