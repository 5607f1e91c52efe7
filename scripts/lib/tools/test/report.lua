--- report.lua: what `limax test` prints: plain lines for people, or TAP version 13 for programs. A
--- reporter has the methods begin, file, start, result and finish.

local runner = require "limax.tools.test.runner"
local shell = require "limax.base.shell"
local terminal = require "limax.base.terminal"

local report = {}

-- colours of the 256
local GREEN, RED, YELLOW = 34, 160, 136
local WORDS = {
  passed = { "ok  ", GREEN }, failed = { "FAIL", RED }, skipped = { "skip", YELLOW },
}

local function indented(text, margin)
  return margin .. (text:gsub("\n", "\n" .. margin))
end

-- the slowest tests that are listed
local SLOWEST = 10
-- seconds; shorter times are not printed
local NOTABLE = 0.1

local function failure_text(result)
  return result.where and ("%s: %s"):format(result.where, result.text) or result.text
end

-- ---- plain -------------------------------------------------------------------------------------

local plain = {}
plain.__index = plain

function plain:begin() end

function plain:show_file()
  if self.shown == self.current then return end
  self.shown = self.current
  self.write(self.current .. "\n")
end

function plain:file(file)
  self.current = file.path
  if not self.quiet then self:show_file() end
  if file.failure then
    self:remember(nil)
    self:show_file()
    self.write(("  %s does not load\n"):format(terminal.paint("FAIL", RED, self.style)))
    self.write(indented(file.failure, "        ") .. "\n")
  end
end

function plain:start() end

-- Keeps a failed test, or a file that does not load, for the line that runs them again.
function plain:remember(instance)
  if self.failed_files[#self.failed_files] ~= shell.path(self.current) then
    table.insert(self.failed_files, shell.path(self.current))
  end
  -- without a test that can be chosen, whole files run again
  if not instance or instance.is_process then self.whole = true end
  if instance then table.insert(self.only, "--only " .. shell.quoted(runner.title(instance))) end
end

function plain:result(instance, result)
  if result.status == "failed" then self:remember(instance) end
  table.insert(self.times, { seconds = result.seconds, title = runner.title(instance) })
  if self.quiet and result.status ~= "failed" then return end
  self:show_file()
  local word = WORDS[result.status]
  local line = ("  %s %s"):format(terminal.paint(word[1], word[2], self.style),
    runner.title(instance))
  if result.status == "skipped" then line = ("%s (%s)"):format(line, result.text) end
  if result.seconds >= NOTABLE then
    line = line .. terminal.dim(("  %.1f s"):format(result.seconds), self.style)
  end
  self.write(line .. "\n")
  if result.status == "failed" then
    self.write(indented(failure_text(result), "        ") .. "\n")
  end
  for _, note in ipairs(result.notes) do self.write(indented(note, "       # ") .. "\n") end
end

function plain:slowest()
  table.sort(self.times, function(a, b) return a.seconds > b.seconds end)
  local lines = {}
  for i = 1, math.min(SLOWEST, #self.times) do
    local one = self.times[i]
    if one.seconds < NOTABLE then break end
    lines[i] = ("%7.1f s  %s\n"):format(one.seconds, one.title)
  end
  -- one line would repeat the one above
  if #lines > 1 then self.write("slowest:\n" .. table.concat(lines) .. "\n") end
end

function plain:finish(counts)
  if self.shown then self.write "\n" end
  if not self.quiet then self:slowest() end
  if self.failed_files[1] then
    self.write(("to run only what failed:\n  %s test %s%s\n\n"):format(shell.program(),
      table.concat(self.failed_files, " "),
      self.whole and "" or " " .. table.concat(self.only, " ")))
  end
  self.write(("%d passed, %d failed, %d skipped\n"):format(counts.passed, counts.failed,
    counts.skipped))
end

--- Plain lines; the last is `N passed, N failed, N skipped`.
---@param quiet boolean|nil only failures, and the last line
---@param write fun(text: string)
function report.plain(quiet, write, style)
  return setmetatable({ quiet = quiet, write = write, style = style, times = {},
    failed_files = {}, only = {} }, plain)
end

-- ---- TAP ---------------------------------------------------------------------------------------

local tap = {}
tap.__index = tap

-- one line; a '#' would begin a directive
local function description(text) return (text:gsub("[\r\n]+", " "):gsub("#", "\\#")) end

function tap:begin(total)
  self.number = 0
  self.write(("TAP version 13\n1..%d\n"):format(total))
end

function tap:line(fine, name, directive)
  self.number = self.number + 1
  self.write(("%sok %d - %s%s\n"):format(fine and "" or "not ", self.number, description(name),
    directive or ""))
end

function tap:detail(text)
  self.write("  ---\n  message: |\n" .. indented(text, "    ") .. "\n  ...\n")
end

function tap:file(file)
  self.write(("# %s\n"):format(file.path))
  if file.failure then
    self:line(false, file.path .. " does not load")
    self:detail(file.failure)
  end
end

function tap:start() end

function tap:result(instance, result)
  local name = runner.title(instance)
  local skipped = result.status == "skipped"
  local directive = skipped and " # SKIP " .. result.text:gsub("[\r\n]+", " ") or nil
  self:line(result.status ~= "failed", name, directive)
  if result.status == "failed" then
    self:detail(failure_text(result))
  end
  for _, note in ipairs(result.notes) do self.write(indented(note, "# ") .. "\n") end
end

function tap:finish() end

--- TAP version 13.
function report.tap(write) return setmetatable({ write = write }, tap) end

-- ---- several at a time -------------------------------------------------------------------------

local both = {}
both.__index = both

for _, event in ipairs { "begin", "file", "start", "result", "finish" } do
  both[event] = function(self, ...)
    for _, reporter in ipairs(self) do reporter[event](reporter, ...) end
  end
end

--- Passes all events to several reporters.
function report.all(reporters) return setmetatable(reporters, both) end

return report
