--- process.lua: runs the limax executable for a test, to its end or until a signal.

local host = require "limax.host"
local shell = require "limax.base.shell"

local process = {}

-- a process that is still there after so many seconds is killed: no test may hang
local LIMIT = 300
-- how long a process may take to say that it is ready, s
local START = 120
-- between two looks at a process, s
local LOOK = 0.01

--- How long after its deadline a wait may end, s: a machine may be slow, loaded, or stop a process
--- for a while. What would be waited for otherwise takes far longer.
process.LATE = 20

--- A word as the shell reads it back unchanged.
process.quote = shell.quoted

---@param path string
---@return string text empty where there is no file
function process.read(path)
  local file = io.open(path, "rb")
  if not file then return "" end
  local text = file:read "*a"
  file:close()
  return text
end

---@param path string
---@param text string
---@return string path
function process.write(path, text)
  local file = assert(io.open(path, "wb"))
  file:write(text)
  file:close()
  return path
end

---@class limax.test_process
---@field pid string
---@field output string path: what it writes, both streams
---@field over string path: is there when it has ended

local methods = {}
local class = { __index = methods }

--- Starts `limax` with these arguments in `folder`, where its output goes into a file.
---@param folder string
---@param arguments string[]
---@param environment string|nil words like NAME=value before the command
---@return limax.test_process
function process.start(folder, arguments, environment)
  local words = { process.quote(host.executable) }
  for _, word in ipairs(arguments) do words[#words + 1] = process.quote(word) end
  local output, job, over = folder .. "/output.txt", folder .. "/job.sh", folder .. "/job.over"
  process.write(job, ("cd %s\nenv %s %s </dev/null >%s 2>&1 &\n"
    .. "echo $!\nwait $!\nstatus=$?\necho >%s\necho $status\n"):format(process.quote(folder),
    environment or "", table.concat(words, " "), process.quote(output), process.quote(over)))
  -- what an earlier process of this folder left would be taken for this one's
  os.remove(over)
  os.remove(output)
  -- the shell says that a killed process was killed
  local pipe = assert(io.popen(("exec timeout -s KILL %d sh %s 2>/dev/null"):format(LIMIT,
    process.quote(job))))
  return setmetatable({ pipe = pipe, pid = pipe:read "*l", output = output, over = over }, class)
end

--- Waits until the output contains `text`.
---@param text string
function methods:wait_for(text)
  local start = host.clock()
  while not process.read(self.output):find(text, 1, true) do
    if host.clock() - start > START then
      self:signal "KILL"
      error(("%q did not come; the output is: %s"):format(text, process.read(self.output)), 2)
    end
    host.wait(LOOK)
  end
end

--- Sends a signal to this process alone.
---@param name string
function methods:signal(name)
  self.sent = host.clock()
  os.execute(("kill -%s %s 2>/dev/null"):format(name, self.pid))
end

--- Sends a signal when `is_time`, which is asked again and again, says so; not to a process that
--- has ended before.
---@param name string
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
---@param folder string
---@param arguments string[]
---@param environment string|nil
---@return integer|nil status
---@return string output
function process.run(folder, arguments, environment)
  local status, output = process.start(folder, arguments, environment):finish()
  return status, output
end

---@class limax.test_process.options
---@field signal? string "INT", "KILL", ...: sent to it `after` seconds
---@field after? number s
---@field what? string what a failure calls it
---@field before? string shell text in front of the command: "ulimit -f 8;", "LC_ALL=de_DE.UTF-8"

--- Runs `limax` to its end, with separate output streams and without the limit above.
---@param folder string where it runs
---@param arguments string[]
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
  local pipe = assert(io.popen(("cd %s && { %s %s; } >%s 2>%s </dev/null; echo $?"):format(
    process.quote(folder), options.before or "", table.concat(words, " "), process.quote(out),
    process.quote(err)), "r"))
  local status = tonumber(pipe:read "*a")
  pipe:close()
  return { status = status, stdout = process.read(out), stderr = process.read(err) }
end

--- The same for one that must succeed: otherwise fails the test with its output.
---@param t limax.test_context
---@param folder string
---@param arguments string[]
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

--- Runs a Lua text as a script of `limax`.
---@param folder string
---@param text string
---@param environment string|nil
---@return integer|nil status
---@return string output
function process.script(folder, text, environment)
  process.write(folder .. "/script.lua", text)
  return process.run(folder, { "script.lua" }, environment)
end

return process
