--- repl_prompt.lua: `limax repl` at a terminal: transcripts (transcripts/*.txt), the history, Tab.

local complete = require "limax.tools.repl.complete"
local host = require "limax.host"
local process = require "support.process"
local names = require "limax.tools.repl.names"
local typed = require "support.typed"
require "limax.tools.repl.words"

local suite = require("limax.test").suite "repl prompt"

local transcripts = host.home .. "/tests/support/transcripts"

for _, name in ipairs(host.file.list(transcripts)) do
  suite:test("transcript " .. name, function(t) typed.transcript(t, transcripts .. "/" .. name) end)
end

local prompt = { keys = "", ends = ">" }
local function line(text) return { keys = text .. "\n", ends = ">", breaks = true } end
local leave = { keys = "\4" }

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
  if not host.line_editor then return end
  local up = "\16" -- Ctrl-P
  local second = typed.run(t, { prompt, { keys = up, ends = "> first = 1" },
    { keys = up, ends = "end" }, { keys = "\n", ends = ">", breaks = true }, leave },
    { folder = folder })
  t:equal(second.steps[3].lines, { "> for i = 1, 2 do", "end" })
end)

suite:test("a long history is shortened to its newest entries", function(t)
  local folder = t:folder()
  local lines = {}
  for i = 1, 11001 do lines[i] = "x = " .. i .. "\n" end
  host.file.mkdir(folder .. "/state/limax")
  process.write(folder .. "/state/limax/history", table.concat(lines))
  typed.run(t, { prompt, line [["a\nb"]], leave }, { folder = folder })
  local kept = process.read(folder .. "/state/limax/history")
  if not host.line_editor then return end
  t:equal(select(2, kept:gsub("\n", "")), 10001)
  t:equal(kept:match "^[^\n]*", "x = 1002")
  t:equal(kept:match "([^\n]*)\n$", [["a\\nb"]])
end)

suite:test("a history that cannot be written is reported once", function(t)
  local folder = t:folder()
  process.write(folder .. "/state", "a file where a folder should be")
  local done = typed.run(t, { prompt, line "1", line "2", leave }, { folder = folder })
  local screen = table.concat(done.steps[1].lines, "\n")
  t:ok(screen:match "\nlimax: the history is not saved: ", screen)
  t:equal(done.steps[2].lines, { "> 1", "1", ">" })
  t:equal(done.steps[3].lines, { "> 2", "2", ">" })
end)

suite:test("a history that cannot be read is reported", function(t)
  local folder = t:folder()
  host.file.mkdir(folder .. "/state/limax/history")
  local done = typed.run(t, { prompt, line "1", leave }, { folder = folder })
  local screen = table.concat(done.steps[1].lines, "\n")
  t:ok(screen:match "\nlimax: the history is not saved: ", screen)
  t:equal(done.steps[2].lines, { "> 1", "1", ">" })
end)

suite:test("without libedit lines cannot be edited", function(t)
  if host.line_editor then t:skip "built with libedit" end
  local done = typed.run(t, { prompt, line "1 + 1", leave })
  t:ok(done.steps[1].lines[2]:match "^Built without libedit", done.steps[1].lines[2])
  t:equal(done.steps[2].lines, { "> 1 + 1", "2", ">" })
end)

-- ---- Tab ----------------------------------------------------------------------------------------

suite:test("Tab completes and lists candidates at the terminal", function(t)
  if not host.line_editor then t:skip "built without libedit" end
  local folder = t:folder()
  process.write(folder .. "/champion.json", "{}")
  local function tab(text, result) return { keys = text .. "\t", ends = "> " .. result } end
  local clear = { keys = "\21", ends = ">" } -- Ctrl-U
  typed.run(t, { prompt, tab("lim", "limax"), tab(".exp", "limax.experiment"), clear,
    tab("limax.scenes.st", "limax.scenes.stairs"), clear,
    tab('limax.robot "cham', 'limax.robot "champion.json'), clear,
    tab("limax.experiment { popul", "limax.experiment { population = "), clear,
    line 'walker = limax.robot { voxels = "ecs" }', tab("walker:ed", "walker:edit"), clear,
    leave }, { folder = folder })
  local shown = typed.run(t, { prompt, { keys = "limax.scenes.s\t", ends = "> limax.scenes.s" },
    { keys = "\t", ends = "> limax.scenes.s", breaks = true }, clear, leave }, { folder = folder })
  t:equal(shown.steps[3].lines[2], "slope   stairs")
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
  t:equal(found "several[1].wal", "walker")
  t:equal(found "several[wal", "walker")
  t:equal(found "mine.", "act deed first inherited")
  t:equal(found "mine:", "act deed")
  t:equal(found "walker:", "begin edit replay save simulate table")
  t:equal(found "walker.bo", "body")
  t:equal(found "walker:simulate({ dur", "duration = ")
  t:equal(found "walker:simulate { duration = 1, scene = { grav", "gravity = ")
  t:equal(found "walker:simulate { scene = { ground = { sti", "stiffness = ")
  -- over several lines, after other entries, without those that are assigned
  t:equal(found "limax.experiment {\n  fitness = 'walk',\n  breeding = { mutation_rate = 0.1, mut",
    "mutation_scale = ")
  t:equal(found 'walker:simulate { accuracy = "pre', "preview")
  t:equal(found "robot:distance { ax", "axis = ")
  t:equal(found "limax.scenes.slope { an", "anchors =  angle = ")
  t:equal(found "compare(walker, 'cpu', { prec", "precision = ")
  t:equal(found "limax.robot { fit", "")
  -- words of a field, an argument or a trace
  t:equal(found 'limax.experiment { fitness = "wal', "walk")
  t:equal(found 'limax.experiment { supervisor = { "sched', "schedule")
  t:equal(found 'limax.experiment { simulation = { integrator = "leap', "leapfrog")
  t:equal(found 'compare(walker, "cu', "cuda")
  environment.walked = environment.walker:simulate { duration = 0.1, settle = 0,
    record = { strain = 20, contact = 20 } }
  t:equal(found 'walked:trace "', "contact strain")
  t:equal(found 'walked:trace("con', "contact")
  t:equal(found "?undersamp", "undersampled")
  t:equal(found "?limax.robo", "robot")
  t:equal(found "string.for", "format")
  t:equal(found "'text .. wal", "")
  t:equal(found "-- wal", "")
  t:equal(found "nothing.at.", "")
  t:equal(found "a..wal", "")
end)
