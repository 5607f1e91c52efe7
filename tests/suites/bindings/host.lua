--- host.lua: command line, errors, locked globals, packages, files, SHA-256, locale.

local ffi = require "ffi"

local host = require "limax.host"
local process = require "support.process"
local sealed = require "limax.base.sealed"

local suite = require("limax.test").suite "host"

suite:test("a wrong command, option or environment is one message, status 2", function(t)
  local folder = t:folder()
  process.write(folder .. "/s.lua", "require('limax').robot { voxels = 'ec' }:simulate {}")
  for _, case in ipairs {
    { { "rnu" }, 'unknown command "rnu"; did you mean "run"?' },
    { { "--versoin" }, 'unknown option --versoin; did you mean "--version"?' },
    { { "doctor", "file" }, 'unexpected "file"' }, { { "run", "--threads" }, "--threads needs N" },
    { { "run", "--threads", "two" }, 'a whole number from 1 to 1024, got "two"' },
    { { "run", "--quiet=1", "x.lua" }, "--quiet takes no value" },
    { { "run", "--device", "gpu", "x.lua" }, '--device: expected one of "auto", "cpu", "cuda"' },
    { { "nosuch.lua" }, "there is no file nosuch.lua" },
    { { "s.lua" }, 'LIMAX_THREADS: expected a whole number from 1 to 1024, got "abc"', "abc" },
    { { "s.lua" }, "LIMAX_THREADS: expected a whole number from 1 to 1024, got ", "0" },
    { { "doctor" }, "LIMAX_THREADS: expected a whole number from 1 to 1024, got ", "1025" },
  } do
    local status, output = process.run(folder, case[1], "LIMAX_THREADS=" .. (case[3] or ""))
    t:equal(status, 2)
    t:ok(output:find(case[2], 1, true), output)
    t:equal(select(2, output:gsub("\n", "")), 1)
  end
end)

suite:test("--version, --help and a command's --help end with status 0", function(t)
  local folder = t:folder()
  local status, output = process.run(folder, { "--version" })
  t:equal({ status, output:match "limax ([%d.]+)" }, { 0, host.version })
  status, output = process.run(folder, { "--help" })
  t:ok(status == 0 and output:find "\n  run +%l+" and output:find "\n  repl +%l+", output)
  for _, words in ipairs { { "run", "--help" }, { "run", "x.lua", "-h" }, { "help", "run" } } do
    status, output = process.run(folder, words)
    t:equal(status, 0)
    t:ok(output:find "^usage: limax run" and output:find "%-%-threads N", output)
  end
end)

suite:test("a syntax error shows file, line, cause and the text of the line, status 1", function(t)
  local status, output = process.script(t:folder(), "local x = 1\n\nx = = 2\n")
  t:equal(status, 1)
  t:equal(output, "limax: script.lua:3: unexpected symbol near '='\n  3 | x = = 2\n")
  local folder = t:folder()
  process.write(folder .. "/helper.lua", "return {\n  a = 1\n  b = 2,\n}\n")
  process.write(folder .. "/main.lua", 'require "helper"\n')
  status, output = process.run(folder, { "main.lua" })
  t:equal(status, 1)
  t:equal(output, "limax: ./helper.lua:3: '}' expected (to close '{' at line 1) near 'b'; a comma"
    .. " may be missing before it\n  3 |   b = 2,\n")
end)

suite:test("an error is followed by a traceback of the script's own lines, status 1", function(t)
  local status, output = process.script(t:folder(), [[
local function inner(t) return t.x.y end
local function outer() local y = inner {} return y end
outer()
]])
  t:equal(status, 1)
  t:equal(output, "limax: script.lua:1: attempt to index field 'x' (a nil value)\n"
    .. "  script.lua:1: in function 'inner'\n  script.lua:2: in function 'outer'\n"
    .. "  script.lua:3: in main chunk\n")
  status, output = process.script(t:folder(), "local function f() return 1 + f() end\nf()\n")
  -- LuaJIT may have no room left for a traceback
  t:equal({ status, output:match "^[^\n]*stack overflow" ~= nil }, { 1, true })
  status, output = process.script(t:folder(),
    "local function f(n) return n > 0 and 1 + f(n - 1) or error 'deep' end\nf(5000)\n")
  t:equal(status, 1)
  t:ok(output:find("deep", 1, true) and output:find "\n  %.%.%.\n$", output)
  t:ok(#output < 4000, "a deep recursion must not fill the screen")
  status, output = process.script(t:folder(), "error(setmetatable({}, "
    .. "{ __tostring = function() return 'own words' end }))")
  t:equal(status, 1)
  t:ok(output:find("limax: own words", 1, true), output)
end)

suite:test("os.exit and host.exit end with their status and lose no output", function(t)
  local folder = t:folder()
  for text, expected in pairs {
    ["io.write 'kept' os.exit(7)"] = 7,
    ["io.write 'kept' os.exit(false)"] = 1,
    ["io.write 'kept' pcall(function() os.exit(true) end)"] = 0,
    ["coroutine.wrap(function() io.write 'kept' require('limax.host').exit(3) end)()"] = 3,
    ["io.write 'kept'"] = 0,
  } do
    local status, output = process.script(folder, text)
    t:equal({ status, output }, { expected, "kept" })
  end
end)

suite:test("a full standard output is a failure, a closed pipe is not", function(t)
  local folder = t:folder()
  process.write(folder .. "/p.lua", "for i = 1, 1e5 do print(i) end")
  local command = ("cd %s && %s p.lua"):format(folder, process.quote(host.executable))
  t:equal(process.output(("{ %s >/dev/full; echo $?; } 2>&1"):format(command)),
    "limax: cannot write to the standard output: No space left on device\n1\n")
  t:equal(process.output(("{ %s | head -n 1; } 2>&1"):format(command)), "1\n")
end)

suite:test("globals are locked, math.random and the locale are unavailable", function(t)
  local read, write = loadstring "return misspelt", loadstring "misspelt = 1"
  t:raises("undefined name 'misspelt': write local misspelt", read)
  t:raises("undefined name 'misspelt': write local misspelt", write)
  for _, text in ipairs { "table.sort = print", "function math.sqrt() end", "string.own = 1" } do
    t:raises("limax itself uses Lua's libraries; write a local function", loadstring(text))
  end
  t:raises("assignment to 'tostring', which limax itself uses: write local tostring",
    loadstring "tostring = print")
  t:equal({ table.sort ~= print, math.sqrt(4), rawget(_G, "tostring") }, { true, 2, nil })
  t:raises("math.random would make runs irreproducible: use the argument `random`", math.random)
  t:raises("would make runs irreproducible", function() math.randomseed(1) end)
  t:raises("the locale stays", function() os.setlocale "de_DE.UTF-8" end)
  t:equal(os.setlocale(), "C")
end)

suite:test("require finds limax's modules and the script's own folder, nothing else", function(t)
  local folder = t:folder()
  host.file.mkdir(folder .. "/parts")
  process.write(folder .. "/parts/leg.lua", "return 'leg'")
  process.write(folder .. "/script.lua", [[
print(require "parts.leg", package.cpath, type(require "limax"), arg[0]:match "[^/]*$", arg[1])
print(pcall(require, "socket") == false, pcall(require, "limax.nosuch") == false)
]])
  local status, output = process.run("/", { folder .. "/script.lua", "word" })
  t:equal({ status, output }, { 0, "leg\t\ttable\tscript.lua\tword\ntrue\ttrue\n" })
end)

suite:test("files are written atomically, extended by lines, and locked", function(t)
  local folder, file = t:folder(), host.file
  local path = folder .. "/a/b/text"
  t:equal({ file.exists(path), (file.write_atomic(path, "x")) }, { nil, nil })
  t:ok(file.mkdir(folder .. "/a/b") and file.mkdir(folder .. "/a/b"))
  for _, text in ipairs { "one", "", ("long\n"):rep(1e5) } do
    t:ok(file.write_atomic(path, text))
    t:ok(process.read(path) == text)
  end
  -- no temporary file is left
  t:equal(file.list(folder .. "/a/b"), { "text" })
  t:equal({ file.exists(path), file.exists(folder .. "/a") }, { "file", "folder" })

  local lines = folder .. "/lines"
  t:ok(file.append(lines, "one\n") and file.append(lines, "two\nthree\n"))
  t:equal(process.read(lines), "one\ntwo\nthree\n")
  t:raises("whole lines", function() file.append(lines, "half") end)
  t:ok(file.truncate(lines, 4))
  t:equal(process.read(lines), "one\n")
  local fine, message = file.append("/dev/full", "x\n")
  t:equal({ fine, message }, { nil, "cannot append to /dev/full: No space left on device" })
  fine, message = file.write_atomic(folder .. "/no/x", "x")
  local expected = ("cannot create %s/no/x: No such file or directory"):format(folder)
  t:equal({ fine, message }, { nil, expected })

  t:ok(file.rename(lines, folder .. "/moved") and file.remove(folder .. "/moved"))
  t:equal({ (file.remove(folder .. "/moved")), (file.remove(folder .. "/a")) }, { nil, nil })
  t:equal(file.absolute "/a/../b/./c/", "/b/c")
end)

suite:test("a temporary folder is private, and goes with its process", function(t)
  local folder, file = t:folder(), host.file
  t:ok(file.mkdir(folder .. "/tmp") and file.write_atomic(folder .. "/kept", "kept"))
  for ending, expected in pairs { [""] = 0, ["error 'boo'"] = 1, ["os.exit(3)"] = 3,
    ["io.popen 'kill -INT $PPID' require('limax.host').wait(60)"] = 130 } do
    local status, output = process.script(folder, [[
local file = require("limax.host").file
local path = file.temporary()
os.execute("stat -c %a " .. path .. " && ln -s $PWD/kept " .. path)
file.mkdir(path .. "/a/b")
print(#file.list "tmp", file.remove_temporary(file.temporary()), #file.list "tmp")
]] .. ending, "TMPDIR=tmp")
    t:equal({ status, output:match "^(.-\n.-)\n", file.list(folder .. "/tmp") },
      { expected, "700\n1\ttrue\t1", {} })
  end
  t:equal(process.read(folder .. "/kept"), "kept")
  t:raises("not a temporary folder of this process", function() file.remove_temporary "/" end)
  local _, output = process.script(folder, "print(require('limax.host').file.temporary())",
    "TMPDIR=no")
  t:ok(output:find "^nil\tcannot make a folder in .*/no: No such file", output)
end)

suite:test("a file is locked by one process at most, which a reader sees", function(t)
  local folder, file = t:folder(), host.file
  local path = folder .. "/journal"
  process.write(path, "text\n")
  process.write(folder .. "/ask.lua", 'local file = require("limax.host").file\n'
    .. 'print(file.is_locked "journal", select(2, file.lock "journal"))\n')
  local function ask() return select(2, process.run(folder, { "ask.lua" })) end
  t:equal(file.is_locked(path), false)
  local lock = t:ok(file.lock(path))
  -- a process that this one starts does not keep the lock
  local child = io.popen("cat >/dev/null", "w")
  t:equal({ file.is_locked(path), ask() },
    { true, "true\tjournal is in use by another process\tlocked\n" })
  lock:free()
  t:equal({ file.is_locked(path), ask(), process.read(path) }, { false, "false\n", "text\n" })
  -- it ends with its process, however that ends
  process.script(folder, 'require("limax.host").file.lock "journal" os.execute("kill -9 $PPID")')
  t:equal(file.is_locked(path), false)
  os.execute(("ln -s journal %s/link; mkfifo %s/pipe"):format(folder, folder))
  for name, expected in pairs { link = " is a link", pipe = " is not a regular file",
    journal = false } do
    local _, message = file.is_locked(folder .. "/" .. name)
    t:equal(message, expected and folder .. "/" .. name .. expected or nil)
    if expected then
      t:equal({ file.lock(folder .. "/" .. name) }, { nil, folder .. "/" .. name .. expected })
    end
  end
  child:close()
end)

suite:test("of processes that create a private file together one does, and all agree", function(t)
  local folder, file = t:folder(), host.file
  local path = folder .. "/key"
  process.write(folder .. "/create.lua", [[
local host = require "limax.host"
local text = arg[1]:rep(1000)
repeat until host.clock() > tonumber(arg[2])
print(host.file.create_private("key", text), host.file.read_private "key")
]])
  local pipes, created, agreed = {}, 0, true
  for k = 1, 8 do
    pipes[k] = io.popen(("cd %s && %s create.lua %d %.3f 2>&1"):format(process.quote(folder),
      process.quote(host.executable), k, host.clock() + 0.3))
  end
  for k, pipe in ipairs(pipes) do
    local won, text = pipe:read "*a":match "^(%l+)\t(%d+)\n$"
    pipe:close()
    agreed = agreed and text == file.read_private(path)
    if won == "true" then created = created + (text == tostring(k):rep(1000) and 1 or 2) end
  end
  t:equal({ created, agreed, file.list(folder) }, { 1, true, { "create.lua", "key" } })
  -- the name of a link is taken too, and nothing is written through it
  os.execute(("ln -s aim %s/link"):format(folder))
  t:equal({ file.create_private(folder .. "/link", "x"), file.exists(folder .. "/aim") }, { false })
end)

suite:test("a writer works asynchronously and in order until a job fails", function(t)
  local folder, writer = t:folder(), host.file.writer()
  local path = folder .. "/rows"
  local numbers = ffi.new("float[?]", 3, { 1, 2, 3 })
  t:equal(writer:done(), 0)
  t:equal({ writer:wait() }, { true })
  -- three rows of a number, of which another writer has the last one
  writer:begin_array(path .. ".part", "before", 3, 4)
  ffi.copy(ffi.cast("char *", writer:array(8)), numbers, 8)
  t:equal(writer:write_rows(path .. ".part", 6, 4, 1), 2)
  t:ok(writer:wait())
  local other = host.file.writer()
  ffi.copy(ffi.cast("char *", other:array(4)), numbers + 2, 4)
  other:write_rows(path .. ".part", 14, 4, 0, true)
  t:ok(other:wait())
  local job, token = writer:end_array(path .. ".part", path, other:sum(path .. ".part"))
  t:equal({ job, token }, { 3, "@000000000000003" })
  -- only the first bytes of a line, those before a user's text, have their placeholders replaced
  local line = sealed.add('{"a":"' .. token .. '","b":"' .. token .. '"}') .. "\n"
  writer:append_sealed(folder .. "/sealed", line, line:find '"b"' - 1)
  for k = 5, 200 do t:equal(writer:append(folder .. "/lines", ("line %d\n"):format(k)), k) end
  collectgarbage()
  t:ok(writer:wait(3))
  local bytes = "before" .. ffi.string(numbers, 12)
  t:ok(process.read(path) == bytes)
  t:ok(writer:wait())
  local hash = host.xxh3(bytes, 4)
  t:equal({ writer:hash(3), writer:hash(3) }, { hash, "" })
  t:equal(sealed.open(process.read(folder .. "/sealed")), { a = hash, b = token })
  t:equal(writer:done(), 200)
  local lines = {}
  for k = 5, 200 do lines[#lines + 1] = ("line %d\n"):format(k) end
  t:equal(process.read(folder .. "/lines"), table.concat(lines))

  -- nothing is written after a failure
  t:equal({ writer:write(path, "before") }, { 201, 6, host.xxh3 "before" })
  writer:write(folder .. "/no/x", "x")
  writer:append(folder .. "/lines", "after\n")
  local expected = ("cannot create %s/no/x: No such file or directory"):format(folder)
  t:equal({ writer:wait() }, { nil, expected })
  t:equal(writer:done(), 201)
  t:ok(writer:wait(0) == nil and writer:write(path, "later") == 204)
  t:equal({ writer:wait() }, { nil, expected })
  t:equal(process.read(path), "before")
  t:ok(not process.read(folder .. "/lines"):find "after")

  t:raises("whole lines", function() writer:append(path, "half") end)
  t:raises("there is no such job", function() writer:wait(205) end)
  t:raises("a size", function() writer:array(-1) end)

  writer = host.file.writer()
  os.execute(("ln -s rows %s/link"):format(folder))
  t:equal({ writer:append(folder .. "/link", "x\n") }, { 1, 2, host.xxh3 "x\n" })
  t:equal({ writer:wait() }, { nil, folder .. "/link is a link" })
  host.file.remove(folder .. "/link")

  -- jobs are finished without a wait
  writer = host.file.writer()
  for k = 1, 50 do writer:write(path, ("%d"):format(k)) end
  writer = nil
  collectgarbage()
  collectgarbage()
  t:equal({ process.read(path), host.file.list(folder) }, { "50", { "lines", "rows", "sealed" } })
end)

suite:test("hashes give the published values, for any bytes", function(t)
  t:equal(host.sha256 "abc", "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad")
  t:equal(host.sha256(("\200\255"):rep(40)),
    "6ccbd65b742b108a0a9de98e4fb8982ce94aa0f1f4f183c8f8f1d7a983db0f7e")
  t:equal(host.xxh3 "", "2d06800538d394c2")
  -- RFC 4231, cases 2 and 6; the second key is longer than a block
  t:equal(host.hmac_sha256("Jefe", "what do ya want for nothing?"),
    "5bdcc146bf60754e6a042426089575c75a003f089d2739839dec58b964ec3843")
  t:equal(host.hmac_sha256(("\170"):rep(131),
    "Test Using Larger Than Block-Size Key - Hash Key First"),
    "60e431591ee0b67f0d8a26aacbf5b77f8e0bc6213728c5140546040f0ee37f54")
end)
