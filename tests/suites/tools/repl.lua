--- repl.lua: `limax repl` without a terminal: piped text, -e, -l, -i, files; how values are shown.

local array_text = require "limax.tools.repl.array_text"
local host = require "limax.host"
local process = require "support.process"
local show = require "limax.tools.repl.show"
local tokens = require "limax.tools.repl.tokens"

local suite = require("limax.test").suite "repl"

-- The output of `limax repl` with these words without a terminal, and its status.
local function run(folder, words, input)
  process.write(folder .. "/input", input or "")
  return process.output(('cd %s; HOME="$PWD" XDG_CONFIG_HOME= %s repl %s <input 2>&1; '
    .. 'echo status $?'):format(process.quote(folder), process.quote(host.executable), words))
end

suite:test("statements of many lines are run when they are complete", function(t)
  local lines = { "t = {" }
  for i = 1, 300 do lines[#lines + 1] = ('  { %d, "]%d" }, -- } end'):format(i, i) end
  t:equal(run(t:folder(), "", table.concat(lines, "\n") .. [==[

}
#t, t[300][1];
#t, t[300][1]
s = [[
one { ( do
]]
#s
x =
  5
x --[[ a comment (
of two lines ]] + 1
if x == 5 then -- end
  print "five"
end
repeat x = x + 1
until x > 6
x, nil
]==]), "300\t300\n11\n6\nfive\n7\tnil\nstatus 0\n")
end)

suite:test("statements that end in an expression show its value", function(t)
  t:equal(run(t:folder(), "", [==[
local x = { 1, 2 }; x[1], x[2]
x[1] = 5; x[1] + 1
y = 3 x[1]
x[1] = 6; x[1];
print(x[1]); --[[ a comment; ]] "end" -- another
for i = 1, 2 do
  x
    [1] = i; end
local function f() return 8 end; 1 - f() -- last
]==]), "1\t2\n6\n5\n6\n\"end\"\n-7\nstatus 0\n")
  -- the error has its own line
  t:equal(run(t:folder(), "", "x = {}; x.a.b\nprint 'not reached'\n"),
    "input:1: attempt to index field 'a' (a nil value)\n  input:1: in main chunk\nstatus 1\n")
  t:equal(run(t:folder(), "", "x = 1 2\n"), "input:1: unexpected symbol near '2'\nstatus 1\n")
end)

suite:test("without a terminal the first error ends with status 1", function(t)
  for input, output in pairs {
    ["error 'boo'\nprint 'not reached'\n"] = "input:1: boo\n  input:1: in main chunk\n",
    ["print(1)\nunknown\n"] = "1\ninput:2: undefined name 'unknown'\n  input:2: in main chunk\n",
    -- line numbers are those of the piped text
    ["\239\187\191print(1)\n\nfunction f()\n  boom()\nend\nf()\n"] = "1\n"
      .. "input:4: undefined name 'boom'\n  input:4: in function 'f'\n  input:6: in main chunk\n",
    ["x = 1\nfor i = 1, 2 do\n  boom()\nend\n"] = "input:3: undefined name 'boom'\n"
      .. "  3 |   boom()\n  input:3: in main chunk\n",
    ["x = = 1\n"] = "input:1: unexpected symbol near '='\n",
    ["f(\n  {\n  x = = 1\n"] = "input:3: unexpected symbol near '='\n  3 |   x = = 1\n",
    ["for i = 1, 2 do\n"] = "input:1: the statement that begins here is not complete\n",
  } do
    t:equal(run(t:folder(), "", input), output .. "status 1\n")
  end
end)

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

suite:test("the prompt in README runs", function(t)
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

-- ---- texts and values ---------------------------------------------------------------------------

suite:test("a top-level local becomes an assignment, without moving text", function(t)
  local function kept(text) return (tokens.keep_locals(text)) end
  t:equal(kept "local x = 1", "      x = 1")
  t:equal(kept "local x", "      x = nil;")
  t:equal(kept "local x, y local z = 1", "      x, y = nil;       z = 1")
  t:equal(kept "local function f() local a = 1 end", "      function f() local a = 1 end")
  for _, text in ipairs { "do local x = 1 end", "for i = 1, 2 do local x = i end",
    "while f() do local x end", "repeat local x = 1 until x", "if a then local x = 1 end",
    "f(function() local x = 1 end)", "x = 'local y'", "-- local y", "x = [[\nlocal y]]" } do
    t:equal(kept(text), text)
  end
  -- after a block it is top-level again
  t:equal(kept "if a then b() end local x = 1", "if a then b() end       x = 1")
  t:equal(select(2, tokens.keep_locals "local a, b = 1\nlocal function c() end"), { "a", "b", "c" })
end)

suite:test("values are truncated and summarised", function(t)
  local style = { color = false, ascii = true, width = 60 }
  local function shown(value) return show.value(value, style) end
  local many = {}
  for i = 1, 40 do many[i] = "entry" end
  t:ok(shown(many):find("... 16 more", 1, true), shown(many))
  t:equal(shown { a = true, [5] = "x", ["with blank"] = 1 },
    '{ [5] = "x", a = true, ["with blank"] = 1 }')
  local lattice = {}
  for x = 1, 4 do lattice[x] = { x, 2 * x, 0 / 0, -x } end
  t:equal(array_text.shape(lattice), { 4, 4 })
  t:equal(shown(lattice), "numbers [4][4]: min -4, mean 1.66667, max 8, NaN 4")
  t:equal(array_text.shape { 1, { 2 } }, nil)
  t:equal(array_text.shape { { 1, 2 }, { 3 } }, nil)
  t:equal(shown(("x"):rep(30)), '"' .. ("x"):rep(30) .. '"')
end)
