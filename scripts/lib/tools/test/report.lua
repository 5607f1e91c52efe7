--- report.lua: the output of `limax test`: plain lines for people, lines of JSON for programs. A
--- reporter is a function that takes events: tables with `event` "begin", "file", "start" (of a
--- test), "test" (its result) and "end". Times in seconds.

local host = require "limax.host"
local shell = require "limax.base.shell"
local terminal = require "limax.base.terminal"

local report = {}

---@class limax.test_event
---@field event "begin"|"file"|"start"|"test"|"end"
---@field total integer|nil "begin": tests, and files that do not load
---@field path string|nil "file"
---@field failure string|nil "file": why it does not load
---@field suite string|nil "start", "test"
---@field test string|nil the test's name and its values of the matrix
---@field limit number|nil "start"
---@field status "passed"|"failed"|"skipped"|nil "test"
---@field text string|nil of a failure or the reason of a skip
---@field where string|nil FILE:LINE of a failed check
---@field notes string[]|nil "test"
---@field seconds number|nil "test"
---@field is_process boolean|nil "test": a process failed, and no test of the suite
---@field passed integer|nil "end": number of tests, like `failed` and `skipped`

-- A reporter with a function for each kind of event.
local function reporter(handlers)
  return function(event)
    if handlers[event.event] then handlers[event.event](event) end
  end
end

local function indented(text, margin)
  return margin .. (text:gsub("\n", "\n" .. margin))
end

local function title(event) return ("%s: %s"):format(event.suite, event.test) end

local function failure_text(event)
  return event.where and ("%s: %s"):format(event.where, event.text) or event.text
end

-- A text of valid UTF-8, which JSON needs: if it has other bytes, each run of bytes beyond
-- ASCII becomes a question mark.
local function valid_text(text)
  if pcall(host.json.encode, text) then return text end
  return (text:gsub("[\128-\255]+", "?"))
end
report.valid_text = valid_text

-- colours of the 256
local GREEN, RED, YELLOW = 34, 160, 136
local WORDS = {
  passed = { "ok  ", GREEN }, failed = { "FAIL", RED }, skipped = { "skip", YELLOW },
}
-- seconds; shorter times are not printed
local NOTABLE = 0.1

--- Plain lines; the last is `N passed, N failed, N skipped`.
---@param quiet boolean|nil only failures, and the last line
---@param write fun(text: string)
function report.plain(quiet, write, style)
  local current, shown
  -- of the command that runs again what failed; a file that does not load runs as a whole
  local failed_files, only, whole = {}, {}, false

  local function show_file()
    if shown ~= current then write(current .. "\n") end
    shown = current
  end

  local function failed(one)
    if failed_files[#failed_files] ~= shell.path(current) then
      table.insert(failed_files, shell.path(current))
    end
    whole = whole or one == nil or one.is_process
    if one then table.insert(only, "--only " .. shell.quoted(title(one))) end
  end

  return reporter {
    file = function(file)
      current = file.path
      if not quiet or file.failure then show_file() end
      if not file.failure then return end
      failed(nil)
      write(("  %s does not load\n"):format(terminal.paint("FAIL", RED, style)))
      write(indented(file.failure, "        ") .. "\n")
    end,
    test = function(result)
      if result.status == "failed" then failed(result) end
      if quiet and result.status ~= "failed" then return end
      show_file()
      local word = WORDS[result.status]
      local line = ("  %s %s"):format(terminal.paint(word[1], word[2], style), title(result))
      if result.status == "skipped" then line = ("%s (%s)"):format(line, result.text) end
      if result.seconds >= NOTABLE then
        line = line .. terminal.dim(("  %.1f s"):format(result.seconds), style)
      end
      write(line .. "\n")
      if result.status == "failed" then
        write(indented(failure_text(result), "        ") .. "\n")
      end
      for _, note in ipairs(result.notes) do write(indented(note, "       # ") .. "\n") end
    end,
    ["end"] = function(counts)
      if shown then write "\n" end
      if failed_files[1] then
        write(("to run only what failed:\n  %s test %s%s\n\n"):format(shell.program(),
          table.concat(failed_files, " "), whole and "" or " " .. table.concat(only, " ")))
      end
      write(("%d passed, %d failed, %d skipped\n"):format(counts.passed, counts.failed,
        counts.skipped))
    end,
  }
end

local function valid(value)
  if type(value) == "string" then return valid_text(value) end
  if type(value) ~= "table" then return value end
  local copy = setmetatable({}, getmetatable(value))
  for key, entry in pairs(value) do copy[key] = valid(entry) end
  return copy
end

--- The events as lines of JSON.
---@param separator string before each
function report.json(write, separator)
  return function(event) write(separator .. host.json.encode(valid(event)) .. "\n") end
end

return report
