--- report.lua: what `limax test` prints: plain lines for people, or TAP version 13 for programs.

local terminal = require "limax.terminal"

local report = {}

-- colours of the 256
local GREEN, RED, YELLOW = 34, 160, 136
local WORDS = {
  passed = { "ok  ", GREEN }, failed = { "FAIL", RED }, skipped = { "skip", YELLOW },
}

local function indented(text, margin)
  return margin .. (text:gsub("\n", "\n" .. margin))
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
    self:show_file()
    self.write(("  %s does not load\n"):format(terminal.paint("FAIL", RED, self.style)))
    self.write(indented(file.failure, "        ") .. "\n")
  end
end

function plain:result(instance, result)
  if self.quiet and result.status ~= "failed" then return end
  self:show_file()
  local word = WORDS[result.status]
  local line = ("  %s %s: %s"):format(terminal.paint(word[1], word[2], self.style), instance.suite,
    instance.label)
  if result.status == "skipped" then line = ("%s (%s)"):format(line, result.text) end
  if result.seconds >= 0.1 then
    line = line .. terminal.dim(("  %.1f s"):format(result.seconds), self.style)
  end
  self.write(line .. "\n")
  if result.status == "failed" then
    local text = result.where and ("%s: %s"):format(result.where, result.text) or result.text
    self.write(indented(text, "        ") .. "\n")
  end
  for _, note in ipairs(result.notes) do self.write(indented(note, "       # ") .. "\n") end
end

function plain:finish(counts)
  if self.shown then self.write "\n" end
  self.write(("%d passed, %d failed, %d skipped\n"):format(counts.passed, counts.failed,
    counts.skipped))
end

--- Plain lines; the last is `N passed, N failed, N skipped`.
---@param quiet boolean|nil failures alone, and the last line
---@param write fun(text: string)
---@param style limax.terminal.style
function report.plain(quiet, write, style)
  return setmetatable({ quiet = quiet, write = write, style = style }, plain)
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

function tap:result(instance, result)
  local name = ("%s: %s"):format(instance.suite, instance.label)
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

return report
