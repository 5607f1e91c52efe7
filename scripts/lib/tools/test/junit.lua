--- junit.lua: the results as JUnit's XML, which continuous integration reads. The file is written
--- at the end, and until then holds none; times in seconds.

local failure = require "limax.base.failure"
local host = require "limax.host"
local valid_text = require "limax.tools.test.valid_text"

local junit = {}

local methods = {}
methods.__index = methods

local HEAD = '<?xml version="1.0" encoding="UTF-8"?>\n<testsuites name="limax test">\n'
local FOOT = "</testsuites>\n"
local ENTITIES = { ["&"] = "&amp;", ["<"] = "&lt;", [">"] = "&gt;", ['"'] = "&quot;" }

-- XML 1.0 has no place for other control characters: they become question marks.
local function escaped(text)
  text = valid_text(text):gsub("[%z\1-\8\11\12\14-\31\127]+", "?")
  return (text:gsub('[&<>"]', ENTITIES))
end

function methods:begin() end

function methods:file(file)
  self.current = { path = file.path, cases = {}, failed = 0, skipped = 0, seconds = 0 }
  table.insert(self.files, self.current)
  if file.failure then
    self.current.failed = 1
    table.insert(self.current.cases, ('    <testcase classname="%s" name="loads" time="0">\n'
      .. '      <error message="does not load">%s</error>\n    </testcase>\n'):format(
      escaped(file.path), escaped(file.failure)))
  end
end

local function inner(result)
  local text = result.where and ("%s: %s"):format(result.where, result.text) or result.text
  local parts = {}
  if result.status == "failed" then
    local first = result.text:match "^[^\n]*"
    parts[1] = ('      <failure message="%s">%s</failure>\n'):format(escaped(first), escaped(text))
  elseif result.status == "skipped" then
    parts[1] = ('      <skipped message="%s"/>\n'):format(escaped(text))
  end
  if result.notes[1] then
    parts[#parts + 1] = ("      <system-out>%s</system-out>\n"):format(
      escaped(table.concat(result.notes, "\n")))
  end
  return table.concat(parts)
end

function methods:start() end

function methods:result(instance, result)
  local file = self.current
  file.seconds = file.seconds + result.seconds
  if result.status ~= "passed" then file[result.status] = file[result.status] + 1 end
  table.insert(file.cases, ('    <testcase classname="%s" name="%s" time="%.3f">\n%s'
    .. "    </testcase>\n"):format(escaped(instance.suite), escaped(instance.label),
    result.seconds, inner(result)))
end

function methods:write(text, status)
  local fine, message = host.file.write_atomic(self.path, text)
  if not fine then failure.raise(status, "--junit: " .. message) end
end

function methods:finish()
  local lines = { HEAD }
  for _, file in ipairs(self.files) do
    lines[#lines + 1] = ('  <testsuite name="%s" tests="%d" failures="%d" skipped="%d" '
      .. 'time="%.3f">\n%s  </testsuite>\n'):format(escaped(file.path), #file.cases, file.failed,
      file.skipped, file.seconds, table.concat(file.cases))
  end
  lines[#lines + 1] = FOOT
  self:write(table.concat(lines), 1)
end

--- A reporter that leaves its file at `path`.
---@param path string
function junit.reporter(path)
  local folder = path:match "^(.*)/" or "."
  if host.file.exists(folder == "" and "/" or folder) ~= "folder" then
    failure.raise(2, ("--junit: there is no folder %s"):format(folder))
  end
  local self = setmetatable({ path = path, files = {} }, methods)
  -- what cannot be written is said before the tests run, and results of an earlier run do not pass
  -- for those of one that is cut short
  self:write(HEAD .. FOOT, 2)
  return self
end

return junit
