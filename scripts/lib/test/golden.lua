--- golden.lua: recorded values beside the suite that compares with them,
--- golden/SUITE_FILE/NAME.json. A golden is written only where a person asks for it, with `limax
--- test --update-golden`.

local host = require "limax.host"
local compare = require "limax.test.compare"
local engine = require "limax.engine"

local golden = {}

local SCHEMA = "limax.golden/1"

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
  for _, key in ipairs { "schema", "suite", "test", "name", "why", "rtol", "atol", "recorded" } do
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

local function read(path)
  local file, message = io.open(path, "rb")
  if not file then return nil, message end
  local text = file:read "*a"
  file:close()
  local record
  record, message = host.json.decode(text, path)
  if not record then return nil, message end
  if type(record) ~= "table" or record.schema ~= SCHEMA or type(record.values) ~= "table" then
    return nil, ("%s is no golden of schema %s"):format(path, SCHEMA)
  end
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
---@field rtol number
---@field atol number
---@field why string
---@field device string

--- Compares with the recorded values, or records them.
---@param request limax.golden_request
---@param update boolean whether a person asked to record
---@return string|nil failure
---@return string|nil change what was recorded
function golden.check(request, update)
  local path = request.path
  local values, message = plain(request.values, request.name)
  if not values then return message end
  local there = host.file.exists(path) == "file"
  local old
  if there then
    old, message = read(path)
    if not old and not update then return message end
  end
  local differences = old and compare.near(old.values, values, request) or {}
  local change
  if not old then
    change = "new"
  elseif #differences > 0 then
    change = ("%d differ; the worst: %s"):format(#differences,
      compare.text(compare.worst(differences)))
  elseif old.rtol ~= request.rtol or old.atol ~= request.atol or old.why ~= request.why then
    change = "another tolerance or reason"
  end
  if update then
    if not change then return nil end
    local environment = host.environment()
    return write(path, {
      schema = SCHEMA, suite = request.suite, test = request.test, name = request.name,
      why = request.why, rtol = request.rtol, atol = request.atol, values = values,
      recorded = { limax = host.version, compiler = environment.compiler, device = request.device },
    }), change
  end
  if not there then
    return ("there is no golden %s; look at the values, then record them with "
      .. "limax test FILE --update-golden"):format(path)
  end
  if #differences > 0 then
    local text = "golden %s: %s (%d of its values are out of tolerance; rtol %g, atol %g: %s)"
    return text:format(request.name, compare.text(compare.worst(differences)), #differences,
      request.rtol, request.atol, request.why)
  end
  return nil
end

return golden
