--- repl_start.lua: start and end of `limax repl`: -e, -l, -i, files, the start-up file; followed
--- scripts; Ctrl-C.

local host = require "limax.host"
local process = require "support.process"
local typed = require "support.typed"

local suite = require("limax.test").suite "repl start"

local prompt, leave = { keys = "", ends = ">" }, { keys = "\4" }
local function line(text) return { keys = text .. "\n", ends = ">", breaks = true } end

-- The output of `limax repl` with these words without a terminal, and its status.
local function run(folder, words, input)
  process.write(folder .. "/input", input or "")
  local pipe = io.popen(("cd %s; HOME=%s XDG_CONFIG_HOME= %s repl %s <input 2>&1; echo status $?")
    :format(process.quote(folder), process.quote(folder), process.quote(host.executable), words))
  local output = pipe:read "*a"
  pipe:close()
  return output
end

suite:test("-e runs a line, -l loads a module, names of a file remain", function(t)
  local folder = t:folder()
  process.write(folder .. "/mine.lua",
    "local answer = 42\nlocal function twice(x) return 2 * x end\n")
  process.write(folder .. "/wrong.lua", "local x = 1\nerror 'boo'\n")
  t:equal(run(folder, "-e '1 + 1' -e 'x = 3; x = x + 1' -e x -e 'x;'"), "2\n4\nstatus 0\n")
  t:equal(run(folder, "mine.lua -e 'twice(answer)'"), "84\nstatus 0\n")
  process.write(folder .. "/value.lua", "return { 7 }\n")
  t:equal(run(folder, "value.lua -e '_[1]'"), "7\nstatus 0\n")
  t:equal(run(folder, "-l limax.scenes -e 'scenes.land().ground'"), "true\nstatus 0\n")
  t:equal(run(folder, "-e nothing_at_all -e 2"),
    "input:1: undefined name 'nothing_at_all'\n  input:1: in main chunk\nstatus 1\n")
  t:equal(run(folder, "-e 'for i = 1, 2 do'"),
    "input:1: the statement that begins here is not complete\nstatus 1\n")
  t:ok(run(folder, "wrong.lua"):match "wrong.lua:2: boo\n.*status 1\n$")
  t:ok(run(folder, "missing.lua"):match "there is no file missing.lua\nstatus 2\n$")
  t:ok(run(folder, "-l no.such.module"):match "module 'no.such.module' not found.*status 1\n$")
  -- -i continues with the input
  t:equal(run(folder, "-i -e 'x = 5'", "x\n"), "5\nstatus 0\n")
  -- without a terminal the start-up file does not run
  host.file.mkdir(folder .. "/.config/limax")
  process.write(folder .. "/.config/limax/repl.lua", "print 'started'\n")
  t:equal(run(folder, "", "1\n"), "1\nstatus 0\n")
end)

suite:test("the prompt in README runs", { limit = 60 }, function(t)
  local folder, lines, inside = t:folder(), {}, false
  for line_of_page in process.read(host.home .. "/README.md"):gmatch "[^\n]*" do
    if line_of_page:match "^## " then inside = line_of_page == "## The prompt" end
    lines[#lines + 1] = inside and line_of_page:match "^> (.*)$" or nil
  end
  t:ok(#lines >= 8, "README has lines of a prompt")
  local output = run(folder, "", table.concat(lines, "\n") .. "\n")
  t:ok(output:match "status 0\n$", output)
  t:ok(output:match "generation 4: best", output)
  t:ok(process.read(folder .. "/picture-1.svg"):match "<svg", "a picture was drawn")
end)

suite:test("--help lists the options", function(t)
  local text = run(t:folder(), "--help")
  for _, word in ipairs { "--execute CODE", "--load MODULE", "--interactive", "--bare", "?name" } do
    t:ok(text:find(word, 1, true), word)
  end
end)

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

suite:test("a followed script runs again after a change and keeps its table", function(t)
  local folder = t:folder()
  process.write(folder .. "/mine.lua",
    "local top = 1\nreturn { answer = 1, gone = true, ask = function() return 1 end }\n")
  local output = run(folder, "", [[
function save(text) local f = io.open("mine.lua", "w") f:write(text) f:close() end
m = follow "mine.lua"
held = m
save "local top = 2; return { answer = 2 }"
held.answer, held.gone, top
save "local top = = 3"
held.answer, top
save "local top = 4; return { answer = 4 }"
held.answer, top, m == held
follow "none.lua"
]]):gsub("[^\n ]*/mine.lua", "mine.lua")
  t:equal(output, [[
reloaded: mine.lua
2	nil	2
mine.lua:1: unexpected symbol near '='
2	2
reloaded: mine.lua
4	4	true
there is no file none.lua
  input:10: in main chunk
status 1
]])
end)

suite:test("a changed script runs at the idle prompt, and the typed line remains", function(t)
  if not host.line_editor then t:skip "built without libedit" end
  local folder = t:folder()
  process.write(folder .. "/mine.lua", "top = 1\n")
  local half = "> top + to"
  local function change(text, ends)
    return { keys = "", file = "mine.lua", text = text, ends = ends, breaks = true }
  end
  local done = typed.run(t, { prompt, line 'follow "mine.lua"', { keys = "top + to", ends = half },
    change("top = 21 print 'hello'\n", half), { keys = "p\n", ends = ">", breaks = true },
    -- Ctrl-C stops an endless one
    change("io.write 'loop' io.stdout:flush() while true do end\n", "loop"),
    { keys = "\3", ends = ">", breaks = true },
    line "top", leave }, { folder = folder })
  t:equal(done.steps[4].lines[2], "hello")
  t:ok(done.steps[4].lines[3]:match "^reloaded: ")
  t:equal(done.steps[5].lines[2], "42")
  t:equal(done.steps[8].lines[2], "21")
end)

suite:test("a reloaded module keeps its table", function(t)
  local folder = t:folder()
  process.write(folder .. "/part.lua", "return { answer = 1, gone = true }\n")
  t:equal(run(folder, "", [[
part = require "part"
held = part
do local f = io.open("part.lua", "w") f:write("return { answer = 2 }") f:close() end
reload "part" == held, held.answer, held.gone
do local f = io.open("part.lua", "w") f:write("return {{ answer = 3") f:close() end
pcall(reload, "part")
package.loaded.part == held, held.answer
]]):gsub("false\n.-<eof>'\n", "refused\n"), "true\t2\tnil\nrefused\ntrue\t2\nstatus 0\n")
end)

suite:test("after Ctrl-C a simulation can continue", function(t)
  local done = typed.run(t, { prompt, line 'robot = limax.robot { voxels = "ecs\\nece" }',
    line "walk = robot:begin { duration = 1e5 }", line "walk:step(10);",
    -- takes minutes
    { keys = "io.write('be' .. 'gun') io.stdout:flush() walk:finish()\n", ends = "begun",
      breaks = true },
    { keys = "\3", ends = ">", breaks = true, wait = 2 }, line "before = walk.steps",
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
    { keys = "io.write('be' .. 'gun') io.stdout:flush() b = evolve(f, 100)\n", ends = "begun",
      breaks = true },
    { keys = "\3", ends = ">", breaks = true, wait = 1 }, line "b = _",
    line "while #b.history < 2 do evolve(b, 1) end", line((same:gsub("%%d", "1"))),
    line((same:gsub("%%d", "2"))), leave })
  local screen = done.steps[5].lines
  local summary = screen[#screen - 2]
  t:ok(summary:find "^the run so far is _ %(generations: %d%); evolve%(_%) continues it$", summary)
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

suite:test("a picture of a robot in motion, shown by a program", function(t)
  local folder = t:folder()
  process.write(folder .. "/viewer.sh", "#!/bin/sh\necho \"$2\" >shown.part\nmv shown.part shown\n")
  os.execute("chmod +x " .. process.quote(folder .. "/viewer.sh"))
  process.write(folder .. "/input", [[
walk = limax.robot { voxels = "ecs\nece" }:begin { duration = 1 }
picture(walk, "now.svg");
walk:go(0.7); picture(walk, "later.svg", { open = true, title = "later & on" });
picture(walk, "never.svg", { duration = 3 })
]])
  local pipe = io.popen(("cd %s; BROWSER=%s HOME=. %s repl <input 2>&1"):format(
    process.quote(folder), process.quote(folder .. "/viewer.sh --new"),
    process.quote(host.executable)))
  local screen = pipe:read "*a"
  pipe:close()
  t:ok(screen:find("input:4: picture.duration: unknown field; known are: open, title", 1, true),
    screen)
  local now, later = process.read(folder .. "/now.svg"), process.read(folder .. "/later.svg")
  -- at rest, and 0.7 s later: the faces have moved
  t:ok(now:find("-0.50 s", 1, true) and later:find("0.20 s", 1, true), now)
  local function faces(text)
    local list = {}
    for face in text:gmatch "<polygon.->" do list[#list + 1] = face end
    return list
  end
  t:ok(#faces(now) >= 10 and #faces(later) >= 10, now)
  t:ok(table.concat(faces(now)) ~= table.concat(faces(later)))
  t:ok(later:find("later &amp; on", 1, true), later)
  local start = host.clock()
  while process.read(folder .. "/shown") == "" and host.clock() - start < process.LATE do
    host.wait(0.02)
  end
  t:ok(process.read(folder .. "/shown"):find "/later.svg\n$")
end)
