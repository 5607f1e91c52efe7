--- repl_prompt.lua: `limax repl` at a terminal: transcripts (transcripts/*.txt), the start-up file,
--- Ctrl-C, the history, Tab.

local complete = require "limax.tools.repl.complete"
local host = require "limax.host"
local names = require "limax.tools.repl.names"
local process = require "support.process"
local typed = require "support.typed"
require "limax.tools.repl.words"

local suite = require("limax.test").suite "repl prompt"

local transcripts = host.home .. "/tests/support/transcripts"

for _, name in ipairs(host.file.list(transcripts)) do
  suite:test("transcript " .. name, function(t) typed.transcript(t, transcripts .. "/" .. name) end)
end

local prompt, leave = { keys = "", ends = ">" }, { keys = "\4" }
local function line(text) return { keys = text .. "\n", ends = ">", breaks = true } end
local stop = { keys = "\3", ends = ">", breaks = true } -- Ctrl-C
-- A line of which `shown` is printed, and which does not end; the typed text does not contain it.
local function endless(text, shown)
  return { keys = ("io.write('%s' .. '%s') io.stdout:flush() %s\n"):format(shown:sub(1, 2),
    shown:sub(3), text), ends = shown, breaks = true }
end

suite:test("the start-up file runs before the first prompt", function(t)
  local folder = t:folder()
  host.file.mkdir(folder .. "/config/limax")
  process.write(folder .. "/config/limax/repl.lua", "local from_start = 'here'\n")
  local done = typed.run(t, { prompt, line "from_start", leave }, { folder = folder })
  t:equal(done.steps[2].lines, { "> from_start", '"here"', ">" })
  local bare = typed.run(t, { prompt, line "from_start", leave },
    { folder = folder, words = { "--bare" } })
  t:equal(bare.steps[2].lines[2], "input:1: undefined name 'from_start'")
  -- a failing one is reported
  process.write(folder .. "/config/limax/repl.lua", "error 'boo'\n")
  local failed = typed.run(t, { prompt, line "1", leave }, { folder = folder })
  t:ok(failed.steps[1].lines[1]:match "repl.lua:1: boo$", failed.steps[1].lines[1])
  t:equal(failed.steps[2].lines, { "> 1", "1", ">" })
end)

suite:test("Ctrl-C returns to the prompt and keeps names", function(t)
  local done = typed.run(t, { prompt, line "x = 3", endless("while true do end", "loop"), stop,
    line "error 'boo'", { keys = "half a line", ends = "> half a line" }, stop,
    { keys = "function f()\n", ends = "..", breaks = true }, stop,
    endless("jit.off() while true do pcall(tostring) end", "loop"), stop, line "x + 2", leave })
  for step, lines in pairs { [4] = { "loopinterrupted", ">" }, [7] = { "> half a line^C", ">" },
    [9] = { ".. ^C", ">" }, [11] = { "loopinterrupted", ">" }, [12] = { "> x + 2", "5", ">" } } do
    t:equal(table.concat(done.steps[step].lines, "\n"):gsub("%^Ci", "i"), table.concat(lines, "\n"))
  end
end)

suite:test("the terminal is restored at the end", function(t)
  local half = { keys = "half a li", ends = "> half a li" }
  local done = typed.run(t, { prompt, half, { keys = "", signal = 15 } })
  t:equal({ done.status, done.echo }, { -15, true })
  done = typed.run(t, { prompt, leave })
  t:equal({ done.status, done.echo }, { 0, true })
end)

suite:test("history keeps whole statements, readable only by the user", function(t)
  local folder = t:folder()
  local open = { keys = "for i = 1, 2 do\n", ends = "..", breaks = true }
  typed.run(t, { prompt, line "first = 1", open, line "end", line "first = 1", leave },
    { folder = folder })
  t:equal(process.read(folder .. "/state/limax/history"),
    "first = 1\nfor i = 1, 2 do\\nend\nfirst = 1\n")
  t:equal(process.output("stat -c %a " .. process.quote(folder .. "/state/limax/history")), "600\n")
  local up = "\16" -- Ctrl-P
  local second = typed.run(t, { prompt, { keys = up, ends = "> first = 1" },
    { keys = up, ends = "end" }, { keys = "\n", ends = ">", breaks = true }, leave },
    { folder = folder })
  t:equal(second.steps[3].lines, { "> for i = 1, 2 do", "end" })
end)

suite:test("completions", function(t)
  local environment = names.environment
  environment.walker = require("limax").robot { voxels = "ecs" }
  environment.mine = setmetatable({ first = 1, act = function() end },
    { __index = { inherited = 2, deed = function() end } })
  local function found(text) return table.concat((complete.words(text)), " ") end
  environment.several = { { walker = environment.walker } }
  for text, expected in pairs { wal = "walker", ["several[1].walker:ed"] = "edit",
    ["several[wal"] = "walker", ["mine."] = "act deed first inherited", ["mine:"] = "act deed",
    ["walker:"] = "begin edit modes replay save simulate table", ["walker.bo"] = "body",
    ["?undersamp"] = "undersampled", ["?limax.robo"] = "robot", ["string.for"] = "format",
    ["'text .. wal"] = "", ["nothing.at."] = "", ["a..wal"] = "" } do
    t:equal({ text, found(text) }, { text, expected })
  end
end)
