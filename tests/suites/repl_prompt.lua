--- repl_prompt.lua: `limax repl` at a terminal: transcripts (transcripts/*.txt), the history, Tab.

local host = require "limax.host"
local process = require "support.process"
local typed = require "support.typed"

local suite = require("limax.test").suite "repl prompt"

local transcripts = host.home .. "/tests/suites/transcripts"

for _, name in ipairs(host.file.list(transcripts)) do
  suite:test("transcript " .. name, function(t) typed.transcript(t, transcripts .. "/" .. name) end)
end

local prompt = { keys = "", ends = ">" }
local function line(text) return { keys = text .. "\n", ends = ">", breaks = true } end
local leave = { keys = "\4" }

suite:test("history is kept between starts, whole statements, for its user alone", function(t)
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

suite:test("a history that cannot be written is said once", function(t)
  local folder = t:folder()
  process.write(folder .. "/state", "a file where a folder should be")
  local done = typed.run(t, { prompt, line "1", line "2", leave }, { folder = folder })
  t:ok(done.steps[1].lines[2]:match "^limax: the history is not kept: ", done.steps[1].lines[2])
  t:equal(done.steps[2].lines, { "> 1", "1", ">" })
  t:equal(done.steps[3].lines, { "> 2", "2", ">" })
end)
