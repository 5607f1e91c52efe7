--- trial.lua: runs `limax test` on small suites.

local host = require "limax.host"
local process = require "support.process"
local shell = require "limax.base.shell"

local trial = {}

--- The first line of each suite file.
trial.HEAD = 'local suite = require("limax.test").suite "trial"\n'

--- Runs a command of this executable: its output with errors, and its exit status.
---@param words string[] arguments
---@param before string|nil shell text before the command
---@return string
---@return integer
function trial.run(words, before)
  local list = { before or "", shell.quoted(host.executable) }
  for _, word in ipairs(words) do list[#list + 1] = shell.quoted(word) end
  local text = process.output(table.concat(list, " ") .. " 2>&1 </dev/null; echo status $?")
  local output, status = text:match "^(.*)status (%d+)\n$"
  return output, tonumber(status)
end

--- The same, without the times that `limax test` prints.
---@param ... string arguments
---@return string
---@return integer
function trial.limax(...)
  local output, status = trial.run { ... }
  local lines = {}
  for line in output:gmatch "[^\n]*\n?" do
    local word = line:match "^  (%a+) "
    if word == "ok" or word == "FAIL" or word == "skip" then
      line = line:gsub("  %d+%.%d s\n$", "\n")
    end
    lines[#lines + 1] = line
  end
  return table.concat(lines), status
end

--- Writes suite files into a new folder, by name; line 1 of a text is line 2 of its file.
---@param texts table<string, string>
---@return string folder
function trial.files(t, texts)
  local folder = t:folder()
  for name, text in pairs(texts) do
    assert(host.file.write_atomic(("%s/%s.lua"):format(folder, name), trial.HEAD .. text))
  end
  return folder
end

--- Writes one suite file.
---@return string path
function trial.file(t, text) return trial.files(t, { trial = text }) .. "/trial.lua" end

--- Fails unless a text contains every part.
---@param ... string
function trial.contains(t, text, ...)
  for _, part in ipairs { ... } do
    t:ok(text:find(part, 1, true), ("expected %q in:\n%s"):format(part, text))
  end
end

return trial
