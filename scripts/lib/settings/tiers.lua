--- tiers.lua: the named tiers of accuracy, and what each was measured to lose and to cost on this
--- machine. `limax bench accuracy` measures and keeps it in accuracy.json of the cache folder, by
--- processor or GPU and by build; nothing is said of what was not measured here.

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
---@field elite_regret number|nil the worst of the populations that were measured
---@field tau number|nil the least of them
---@field smooth_error number|nil m, of a body working in the air
---@field seconds_per_second number|nil wall time of a robot and simulated second, s
---@field relative_to_paper number|nil that in the paper's, symplectic Euler in fp32 at 1e-5 s

--- The file of what was measured; nil where there is no cache folder.
---@return string|nil
function tiers.path()
  local cache, home = os.getenv "XDG_CACHE_HOME", os.getenv "HOME"
  if cache and cache ~= "" then return cache .. "/limax/accuracy.json" end
  if home and home ~= "" then return home .. "/.cache/limax/accuracy.json" end
  return nil
end

--- What a measurement holds for: the model of processor or GPU, and the build. Prices are ratios,
--- so that the number of threads is no part of it.
---@param about table what the device says of itself
---@param version string of limax
---@param machine { compiler: string, build: string }
---@return string
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

--- What was measured for this device and build, by tier; nil where nothing was.
---@param device limax.device
---@return table<string, limax.tiers.measured>|nil
function tiers.measured(device)
  local found = content().measured[key_of(device:describe(), host.version, host.environment())]
  return type(found) == "table" and found or nil
end

--- The same for a session of a run folder's environment.json, if it was measured where this is
--- read.
---@param session table
---@return table<string, limax.tiers.measured>|nil
function tiers.measured_in(session)
  if not (session.device and session.machine and session.version) then return nil end
  local found = content().measured[key_of(session.device, session.version, session.machine)]
  return type(found) == "table" and found or nil
end

--- Keeps what was measured, beside what other devices and builds left.
---@param device limax.device
---@param measured table<string, limax.tiers.measured>
---@return string|nil path
---@return string|nil message why it is not kept
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

--- The tier that a resolved `simulation` is, all of its parts; nil where a part was stated itself.
---@param simulation table
---@return string|nil
function tiers.of(simulation)
  local tier = defaults.tiers[simulation.accuracy]
  for _, part in ipairs(PARTS) do
    if simulation[part] ~= tier[part] then return nil end
  end
  return simulation.accuracy
end

--- Overrides that give an experiment a tier whole: parts that its script states itself give way.
---@param name string
---@return string[]
function tiers.overrides(name)
  local list = { "simulation.accuracy=" .. name }
  for _, part in ipairs(PARTS) do list[#list + 1] = ("simulation.%s=null"):format(part) end
  return list
end

--- What a tier is: "leapfrog, compensated, at most 0.0002 s".
---@param name string
---@return string
function tiers.describe(name)
  local tier = defaults.tiers[name]
  local most = tier.time_step_most > 0 and (", at most %g s"):format(tier.time_step_most) or ""
  return ("%s, %s, %g of each body's bound%s"):format(tier.integrator, tier.precision,
    tier.bound_fraction, most)
end

--- What it loses and costs, in one line.
---@param measured limax.tiers.measured|nil
---@return string
function tiers.price(measured)
  if not measured then return "not measured here: limax bench accuracy" end
  local parts = {}
  local function part(value, pattern, scale)
    if value then parts[#parts + 1] = pattern:format(value * (scale or 1)) end
  end
  part(measured.elite_regret, "elite regret %.2g %%", 100)
  part(measured.tau, "tau %.3f")
  part(measured.smooth_error, "%.1e m in the air")
  part(measured.relative_to_paper, "%.2g of the time of the paper's step")
  return #parts > 0 and table.concat(parts, ", ") or "not measured here: limax bench accuracy"
end

--- What the sections of `limax bench accuracy` say of the tiers.
---@param results table<string, { rows: table[] }> by section
---@return table<string, limax.tiers.measured>|nil nil where they say nothing
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
  for _, row in ipairs(results.work_precision and results.work_precision.rows or {}) do
    if row.tier and row.scene == "air" and row.error then of(row.tier).smooth_error = row.error end
  end
  return measured
end

return tiers
