--- trial.lua: small suites that `limax test` is tried on, and what it says of them.

local host = require "limax.host"

local trial = {}

--- The first line of each.
trial.HEAD = 'local suite = require("limax.test").suite "trial"\n'

--- Runs a command of this executable: its output, errors included, and its exit status.
---@param ... string its words
---@return string
---@return integer
function trial.timed(...)
  local words = {}
  for i, word in ipairs { host.executable, ... } do words[i] = "'" .. word .. "'" end
  local pipe = io.popen(table.concat(words, " ") .. " 2>&1; echo status $?")
  local text = pipe:read "*a"
  pipe:close()
  local output, status = text:match "^(.*)status (%d+)\n$"
  return output, tonumber(status)
end

--- The same, without what `limax test` says of times, which are the machine's.
---@param ... string its words
---@return string
---@return integer
function trial.limax(...)
  local output, status = trial.timed(...)
  local lines = {}
  for line in output:gmatch "[^\n]*\n?" do
    local word = line:match "^  (%a+) "
    if word == "ok" or word == "FAIL" or word == "skip" then
      line = line:gsub("  %d+%.%d s\n$", "\n")
    end
    lines[#lines + 1] = line
  end
  return (table.concat(lines):gsub("slowest:\n.-\n\n", "")), status
end

-- A suite file of these lines, in a folder of its own; line 1 of it is line 2 of the file.
function trial.file(t, lines, name)
  local path = ("%s/%s.lua"):format(t:folder(), name or "trial")
  local fine, message = host.file.write_atomic(path, trial.HEAD .. lines)
  t:ok(fine, message)
  return path
end

function trial.contains(t, text, part)
  t:ok(text:find(part, 1, true), ("expected %q in:\n%s"):format(part, text))
end

return trial
