--- lines.lua: results as lines of JSON, one for each file, test begun, test ended and the end: for
--- programs, and for the process that runs others (processes.lua).

local host = require "limax.host"

local lines = {}

local methods = {}
methods.__index = methods

--- A text of valid UTF-8, which JSON and XML need: if a message has other bytes, each run of bytes
--- beyond ASCII becomes a question mark.
function lines.valid_text(text)
  if pcall(host.json.encode, text) then return text end
  return (text:gsub("[\128-\255]+", "?"))
end

local function valid(value)
  if type(value) == "string" then return lines.valid_text(value) end
  if type(value) ~= "table" then return value end
  for key, entry in pairs(value) do value[key] = valid(entry) end
  return value
end

function methods:line(fields) self.write(host.json.encode(valid(fields)) .. "\n") end

function methods:begin(total) self:line { event = "begin", total = total } end

function methods:file(file)
  self:line { event = "file", path = file.path, failure = file.failure }
end

-- A test that never returns cannot report itself.
function methods:start(instance)
  self:line { event = "start", suite = instance.suite, test = instance.label,
    limit = instance.limit }
end

function methods:result(instance, result)
  self:line { event = "test", suite = instance.suite, test = instance.label,
    status = result.status, text = result.text, where = result.where, seconds = result.seconds,
    notes = host.json.array(result.notes) }
end

function methods:finish(counts)
  self:line { event = "end", passed = counts.passed, failed = counts.failed,
    skipped = counts.skipped }
end

--- A reporter that writes them.
function lines.reporter(write) return setmetatable({ write = write }, methods) end

return lines
