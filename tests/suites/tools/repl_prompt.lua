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
-- Ctrl-C, after `wait` seconds
local function stop(wait) return { keys = "\3", ends = ">", breaks = true, wait = wait } end
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
  local done = typed.run(t, { prompt, line "x = 3", endless("while true do end", "loop"), stop(),
    line "error 'boo'", { keys = "half a line", ends = "> half a line" }, stop(),
    { keys = "function f()\n", ends = "..", breaks = true }, stop(),
    endless("jit.off() while true do pcall(tostring) end", "loop"), stop(), line "x + 2", leave })
  for step, lines in pairs { [4] = { "loopinterrupted", ">" }, [7] = { "> half a line^C", ">" },
    [9] = { ".. ^C", ">" }, [11] = { "loopinterrupted", ">" }, [12] = { "> x + 2", "5", ">" } } do
    t:equal(table.concat(done.steps[step].lines, "\n"):gsub("%^Ci", "i"), table.concat(lines, "\n"))
  end
end)

suite:test("after Ctrl-C a simulation can continue", function(t)
  local done = typed.run(t, { prompt, line 'robot = limax.robot { voxels = "ecs\\nece" }',
    line "walk = robot:begin { duration = 1e5 }", line "walk:step(10);",
    -- takes minutes
    endless("walk:finish()", "begun"), stop(2), line "before = walk.steps",
    line "before > 10", line "walk:step(5).steps - before", line "walk.status", leave })
  local screen = done.steps[6].lines
  t:equal(screen[#screen - 1], "begun^Cinterrupted")
  t:equal(done.steps[8].lines[2], "true")
  t:equal(done.steps[9].lines[2], "5")
  t:equal(done.steps[10].lines[2], '"running"')
end)

suite:test("a run that Ctrl-C interrupted continues to the same result", function(t)
  local fields = "f = { fitness = 'walk', lattice = { 4, 4, 4 }, population = 24, repetitions = 1,"
    .. " simulation = { duration = 3 } }"
  local same = "b.history[%d].best == a.history[%d].best and "
    .. "b.history[%d].evaluations == a.history[%d].evaluations"
  local done = typed.run(t, { prompt, line(fields), line "a = evolve(f, 2);",
    -- generations take half a second
    endless("b = evolve(f, 100)", "begun"), stop(1), line "b = _",
    line "while #b.history < 2 do evolve(b, 1) end", line((same:gsub("%%d", "1"))),
    line((same:gsub("%%d", "2"))), leave })
  local screen = done.steps[5].lines
  local summary = screen[#screen - 2]
  t:ok(summary:find "^the run so far is _ %(generations: %d+%); evolve%(_%) continues it$", summary)
  t:equal(screen[#screen - 1], "interrupted")
  t:equal(done.steps[8].lines[2], "true")
  t:equal(done.steps[9].lines[2], "true")
end)

suite:test("the terminal is restored at the end", function(t)
  local half = { keys = "half a li", ends = "> half a li" }
  local done = typed.run(t, { prompt, half, { keys = "", signal = 15 } })
  t:equal(done.status, -15)
  t:equal(done.echo, true)
  done = typed.run(t, { prompt, leave })
  t:equal(done.status, 0)
  t:equal(done.echo, true)
end)

suite:test("history keeps whole statements, readable only by the user", function(t)
  local folder = t:folder()
  local open = { keys = "for i = 1, 2 do\n", ends = "..", breaks = true }
  typed.run(t, { prompt, line "first = 1", open, line "end", line "first = 1", leave },
    { folder = folder })
  t:equal(process.read(folder .. "/state/limax/history"),
    "first = 1\nfor i = 1, 2 do\\nend\nfirst = 1\n")
  local mode = io.popen(("stat -c %%a %s"):format(process.quote(folder .. "/state/limax/history")))
  t:equal(mode:read "*l", "600")
  mode:close()
  local up = "\16" -- Ctrl-P
  local second = typed.run(t, { prompt, { keys = up, ends = "> first = 1" },
    { keys = up, ends = "end" }, { keys = "\n", ends = ">", breaks = true }, leave },
    { folder = folder })
  t:equal(second.steps[3].lines, { "> for i = 1, 2 do", "end" })
end)

suite:test("Tab completes and lists candidates at the terminal", function(t)
  local folder = t:folder()
  process.write(folder .. "/champion.json", "{}")
  local function tab(text, result) return { keys = text .. "\t", ends = "> " .. result } end
  local clear = { keys = "\21", ends = ">" } -- Ctrl-U
  local done = typed.run(t, { prompt, tab("lim", "limax"), tab(".exp", "limax.experiment"), clear,
    tab('limax.robot "cham', 'limax.robot "champion.json'), clear,
    { keys = "limax.scenes.s\t", ends = "> limax.scenes.s" },
    { keys = "\t", ends = "> limax.scenes.s", breaks = true }, clear, leave }, { folder = folder })
  t:equal(done.steps[8].lines[2], "slope stairs")
end)

suite:test("completions", function(t)
  local environment = names.environment
  environment.walker = require("limax").robot { voxels = "ecs" }
  environment.mine = setmetatable({ first = 1, act = function() end },
    { __index = { inherited = 2, deed = function() end } })
  local function found(text) return table.concat((complete.words(text)), " ") end
  t:equal(found "wal", "walker")
  environment.several = { { walker = environment.walker } }
  t:equal(found "several[1].walker:ed", "edit")
  t:equal(found "several[wal", "walker")
  t:equal(found "mine.", "act deed first inherited")
  t:equal(found "mine:", "act deed")
  t:equal(found "walker:", "begin edit modes replay save simulate table")
  t:equal(found "walker.bo", "body")
  t:equal(found "?undersamp", "undersampled")
  t:equal(found "?limax.robo", "robot")
  t:equal(found "string.for", "format")
  t:equal(found "'text .. wal", "")
  t:equal(found "nothing.at.", "")
  t:equal(found "a..wal", "")
end)
