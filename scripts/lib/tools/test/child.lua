--- child.lua: a process that runs tests of one file: `limax test FILE --json-seq`. Its standard
--- output is a JSON text sequence (RFC 7464: a record separator before each text, a line break
--- after it), mixed with what the tests print. It ends with the process that started it. Times in
--- seconds.

local host = require "limax.host"
local lines = require "limax.tools.test.lines"
local runner = require "limax.tools.test.runner"
local shell = require "limax.base.shell"
local source = require "limax.base.source"

local child = {}

--- Precedes each text of the sequence.
child.SEPARATOR = "\30"

-- bytes read at a time: a test that prints without end must not fill the memory
local MOST = 2 ^ 20

---@class limax.test_child
---@field instances limax.test_instance[] that it was started for
---@field open table<limax.test_instance, boolean> have no result yet
---@field now { instance: limax.test_instance, limit: number|nil, since: number }|nil running test
---@field hung table|nil the test that ran when it was ended
---@field status string|nil exit status
local methods = {}
methods.__index = methods

-- Runs the command, writes its process id and status to files, and kills it when this process ends,
-- which closes the standard input. The command handles an interrupt of the terminal itself.
local SCRIPT = [[
trap '' INT
exec 3<&0
COMMAND >BASE.out 2>BASE.err </dev/null 3<&- &
pid=$!
echo $pid >BASE.pid
{ cat <&3 >/dev/null; kill -KILL $pid; } &
watcher=$!
wait $pid
status=$?
kill $watcher
echo $status >BASE.rc
]]

local function words_of(path, only, options)
  local words = { shell.quoted(host.executable), "test", "--json-seq" }
  local function add(name, value)
    if value then words[#words + 1] = ("--%s=%s"):format(name, shell.quoted(tostring(value))) end
  end
  local choice = options.choice
  add("limit", choice.limit and ("%.17g"):format(choice.limit))
  add("shuffle", options.seed)
  if only then
    for _, instance in ipairs(only) do add("only", runner.title(instance)) end
  else
    add("filter", choice.filter)
    if choice.tags[1] then add("tags", table.concat(choice.tags, ",")) end
    for _, title in ipairs(choice.only) do add("only", title) end
  end
  -- a name may begin with a dash
  words[#words + 1] = "-- " .. shell.quoted(path)
  return words
end

---@param entry { file: limax.suite_file, instances: limax.test_instance[] }
---@param only limax.test_instance[]|nil nil: those of the choice
---@param options { folder: string, number: integer, choice: limax.test_choice, seed: integer|nil }
---@return limax.test_child
function child.start(entry, only, options)
  local base = ("%s/%d"):format(options.folder, options.number)
  local holes = { BASE = shell.quoted(base),
    COMMAND = table.concat(words_of(entry.file.path, only, options), " ") }
  assert(host.file.write_atomic(base .. ".sh", (SCRIPT:gsub("%f[%u]%u+%f[%U]", holes))))
  local self = setmetatable({ base = base, instances = only or entry.instances, open = {},
    named = {}, rest = "", at = { out = 0, err = 0 } }, methods)
  for _, instance in ipairs(self.instances) do
    self.open[instance] = true
    self.named[lines.valid_text(runner.title(instance))] = instance
  end
  self.pipe = assert(io.popen(("exec sh %s.sh 2>/dev/null"):format(holes.BASE), "w"))
  return self
end

-- New text in one of its output files.
function methods:output(name)
  local file = io.open(self.base .. "." .. name, "rb")
  if not file then return "" end
  file:seek("set", self.at[name])
  local text = file:read(MOST) or ""
  file:close()
  self.at[name] = self.at[name] + #text
  return text
end

function methods:event(event, events)
  if type(event) ~= "table" then return end
  self.ended = event.event == "end"
  local instance = event.suite
    and self.named[runner.title { suite = event.suite, label = event.test }]
  if not (instance and self.open[instance]) then return end
  if event.event == "start" then
    self.now = { instance = instance, limit = event.limit, since = host.clock() }
    events[#events + 1] = { "start", instance }
  elseif event.event == "test" then
    self.now, self.open[instance] = nil, nil
    events[#events + 1] = { "result", instance, event }
  end
end

--- Adds its new output to `events`, for the reporter.
---@param events table[]
---@param whole boolean|nil all of it: the process has ended
function methods:read(events, whole)
  repeat
    local new = self:output "out"
    local text, at = self.rest .. new, 1
    self.rest = ""
    while at <= #text do
      local mark = text:find(child.SEPARATOR, at, true)
      if mark ~= at then
        events[#events + 1] = { "printed", text:sub(at, (mark or #text + 1) - 1), false }
      end
      if not mark then break end
      local last = text:find("\n", mark, true)
      if not last then
        self.rest = text:sub(mark)
        break
      end
      self:event(host.json.decode(text:sub(mark + 1, last - 1), self.base), events)
      at = last + 1
    end
  until #new < MOST or not whole
  local errors = self:output "err"
  -- the interrupt that ended it writes a message too
  if errors ~= "" and not self.hung then events[#events + 1] = { "printed", errors, true } end
end

--- Whether it has ended; then `status` is set.
function methods:is_over()
  self.status = (source.read(self.base .. ".rc") or ""):match "^(%d+)\n"
  if not self.status then return false end
  self.pipe:close()
  return true
end

--- Whether it reported everything and exited as `limax test` does.
function methods:ended_well()
  return self.ended and (self.status == "0" or self.status == "1") or false
end

--- Sends it a signal.
function methods:signal(name)
  local pid = (source.read(self.base .. ".pid") or ""):match "%d+"
  if pid then os.execute(("kill -%s %s 2>/dev/null"):format(name, pid)) end
end

return child
