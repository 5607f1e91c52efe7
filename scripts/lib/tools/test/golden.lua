--- golden.lua: recorded values beside the suite that compares with them,
--- golden/SUITE_FILE/NAME.json. Only `limax test --update-golden` writes one; it stores a reason
--- for every change.

local compare = require "limax.tools.test.compare"
local engine = require "limax.engine"
local host = require "limax.host"
local source = require "limax.base.source"

local golden = {}

local SCHEMA = "limax.golden/2"

-- differences that an update shows, the worst first
local SHOWN = 5

--- Classes of tolerance, the narrowest first: `rtol` if the test sets none, and the largest that
--- the class allows.
golden.classes = {
  { name = "bits", rtol = 0, most = 0 },
  -- fp32 rounds at 6e-8; a few hundred operations of different order
  { name = "rounding", rtol = 1e-6, most = 1e-5 },
  -- trajectories before contact has separated two devices
  { name = "short horizon", rtol = 1e-3, most = 1e-2 },
  -- means over seeds, and single trajectories beyond that horizon
  { name = "statistics", rtol = 5e-2, most = math.huge },
}

golden.class_names = {}
for i, class in ipairs(golden.classes) do golden.class_names[i] = class.name end

--- The class of a name; without one the narrowest that allows `rtol` and `atol`.
---@return { name: string, rtol: number, most: number }
function golden.class(name, rtol, atol)
  for _, class in ipairs(golden.classes) do
    local fits = (rtol or 0) <= class.most and (class.most > 0 or (atol or 0) == 0)
    if name == class.name or (name == nil and fits) then return class end
  end
end

--- Path of a golden.
---@param suite_file string path of the suite's file
function golden.path(suite_file, name)
  local folder, stem = suite_file:match "^(.*)/([^/]*)$"
  stem = (stem or suite_file):gsub("%.lua$", "")
  return ("%s/golden/%s/%s.json"):format(folder or ".", stem, name)
end

-- The values with views as lists; nil and a message if JSON cannot hold them.
local function plain(value, path)
  if engine.is_view(value) then value = value:table() end
  if type(value) == "table" then
    local result = {}
    for key, entry in pairs(value) do
      local message
      result[key], message = plain(entry,
        type(key) == "number" and ("%s[%d]"):format(path, key) or path .. "." .. tostring(key))
      if message then return nil, message end
    end
    return result
  end
  local kind = type(value)
  if kind == "string" or kind == "boolean" or kind == "number" and value - value == 0 then
    return value
  end
  return nil, ("%s is %s: a golden holds finite numbers, strings and booleans"):format(path,
    tostring(value))
end

-- The record of a golden; otherwise nil and why the file is not one.
local function read(path)
  local record, message = host.json.decode(source.read(path) or "", path)
  if not record then return nil, message end
  if type(record) ~= "table" or record.schema ~= SCHEMA or type(record.values) ~= "table" then
    return nil, ("%s is not a golden of schema %s; delete it to record a new one"):format(path,
      SCHEMA)
  end
  return record
end

-- The worst differences, a line each.
local function listed(differences)
  local lines = {}
  for i = 1, math.min(SHOWN, #differences) do
    lines[i] = "\n  " .. compare.change(differences[i])
  end
  if #differences > SHOWN then
    lines[#lines + 1] = ("\n  and %d more"):format(#differences - SHOWN)
  end
  return table.concat(lines)
end

local function tolerance_text(record)
  return ("%s (rtol %g, atol %g: %s)"):format(record.class, record.rtol, record.atol, record.why)
end

-- Describes the change of a golden value; nil if there is none.
local function change_of(old, request, differences)
  local count = #differences == 1 and "1 value" or #differences .. " values"
  if #differences > 0 then return count .. ", old -> new" .. listed(differences) end
  local before, now = tolerance_text(old), tolerance_text(request)
  if before ~= now then return ("another tolerance: %s -> %s"):format(before, now) end
end

local function record(request, values, old, update)
  local change, changes = "new", {}
  if old then
    change, changes = change_of(old, request, compare.near(old.values, values, request)),
      old.changes
    if not change then return nil end
    local reason = update.reason
    if not reason or not reason:find "%S" then
      return ("golden %s: %s\nit is not recorded: an update needs a reason, "
        .. "limax test --update-golden --reason \"...\""):format(request.name, change)
    end
    changes[#changes + 1] = { reason = reason, change = change:match "^[^\n]*" }
  end
  local text = host.json.encode({ schema = SCHEMA, suite = request.suite, test = request.test,
    name = request.name, class = request.class, why = request.why, rtol = request.rtol,
    atol = request.atol, values = values, changes = host.json.array(changes),
    recorded = { limax = host.version, compiler = host.environment().compiler,
      device = request.device } }, { indent = 2 }) .. "\n"
  local fine, message = host.file.mkdir(request.path:match "^(.*)/")
  if fine then fine, message = host.file.write_atomic(request.path, text) end
  if not fine then return ("cannot write %s: %s"):format(request.path, tostring(message)) end
  return nil, change
end

--- Compares with the recorded values, or records them.
---@param request { path: string, suite: string, test: string, name: string, values: table,
--- rtol: number, atol: number, why: string, device: string }
---@param update { reason: string|nil }|nil if the user asked to record: why goldens change
---@return string|nil failure
---@return string|nil change what was recorded
function golden.check(request, update)
  local path = request.path
  local values, message = plain(request.values, request.name)
  if not values then return message end
  local old
  if host.file.exists(path) then
    old, message = read(path)
    if not old then return message end
  end
  if update then return record(request, values, old, update) end
  if not old then
    return ("there is no golden %s; check the values, then record them with "
      .. "limax test FILE --update-golden"):format(path)
  end
  local differences = compare.near(old.values, values, request)
  if #differences == 0 then return nil end
  return ("golden %s: %s (%d of its values are out of tolerance; rtol %g, atol %g: %s; recorded by "
    .. "%s on %s)%s"):format(request.name, compare.text(differences[1]), #differences,
    request.rtol, request.atol, request.why, old.recorded.compiler, old.recorded.device,
    #differences > 1 and "\nrecorded -> now, the worst first" .. listed(differences) or "")
end

return golden
