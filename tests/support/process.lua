--- process.lua: runs the limax executable in a test, to its end or until a signal.

local host = require "limax.host"
local shell = require "limax.base.shell"

local process = {}

-- a process is killed after so many seconds, so that no test hangs
local LIMIT = 600
-- time for a process to start, s
local START = 300
-- polling interval, s
local LOOK = 0.01

--- Time by which a wait may exceed its deadline on a loaded machine, s.
process.LATE = 50

--- A word quoted for the shell.
process.quote = shell.quoted

---@return string text empty without the file
function process.read(path)
  local file = io.open(path, "rb")
  if not file then return "" end
  local text = file:read "*a"
  file:close()
  return text
end

---@return string path
function process.write(path, text)
  local file = assert(io.open(path, "wb"))
  file:write(text)
  file:close()
  return path
end

--- The output of a shell command.
---@return string
function process.output(command)
  local pipe = assert(io.popen(command))
  local text = pipe:read "*a"
  pipe:close()
  return text
end

---@class limax.test_process
---@field pid string
---@field output string path of its output, both streams
---@field over string path of a file that exists when it has ended

local methods = {}
local class = { __index = methods }

--- Starts `limax` with these arguments in `folder`, with its output in a file there.
---@param environment string|nil words like NAME=value before the command
---@return limax.test_process
function process.start(folder, arguments, environment)
  local words = { process.quote(host.executable) }
  for _, word in ipairs(arguments) do words[#words + 1] = process.quote(word) end
  local output, job, over = folder .. "/output.txt", folder .. "/job.sh", folder .. "/job.over"
  process.write(job, ("cd %s\nenv %s %s </dev/null >%s 2>&1 &\n"
    .. "echo $!\nwait $!\nstatus=$?\necho >%s\necho $status\n"):format(process.quote(folder),
    environment or "", table.concat(words, " "), process.quote(output), process.quote(over)))
  -- files of an earlier process
  os.remove(over)
  os.remove(output)
  -- the shell prints a message for a killed process
  local pipe = assert(io.popen(("exec timeout -s KILL %d sh %s 2>/dev/null"):format(LIMIT,
    process.quote(job))))
  return setmetatable({ pipe = pipe, pid = pipe:read "*l", output = output, over = over }, class)
end

--- Waits until the output contains `text`.
function methods:wait_for(text)
  local start = host.clock()
  while not process.read(self.output):find(text, 1, true) do
    if host.clock() - start > START then
      self:signal "KILL"
      error(("%q was not printed; the output is: %s"):format(text, process.read(self.output)), 2)
    end
    host.wait(LOOK)
  end
end

--- Sends a signal to only this process.
function methods:signal(name)
  self.sent = host.clock()
  os.execute(("kill -%s %s 2>/dev/null"):format(name, self.pid))
end

--- Sends a signal once `is_time`, which is polled, returns true, unless the process has ended.
---@param is_time fun(): any
function methods:signal_when(name, is_time)
  local start = host.clock()
  while host.file.exists(self.over) == nil do
    if is_time() or host.clock() - start > START then
      self:signal(name)
      return
    end
    host.wait(LOOK)
  end
end

--- Waits for its end.
---@return integer|nil status nil if it had to be killed by the limit
---@return string output
---@return number seconds since the last signal, or since this call
function methods:finish()
  local start = self.sent or host.clock()
  local status = tonumber(self.pipe:read "*l")
  self.pipe:close()
  return status, process.read(self.output), host.clock() - start
end

--- Runs `limax` to its end.
---@return integer|nil status
---@return string output
function process.run(folder, arguments, environment)
  local status, output = process.start(folder, arguments, environment):finish()
  return status, output
end

---@class limax.test_process.options
---@field signal? string "INT", "KILL", ...: sent to it `after` seconds
---@field after? number s
---@field what? string its name in a failure
---@field before? string shell text before the command: "ulimit -f 8;", "LC_ALL=de_DE.UTF-8"

--- Runs `limax` to its end, with separate output streams and without the limit above.
---@param folder string where it runs
---@param options limax.test_process.options|nil
---@return { status: integer|nil, stdout: string, stderr: string }
function process.ends(folder, arguments, options)
  options = options or {}
  local words = {}
  if options.signal then
    -- --foreground: the signal reaches only limax, as with kill in a terminal
    words[1] = ("timeout --foreground --preserve-status -s %s %.3f"):format(options.signal,
      options.after)
  end
  words[#words + 1] = process.quote(host.executable)
  for _, argument in ipairs(arguments) do words[#words + 1] = process.quote(argument) end
  local out, err = folder .. "/.stdout", folder .. "/.stderr"
  local status = process.output(("cd %s && { %s %s; } >%s 2>%s </dev/null; echo $?"):format(
    process.quote(folder), options.before or "", table.concat(words, " "), process.quote(out),
    process.quote(err)))
  return { status = tonumber(status), stdout = process.read(out), stderr = process.read(err) }
end

--- The same; unless it succeeds, the test fails with its output.
---@param options limax.test_process.options|nil
---@return { status: integer, stdout: string, stderr: string }
function process.completes(t, folder, arguments, options)
  local done = process.ends(folder, arguments, options)
  if done.status ~= 0 then
    local here = debug.getinfo(2, "Sl")
    local what = options and options.what
      or ("line %d of %s"):format(here.currentline, here.short_src:match "[^/]*$")
    t:ok(false, ("%s: limax %s: status %s\n%s%s"):format(what, table.concat(arguments, " "),
      tostring(done.status), done.stdout, done.stderr))
  end
  return done
end

--- Checks that a command ended with this status and one message that has these texts, without a
--- Lua traceback.
---@param done { status: integer, stdout: string, stderr: string }
---@param ... string
---@return { status: integer, stdout: string, stderr: string }
function process.failed(t, done, status, ...)
  local errors = done.stderr
  t:ok(done.status == status, ("status %s, expected %d: %s"):format(done.status, status, errors))
  for _, text in ipairs { ... } do
    t:ok(errors:find(text, 1, true), ("expected %q in: %s"):format(text, errors))
  end
  t:ok(select(2, ("\n" .. errors):gsub("\nlimax: ", "")) == 1, "expected one message: " .. errors)
  t:ok(not errors:find "scripts/lib/", "a trace into the library: " .. errors)
  return done
end

--- Runs `limax` in `folder`, which must fail so.
function process.fails(t, folder, status, arguments, ...)
  return process.failed(t, process.ends(folder, arguments), status, ...)
end

--- Runs a Lua text as a script of `limax`.
---@return integer|nil status
---@return string output
function process.script(folder, text, environment)
  process.write(folder .. "/script.lua", text)
  return process.run(folder, { "script.lua" }, environment)
end

return process
