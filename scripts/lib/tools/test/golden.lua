--- golden.lua: recorded values beside the suite that compares with them,
--- golden/SUITE_FILE/NAME.json. A golden is written only where a person asks for it, with `limax
--- test --update-golden`, and every change of one is given a reason, which it keeps. A golden is
--- of one configuration: where that is another now, its values say nothing.

local host = require "limax.host"
local compare = require "limax.tools.test.compare"
local engine = require "limax.engine"
local source = require "limax.base.source"

local golden = {}

local SCHEMA = "limax.golden/2"
-- values and tolerance alone, without class, configuration and changes; an update makes it new
local FIRST_SCHEMA = "limax.golden/1"

-- differences that an update shows, the worst first
local SHOWN = 5

--- Classes of tolerance, the narrowest first: what `rtol` one has where the test names none, and
--- the largest that it allows.
golden.classes = {
  { name = "bits", rtol = 0, most = 0 },
  -- fp32 rounds at 6e-8; a few hundred operations of different order
  { name = "rounding", rtol = 1e-6, most = 1e-5 },
  -- trajectories before contact has pulled two devices apart
  { name = "short horizon", rtol = 1e-3, most = 1e-2 },
  -- means over seeds, and single trajectories beyond that horizon
  { name = "statistics", rtol = 5e-2, most = math.huge },
}

--- The class of a name; without one the narrowest that allows `rtol` and `atol`.
---@param name string|nil
---@param rtol number|nil
---@param atol number|nil
---@return { name: string, rtol: number, most: number }|nil
function golden.class(name, rtol, atol)
  for _, class in ipairs(golden.classes) do
    local fits = (rtol or 0) <= class.most and (class.most > 0 or (atol or 0) == 0)
    if name == class.name or (name == nil and fits) then return class end
  end
end

--- Path of a golden.
---@param suite_file string path of the suite's file
---@param name string
---@return string
function golden.path(suite_file, name)
  local folder, stem = suite_file:match "^(.*)/([^/]*)$"
  stem = (stem or suite_file):gsub("%.lua$", "")
  return ("%s/golden/%s/%s.json"):format(folder or ".", stem, name)
end

-- Views become lists; what JSON cannot hold is named.
local function plain(value, path)
  if engine.is_view(value) then value = value:table() end
  if type(value) == "table" then
    local result = {}
    for key, entry in pairs(value) do
      if type(key) ~= "number" and type(key) ~= "string" then
        return nil, ("%s has a key that is a %s"):format(path, type(key))
      end
      local place = type(key) == "number" and ("%s[%d]"):format(path, key) or path .. "." .. key
      local message
      result[key], message = plain(entry, place)
      if message then return nil, message end
    end
    return result
  end
  if type(value) == "number" and (value ~= value or math.abs(value) == math.huge) then
    return nil, ("%s is %s: a golden holds finite numbers"):format(path, tostring(value))
  end
  if type(value) ~= "number" and type(value) ~= "string" and type(value) ~= "boolean" then
    return nil, ("%s is a %s: a golden holds numbers, strings and booleans"):format(path,
      type(value))
  end
  return value
end

-- The file's text: a line for each entry of `values`, so that a difference between versions is
-- readable.
local function encoded(record)
  local encode = host.json.encode
  local lines = { "{" }
  for _, key in ipairs { "schema", "suite", "test", "name", "class", "why", "rtol", "atol",
    "configuration", "recorded", "changes" } do
    lines[#lines + 1] = ("  %s: %s,"):format(encode(key), encode(record[key]))
  end
  local values = record.values
  local names = {}
  for name in pairs(values) do names[#names + 1] = name end
  if type(names[1]) ~= "string" then
    lines[#lines + 1] = ('  "values": %s'):format(encode(values))
  else
    table.sort(names)
    lines[#lines + 1] = '  "values": {'
    for i, name in ipairs(names) do
      local comma = i < #names and "," or ""
      lines[#lines + 1] = ("    %s: %s%s"):format(encode(name), encode(values[name]), comma)
    end
    lines[#lines + 1] = "  }"
  end
  lines[#lines + 1] = "}"
  return table.concat(lines, "\n") .. "\n"
end

-- Is this a list of reasons, each with what changed?
local function are_changes(list)
  if type(list) ~= "table" then return false end
  for _, each in ipairs(list) do
    if type(each) ~= "table" or type(each.reason) ~= "string" then return false end
  end
  return true
end

-- What stands in a golden; otherwise nil and why it is none.
local function read(path)
  local text, message = source.read(path)
  if not text then return nil, message end
  local record
  record, message = host.json.decode(text, path)
  if not record then return nil, message end
  local fine = type(record) == "table" and type(record.values) == "table"
    and type(record.recorded) == "table"
    and (record.schema == FIRST_SCHEMA or record.schema == SCHEMA and are_changes(record.changes))
  if not fine then return nil, ("%s is no golden of schema %s"):format(path, SCHEMA) end
  if record.configuration == host.json.null then record.configuration = nil end
  return record
end

local function write(path, record)
  local fine, message = host.file.mkdir(path:match "^(.*)/")
  if fine then fine, message = host.file.write_atomic(path, encoded(record)) end
  if not fine then return ("cannot write %s: %s"):format(path, tostring(message)) end
  return nil
end

---@class limax.golden_request
---@field path string
---@field suite string
---@field test string
---@field name string
---@field values table
---@field class string of the tolerance
---@field rtol number
---@field atol number
---@field why string
---@field device string
---@field configuration string|nil SHA-256 of what was simulated

---@class limax.golden_update
---@field reason string|nil why goldens change
---@field ask fun(text: string): string|nil asks a person, where there is one

-- The worst differences, a line each.
local function listed(differences)
  local sorted = { unpack(differences) }
  for i, difference in ipairs(sorted) do difference.order = i end
  table.sort(sorted, function(a, b)
    if a.excess ~= b.excess then return a.excess > b.excess end
    return a.order < b.order
  end)
  local lines = {}
  for i = 1, math.min(SHOWN, #sorted) do
    local one = sorted[i]
    local line = ("%s: %s -> %s"):format(one.path, compare.shown(one.expected),
      compare.shown(one.got))
    if type(one.expected) == "number" and type(one.got) == "number" and one.expected ~= 0 then
      line = ("%s, relative %.3g"):format(line,
        math.abs((one.got - one.expected) / one.expected))
    end
    lines[i] = "\n  " .. line
  end
  if #sorted > SHOWN then lines[#lines + 1] = ("\n  and %d more"):format(#sorted - SHOWN) end
  return table.concat(lines)
end

-- What has changed since `old`; nil where nothing has.
local function change_of(old, request, differences)
  local count = #differences == 1 and "1 value" or #differences .. " values"
  local among = #differences > 0 and ", and " .. count or ""
  if old.schema ~= SCHEMA then
    return ("of schema %s, without a configuration%s"):format(old.schema, among)
      .. listed(differences)
  end
  if old.configuration ~= request.configuration then
    return ("another configuration%s"):format(among) .. listed(differences)
  end
  if #differences > 0 then
    return ("%s, old -> new"):format(count) .. listed(differences)
  end
  if old.rtol ~= request.rtol or old.atol ~= request.atol or old.class ~= request.class then
    return ("another tolerance: %s (rtol %s, atol %s) -> %s (rtol %g, atol %g)"):format(
      tostring(old.class), tostring(old.rtol), tostring(old.atol), request.class,
      request.rtol, request.atol)
  end
  if old.why ~= request.why then
    return ("another why: %s -> %s"):format(tostring(old.why), request.why)
  end
end

-- Records; `damage`: why the file that stands there is no golden.
local function record(request, values, old, damage, update)
  local change = "new"
  if old then
    change = change_of(old, request, compare.near(old.values, values, request))
  elseif damage then
    change = "in the place of what cannot be read: " .. damage
  end
  if not change then return nil end
  local changes = old and old.changes or {}
  if old or damage then
    local reason = update.reason
      or update.ask(("golden %s of %s: %s"):format(request.name, request.test, change))
    if not reason or not reason:find "%S" then
      return ("golden %s: %s\nit stays as it is: an update needs its reason, "
        .. "limax test --update-golden --reason \"...\""):format(request.name, change)
    end
    changes[#changes + 1] = { reason = reason, change = change:match "^[^\n]*" }
  end
  local environment = host.environment()
  return write(request.path, {
    schema = SCHEMA, suite = request.suite, test = request.test, name = request.name,
    class = request.class, why = request.why, rtol = request.rtol, atol = request.atol,
    values = values, configuration = request.configuration or host.json.null,
    changes = host.json.array(changes),
    recorded = { limax = host.version, compiler = environment.compiler, device = request.device },
  }), change
end

--- Compares with the recorded values, or records them.
---@param request limax.golden_request
---@param update limax.golden_update|nil where a person asked to record
---@return string|nil failure
---@return string|nil change what was recorded
function golden.check(request, update)
  local path = request.path
  local values, message = plain(request.values, request.name)
  if not values then return message end
  local there = host.file.exists(path) ~= nil
  local old
  if there then old, message = read(path) end
  if update then return record(request, values, old, there and message, update) end
  if not there then
    return ("there is no golden %s; look at the values, then record them with "
      .. "limax test FILE --update-golden"):format(path)
  end
  if not old then return message end
  if old.schema ~= SCHEMA then
    return ("%s is of schema %s, which has no configuration to hold against; limax test FILE "
      .. "--update-golden makes it one of %s"):format(path, old.schema, SCHEMA)
  end
  if old.configuration ~= request.configuration then
    return ("golden %s is of another configuration (%s, now %s): scene, materials, bodies or "
      .. "settings have changed, so its values say nothing; limax test FILE --update-golden "
      .. "records anew"):format(request.name, (old.configuration or "none"):sub(1, 12),
      (request.configuration or "none"):sub(1, 12))
  end
  local differences = compare.near(old.values, values, request)
  if #differences > 0 then
    local text = "golden %s: %s (%d of its values are out of tolerance; rtol %g, atol %g: %s; "
      .. "recorded by %s on %s)"
    return text:format(request.name, compare.text(compare.worst(differences)), #differences,
      request.rtol, request.atol, request.why, tostring(old.recorded.compiler),
      tostring(old.recorded.device))
  end
  return nil
end

return golden
