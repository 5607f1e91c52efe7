--- child.lua: a command that runs beside this process, and ends with it.

local host = require "limax.host"
local shell = require "limax.base.shell"

local child = {}

-- Runs the command and writes its exit status to a file. After a line on its standard input, or
-- when the process that holds the input ends, it interrupts the command, which then frees what it
-- holds or ends itself after 2 s (bindings/host/signals.cpp), and kills it at last. In a session of
-- its own, so that Ctrl-C reaches the command once.
local SCRIPT = [[
exec 3<&0
COMMAND >BASE.out 2>BASE.err </dev/null 3<&- &
pid=$!
{ read line <&3; kill -INT $pid; sleep 4; kill -KILL $pid; } &
watcher=$!
wait $pid
status=$?
kill $watcher
echo $status >BASE.rc
]]

---@class limax.child
---@field out file* its output
---@field err file* its messages
---@field pipe file*|nil nil: it has been closed
---@field rc file*
local Child = {}
Child.__index = Child

--- Starts a command with its output in files.
---@param command string words for a shell
---@param base string path of the files, without their endings, in a folder that only this user can
--- write to: `host.file.temporary`
function child.start(command, base)
  local self = setmetatable({}, Child)
  local holes = { BASE = shell.quoted(base), COMMAND = command }
  assert(host.file.write_atomic(base .. ".sh", (SCRIPT:gsub("%f[%u]%u+%f[%U]", holes))))
  for _, name in ipairs { "out", "err", "rc" } do
    self[name] = assert(io.open(("%s.%s"):format(base, name), "w+b"))
  end
  self.pipe = assert(io.popen(("exec setsid sh %s.sh 2>/dev/null"):format(holes.BASE), "w"))
  return self
end

--- Its exit status; nil while it runs.
function Child:status() return self.rc:read "*l" end

--- Interrupts it, without waiting for its end.
function Child:interrupt()
  self.pipe:write "\n"
  self.pipe:flush()
end

--- Interrupts it if it still runs, and waits for its end.
---@return string|nil its exit status, unless `status` returned it
function Child:close()
  self.pipe:close()
  self.pipe = nil
  return self.rc:read "*l"
end

--- Closes the files of a child that has ended.
function Child:close_files()
  for _, name in ipairs { "out", "err", "rc" } do self[name]:close() end
end

return child
