--- tiers.lua: the named tiers of accuracy, and their measured error and cost on this machine.
--- `limax bench accuracy` stores these in accuracy.json of the cache folder, by processor or GPU
--- and build.

local defaults = require "limax.settings.defaults"
local host = require "limax.host"
local settings = require "limax.settings.settings"
local source = require "limax.base.source"

local tiers = {}

tiers.SCHEMA = "limax.accuracy/1"

--- The tiers, cheapest first.
tiers.NAMES = { "preview", "evolve", "publish", "reference" }

-- Fields of `simulation` that a tier sets.
local PARTS = settings.of_tier

---@class limax.tiers.measured of one tier
---@field elite_regret number|nil largest over the measured populations
---@field tau number|nil smallest over them
---@field seconds_per_second number|nil wall time of a robot per simulated second, s
---@field relative_to_paper number|nil that, relative to symplectic Euler in fp32 at 1e-5 s

--- The file of measurements; nil without a cache folder.
function tiers.path()
  local cache, home = os.getenv "XDG_CACHE_HOME", os.getenv "HOME"
  if cache and cache ~= "" then return cache .. "/limax/accuracy.json" end
  if home and home ~= "" then return home .. "/.cache/limax/accuracy.json" end
  return nil
end

--- The key of a measurement: the model of processor or GPU, and the build. Costs are ratios, so the
--- number of threads does not matter.
---@param about table the device's description
---@param version string of limax
---@param machine { compiler: string, build: string }
local function key_of(about, version, machine)
  local model = about.gpus and about.gpus[1].name or ("%s, %s"):format(about.cpu, about.isa)
  return ("%s; limax %s, %s, %s"):format(model, version, machine.compiler, machine.build)
end

-- The whole file; an empty one where it is missing, damaged or of another schema.
local function content()
  local path = tiers.path()
  local text = path and host.file.exists(path) == "file" and source.read(path)
  local decoded = text and host.json.decode(text, path)
  if type(decoded) ~= "table" or decoded.schema ~= tiers.SCHEMA
    or type(decoded.measured) ~= "table" then
    return { schema = tiers.SCHEMA, measured = {} }
  end
  return decoded
end

--- The measurements for this device and build, by tier; nil without any.
---@return table<string, limax.tiers.measured>|nil
function tiers.measured(device)
  return tiers.measured_in { device = device:describe(), version = host.version,
    machine = host.environment() }
end

--- The same for a process that wrote a run folder: a line `begin` of its journal.
function tiers.measured_in(session)
  if not (session.device and session.machine and session.version) then return nil end
  local found = content().measured[key_of(session.device, session.version, session.machine)]
  return type(found) == "table" and found or nil
end

--- Stores measurements, beside those of other devices and builds.
---@param measured table<string, limax.tiers.measured>
---@return string|nil path
---@return string|nil message why it was not stored
function tiers.keep(device, measured)
  local path = tiers.path()
  if not path then return nil, "neither XDG_CACHE_HOME nor HOME names a folder" end
  local all = content()
  all.measured[key_of(device:describe(), host.version, host.environment())] = measured
  local fine, message = host.file.mkdir(path:match "^(.*)/")
  if fine then
    fine, message = host.file.write_atomic(path, host.json.encode(all, { indent = 2 }) .. "\n")
  end
  if not fine then return nil, message end
  return path
end

--- The tier of a resolved `simulation`; nil if the script set a part of it.
function tiers.of(simulation)
  local tier = defaults.tiers[simulation.accuracy]
  for _, part in ipairs(PARTS) do
    if simulation[part] ~= tier[part] then return nil end
  end
  return simulation.accuracy
end

--- Overrides that give an experiment a whole tier, also the parts that its script sets.
function tiers.overrides(name)
  local list = { "simulation.accuracy=" .. name }
  for _, part in ipairs(PARTS) do list[#list + 1] = ("simulation.%s=null"):format(part) end
  return list
end

--- A tier in words: "leapfrog, compensated, at most 0.0002 s".
function tiers.describe(name)
  local tier = defaults.tiers[name]
  local most = tier.time_step_most > 0 and (", at most %g s"):format(tier.time_step_most) or ""
  return ("%s, %s, %g of each body's bound%s%s"):format(tier.integrator, tier.precision,
    tier.bound_fraction, tier.bound and " by " .. tier.bound or "", most)
end

--- Its error and cost, in one line.
---@param measured limax.tiers.measured|nil
function tiers.price(measured)
  if not measured then return "not measured here: limax bench accuracy" end
  local parts = {}
  local function part(value, pattern, scale)
    if value then parts[#parts + 1] = pattern:format(value * (scale or 1)) end
  end
  part(measured.elite_regret, "elite regret %.2g %%", 100)
  part(measured.tau, "tau %.3f")
  part(measured.relative_to_paper, "%.2g of the time of the paper's step")
  return #parts > 0 and table.concat(parts, ", ") or "not measured here: limax bench accuracy"
end

--- The measurements of the tiers from the sections of `limax bench accuracy`.
---@param results table<string, { rows: table[] }> by section
---@return table<string, limax.tiers.measured>|nil nil without any
function tiers.summary(results)
  local measured
  local function of(name)
    measured = measured or {}
    measured[name] = measured[name] or {}
    return measured[name]
  end
  local counts = {}
  for _, row in ipairs(results.ranking and results.ranking.rows or {}) do
    if row.tier and row.relative_to_paper then
      local one = of(row.tier)
      one.elite_regret = row.elite_regret and math.max(one.elite_regret or 0, row.elite_regret)
        or one.elite_regret
      one.tau = row.tau and math.min(one.tau or 1, row.tau) or one.tau
      counts[row.tier] = (counts[row.tier] or 0) + 1
      for _, field in ipairs { "seconds_per_second", "relative_to_paper" } do
        one[field] = (one[field] or 0) + row[field]
      end
    end
  end
  for name, count in pairs(counts) do
    for _, field in ipairs { "seconds_per_second", "relative_to_paper" } do
      measured[name][field] = measured[name][field] / count
    end
  end
  return measured
end

return tiers
