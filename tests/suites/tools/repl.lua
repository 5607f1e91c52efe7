--- repl.lua: `limax repl` without a terminal, and at a terminal of `script` (bsdutils).

local host = require "limax.host"
local process = require "support.process"

local suite = require("limax.test").suite "repl"

-- Pipes a text into the prompt: status and output, followed by the error stream.
local function feed(t, text)
  local folder = t:folder()
  process.write(folder .. "/input", text)
  local pipe = io.popen(("cd %s; %s repl <input 2>errors; echo status $?; cat errors"):format(
    folder, process.quote(host.executable)))
  local output = pipe:read "*a"
  pipe:close()
  return output
end

suite:test("a piped script shows values, keeps names and continues statements", function(t)
  t:equal(feed(t, [[
1 + 1
x = 3
x * 2, "a", nil
for i = 1, 2 do
  print(i)
end
function double(n)
  return 2 * n end
double(x);
double(x) -- the ; above mutes
double -- a comment

nil
]]):gsub("function: 0x%x+", "function"), '2\n6\t"a"\tnil\n1\n2\n6\nfunction\nnil\nstatus 0\n')
end)

suite:test("statements of many lines are run when they are complete", function(t)
  local lines = { "t = {" }
  for i = 1, 300 do lines[#lines + 1] = ('  { %d, "]%d" }, -- } end'):format(i, i) end
  t:equal(feed(t, table.concat(lines, "\n") .. [==[

}
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
x
]==]), "300\t300\n11\n6\nfive\n7\nstatus 0\n")
end)

suite:test("without a terminal the first error ends with status 1", function(t)
  t:equal(feed(t, "error 'boo'\nprint 'not reached'\n"),
    "status 1\ninput:1: boo\n  input:1: in main chunk\n")
  t:equal(feed(t, "print(1)\nunknown\n"),
    "1\nstatus 1\ninput:2: undefined name 'unknown'\n  input:2: in main chunk\n")
  -- line numbers are those of the piped text
  t:equal(feed(t, "\239\187\191print(1)\n\nfunction f()\n  boom()\nend\nf()\n"), "1\nstatus 1\n"
    .. "input:4: undefined name 'boom'\n  input:4: in function 'f'\n  input:6: in main chunk\n")
  t:equal(feed(t, "x = 1\nfor i = 1, 2 do\n  boom()\nend\n"), "status 1\n"
    .. "input:3: undefined name 'boom'\n  3 |   boom()\n  input:3: in main chunk\n")
  t:equal(feed(t, "x = = 1\n"), "status 1\ninput:1: unexpected symbol near '='\n")
  t:equal(feed(t, "f(\n  {\n  x = = 1\n"), "status 1\ninput:3: unexpected symbol near '='\n"
    .. "  3 |   x = = 1\n")
  t:equal(feed(t, "for i = 1, 2 do\n"),
    "status 1\ninput:1: the statement that begins here is not complete\n")
end)

suite:test("at a terminal Ctrl-C returns to the prompt and keeps names", function(t)
  if os.execute "command -v script >/dev/null" ~= 0 then t:skip "script is not installed" end
  local folder = t:folder()
  local screen = folder .. "/screen"
  local pipe = io.popen(("exec timeout -s KILL 300 script -qfec %s %s >/dev/null"):format(
    process.quote(process.quote(host.executable) .. " repl"), process.quote(screen)), "w")
  -- types a text and waits until the screen ends with another one
  local function type_in(text, expected)
    pipe:write(text)
    pipe:flush()
    local start = host.clock()
    while process.read(screen):sub(-#expected) ~= expected do
      if host.clock() - start > process.LATE then
        t:equal(process.read(screen), "... " .. expected)
      end
      host.wait(0.02)
    end
  end
  type_in("", "\r\n> ")
  type_in("x = 3\n", "x = 3\r\n> ")
  type_in("x + 1\n", "\r\n4\r\n> ")
  -- the output of the loop differs from the typed text
  local say = "io.write('lo' .. 'op') io.stdout:flush() "
  type_in(say .. "while true do end\n", "loop")
  type_in("\3", "interrupted\r\n> ")
  type_in("error 'boo'\n", "input:1: boo\r\n  input:1: in main chunk\r\n> ")
  type_in("half a line", "half a line")
  type_in("\3", "^C\r\n> ")
  type_in("function f()\n", "\r\n.. ")
  type_in("\3", "^C\r\n> ")
  type_in(say .. "jit.off() while true do pcall(tostring) end\n", "loop")
  type_in("\3", "interrupted\r\n> ")
  type_in("x + 2\n", "\r\n5\r\n> ")
  pipe:write "\4"
  pipe:flush()
  pipe:close()
end)
