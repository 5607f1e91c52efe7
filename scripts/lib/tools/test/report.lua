--- report.lua: what `limax test` prints: plain lines for people, or TAP version 13 for programs. A
--- reporter is told of each file, of each test before and after it ran, and of the end.

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

-- how many of the slowest tests are named
local SLOWEST = 10
-- seconds below which a test's time is not worth a word
local NOTABLE = 0.1

-- ---- the failures again ------------------------------------------------------------------------

local again = {}
again.__index = again

--- Remembers a test that failed, or a file that does not load.
---@param file { path: string }
---@param instance limax.test_instance|nil
function again:add(file, instance)
  if not self.seen[file.path] then
    self.seen[file.path] = true
    table.insert(self.files, shell.path(file.path))
  end
  -- the end of a process has no name to be chosen by: its whole file runs again
  if instance and instance.is_process then self.whole = true end
  if instance then table.insert(self.only, "--only " .. shell.quoted(runner.title(instance))) end
end

--- The command line that runs nothing else; nil where nothing failed.
---@return string|nil
function again:line()
  if not self.files[1] then return nil end
  local words = { shell.program(), "test", table.concat(self.files, " ") }
  if self.only[1] and not self.whole then words[4] = table.concat(self.only, " ") end
  return table.concat(words, " ")
end

--- Begins a list of what failed.
function report.again() return setmetatable({ files = {}, only = {}, seen = {} }, again) end

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
    self.again:add(file)
    self:show_file()
    self.write(("  %s does not load\n"):format(terminal.paint("FAIL", RED, self.style)))
    self.write(indented(file.failure, "        ") .. "\n")
  end
end

function plain:start() end

function plain:result(instance, result)
  if result.status == "failed" then self.again:add({ path = self.current }, instance) end
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
    local text = result.where and ("%s: %s"):format(result.where, result.text) or result.text
    self.write(indented(text, "        ") .. "\n")
  end
  for _, note in ipairs(result.notes) do self.write(indented(note, "       # ") .. "\n") end
end

-- The ten tests that took longest, of those whose time is worth a line.
function plain:slowest()
  table.sort(self.times, function(a, b) return a.seconds > b.seconds end)
  local lines = {}
  for i = 1, math.min(SLOWEST, #self.times) do
    local one = self.times[i]
    if one.seconds < NOTABLE then break end
    lines[i] = ("%7.1f s  %s\n"):format(one.seconds, one.title)
  end
  -- one line would repeat what stands above
  if #lines > 1 then self.write("slowest:\n" .. table.concat(lines) .. "\n") end
end

function plain:finish(counts)
  if self.shown then self.write "\n" end
  if not self.quiet then self:slowest() end
  local line = self.again:line()
  if line then self.write(("what failed, alone:\n  %s\n\n"):format(line)) end
  self.write(("%d passed, %d failed, %d skipped\n"):format(counts.passed, counts.failed,
    counts.skipped))
end

--- Plain lines; the last is `N passed, N failed, N skipped`.
---@param quiet boolean|nil failures alone, and the last line
---@param write fun(text: string)
---@param style limax.terminal.style
function report.plain(quiet, write, style)
  return setmetatable({ quiet = quiet, write = write, style = style, times = {},
    again = report.again() }, plain)
end

-- ---- TAP ---------------------------------------------------------------------------------------

local tap = {}
tap.__index = tap

-- a '#' would begin a directive, and a description is one line
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
    self:detail(result.where and ("%s: %s"):format(result.where, result.text) or result.text)
  end
  for _, note in ipairs(result.notes) do self.write(indented(note, "# ") .. "\n") end
end

function tap:finish() end

--- TAP version 13.
---@param write fun(text: string)
function report.tap(write) return setmetatable({ write = write }, tap) end

-- ---- several at a time -------------------------------------------------------------------------

local both = {}
both.__index = both

for _, event in ipairs { "begin", "file", "start", "result", "finish" } do
  both[event] = function(self, ...)
    for _, reporter in ipairs(self) do reporter[event](reporter, ...) end
  end
end

--- Tells several reporters the same.
---@param reporters table[]
function report.all(reporters) return setmetatable(reporters, both) end

return report
