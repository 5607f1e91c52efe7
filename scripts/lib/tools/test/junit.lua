--- junit.lua: results as JUnit's XML, for continuous integration. Times in seconds.

local failure = require "limax.base.failure"
local host = require "limax.host"
local lines = require "limax.tools.test.lines"

local junit = {}

local methods = {}
methods.__index = methods

local ENTITIES = { ["&"] = "&amp;", ["<"] = "&lt;", [">"] = "&gt;", ['"'] = "&quot;" }

-- XML 1.0 allows no other control characters.
local function escaped(text)
  text = lines.valid_text(text):gsub("[%z\1-\8\11\12\14-\31\127]+", "?")
  return (text:gsub('[&<>"]', ENTITIES))
end

function methods:begin() end

function methods:start() end

function methods:file(file)
  self.current = { path = file.path, cases = {}, failed = 0, skipped = 0, seconds = 0 }
  table.insert(self.files, self.current)
  if file.failure then
    self:case("failed", file.path, "loads", 0, ('      <error message="does not load">%s</error>\n')
      :format(escaped(file.failure)))
  end
end

-- Adds a test case to the current file.
function methods:case(status, suite, name, seconds, inner)
  local file = self.current
  file.seconds = file.seconds + seconds
  if file[status] then file[status] = file[status] + 1 end
  table.insert(file.cases, ('    <testcase classname="%s" name="%s" time="%.3f">\n%s'
    .. "    </testcase>\n"):format(escaped(suite), escaped(name), seconds, inner))
end

function methods:result(instance, result)
  local inner = ""
  if result.status == "failed" then
    inner = ('      <failure message="%s">%s</failure>\n'):format(
      escaped(result.text:match "^[^\n]*"),
      escaped((result.where and result.where .. ": " or "") .. result.text))
  elseif result.status == "skipped" then
    inner = ('      <skipped message="%s"/>\n'):format(escaped(result.text))
  end
  if result.notes[1] then
    inner = ("%s      <system-out>%s</system-out>\n"):format(inner,
      escaped(table.concat(result.notes, "\n")))
  end
  self:case(result.status, instance.suite, instance.label, result.seconds, inner)
end

function methods:write(status)
  local parts = { '<?xml version="1.0" encoding="UTF-8"?>\n<testsuites name="limax test">\n' }
  for _, file in ipairs(self.files) do
    parts[#parts + 1] = ('  <testsuite name="%s" tests="%d" failures="%d" skipped="%d" '
      .. 'time="%.3f">\n%s  </testsuite>\n'):format(escaped(file.path), #file.cases, file.failed,
      file.skipped, file.seconds, table.concat(file.cases))
  end
  parts[#parts + 1] = "</testsuites>\n"
  local fine, message = host.file.write_atomic(self.path, table.concat(parts))
  if not fine then failure.raise(status, "--junit: " .. message) end
end

function methods:finish() self:write(1) end

--- A reporter that writes the file at the end, and an empty one before the tests run: a path that
--- cannot be written fails early, and no results of an earlier run remain.
function junit.reporter(path)
  local self = setmetatable({ path = path, files = {} }, methods)
  self:write(2)
  return self
end

return junit
