--- processes.lua: runs each file of a plan in its own process, one or several at a time:
--- `limax test FILE --json-seq`, which prints a JSON text sequence (RFC 7464: a record separator
--- before each text, a line break after it) mixed with what the tests print. A test that loops,
--- crashes or exits is ended and fails, and the tests after it run in another process. Files are
--- reported in the order of the plan. Times in seconds.

local child = require "limax.base.child"
local failure = require "limax.base.failure"
local host = require "limax.host"
local report = require "limax.tools.test.report"
local runner = require "limax.tools.test.runner"
local shell = require "limax.base.shell"

local processes = {}

--- Precedes each text of the sequence.
processes.SEPARATOR = "\30"

-- s between polls of the processes
local POLL_INTERVAL = 0.02
-- s beyond its limit, after which a test is ended from outside
local GRACE = 2
-- bytes read at a time: a test that prints without end must not fill the memory
local MOST = 2 ^ 20

local function words_of(path, only, options)
  local words = { shell.quoted(host.executable), "test", "--json-seq" }
  local function add(name, value)
    if value then words[#words + 1] = ("--%s=%s"):format(name, shell.quoted(tostring(value))) end
  end
  local choice = options.choice
  add("limit", choice.limit and ("%.17g"):format(choice.limit))
  if only then
    for _, instance in ipairs(only) do add("only", runner.title(instance)) end
  else
    add("filter", choice.filter)
    if choice.tags[1] then add("tags", table.concat(choice.tags, ",")) end
    for _, title in ipairs(choice.only) do add("only", title) end
  end
  -- a name may begin with a dash
  words[#words + 1] = "-- " .. shell.quoted(path)
  return table.concat(words, " ")
end

---@class limax.test_file_run a file and the process that runs its tests
---@field entry { file: limax.suite_file, instances: limax.test_instance[] }
---@field events table[] not yet reported
---@field child limax.child|nil nil: it does not load, or has ended
---@field instances limax.test_instance[] that the process was started for
---@field open table<string, limax.test_instance> have no result yet, by title
---@field now { instance: limax.test_instance, limit: number|nil, since: number }|nil running test
---@field hung table|nil the test that ran when the process was ended
local run = {}
run.__index = run

-- Starts a process for these tests of the file; nil: all that were chosen.
function run:start(only)
  local options = self.options
  options.number = options.number + 1
  local base = ("%s/%d"):format(options.folder, options.number)
  self.child = child.start(words_of(self.entry.file.path, only, options), base)
  self.instances, self.open = only or self.entry.instances, {}
  self.now, self.hung, self.ended, self.rest = nil, nil, false, ""
  for _, instance in ipairs(self.instances) do
    self.open[report.valid_text(runner.title(instance))] = instance
  end
end

function run:print(text, is_error)
  table.insert(self.events, { event = "printed", text = text, is_error = is_error })
end

-- Handles an event of the process.
function run:take(event)
  if type(event) ~= "table" then return end
  self.ended = event.event == "end"
  local title = event.suite and ("%s: %s"):format(event.suite, event.test)
  local instance = self.open[title]
  if not instance then return end
  -- names with bytes that JSON does not hold
  event.suite, event.test = instance.suite, instance.label
  self.now = nil
  if event.event == "start" then
    self.now = { instance = instance, limit = event.limit, since = host.clock() }
  else
    self.open[title] = nil
  end
  table.insert(self.events, event)
end

-- Reads new output; false without any.
function run:read()
  local new = self.child.out:read(MOST)
  local errors = self.child.err:read(MOST)
  -- the interrupt that ended it writes a message too
  if errors and not self.hung then self:print(errors, true) end
  local text, at = self.rest .. (new or ""), 1
  self.rest = ""
  while at <= #text do
    local mark = text:find(processes.SEPARATOR, at, true)
    if mark ~= at then self:print(text:sub(at, (mark or #text + 1) - 1), false) end
    local last = mark and text:find("\n", mark, true)
    if not last then
      self.rest = mark and text:sub(mark) or ""
      break
    end
    self:take(host.json.decode(text:sub(mark + 1, last - 1), "limax test"))
    at = last + 1
  end
  return new ~= nil or errors ~= nil
end

function run:fail(instance, text, since)
  table.insert(self.events, { event = "test", suite = instance.suite, test = instance.label,
    is_process = instance.is_process, status = "failed", notes = {}, text = text,
    seconds = since and host.clock() - since or 0 })
end

-- Reports the test during which the process ended, and starts another one for the remaining tests.
function run:over(status)
  local now, left = self.now, {}
  -- the test beyond its limit has returned, and the signal reached the next one
  if self.hung and now ~= self.hung then now = nil end
  for _, instance in ipairs(self.instances) do
    local is_open = self.open[report.valid_text(runner.title(instance))] ~= nil
    if is_open and not (now and now.instance == instance) then left[#left + 1] = instance end
  end
  local text = ("its process ended with status %s before this test did"):format(status)
  if self.hung then
    text = ("it did not return within %g s of its limit of %g s: its process was ended"):format(
      GRACE, self.hung.limit)
  end
  if now then self:fail(now.instance, text, now.since) end
  if #left > 0 and (now or #left < #self.instances) then
    -- each process finishes at least one test
    return self:start(left)
  end
  for _, instance in ipairs(left) do self:fail(instance, text) end
  if not now and #left == 0 and not (self.ended and (status == "0" or status == "1")) then
    self:fail({ suite = self.entry.file.path, label = "its process ends well", is_process = true },
      ("it ended with status %s after its tests"):format(status))
  end
end

function run:look()
  if not self.child then return end
  local status = self.child:status()
  self:read()
  local now = self.now
  if status then
    self.child:close()
  elseif now and now.limit and host.clock() - now.since > now.limit + GRACE then
    self.hung = now
    status = self.child:close()
  else
    return
  end
  -- output between the last look and the end
  while self:read() do end
  self.child:close_files()
  self.child = nil
  self:over(status)
end

local function begin(entry, options)
  local file = entry.file
  local events = { { event = "file", path = file.path, failure = file.failure } }
  local one = setmetatable({ entry = entry, events = events, options = options }, run)
  if not file.failure then one:start(nil) end
  return one
end

local function count_active(running)
  local count = 0
  for _, one in ipairs(running) do count = count + (one.child and 1 or 0) end
  return count
end

--- Runs a plan.
---@param options { jobs: integer, choice: limax.test_choice,
--- echo: fun(text: string, is_error: boolean) } `echo` prints what tests print themselves
---@param take fun(event: limax.test_event)
function processes.run_all(plan, options, take)
  local folder, problem = host.file.temporary()
  if not folder then failure.raise(1, problem) end
  options.folder, options.number = folder, 0
  local running, next_file = {}, 1
  local fine, message, trace = host.protect(function()
    while next_file <= #plan.files or #running > 0 do
      while count_active(running) < options.jobs and next_file <= #plan.files do
        running[#running + 1] = begin(plan.files[next_file], options)
        next_file = next_file + 1
      end
      for _, one in ipairs(running) do one:look() end
      -- the others wait until the first has ended, so that files are not mixed
      while running[1] do
        local events = running[1].events
        running[1].events = {}
        for _, event in ipairs(events) do
          if event.event == "printed" then
            options.echo(event.text, event.is_error)
          else
            take(event)
          end
        end
        if running[1].child then break end
        table.remove(running, 1)
      end
      if #running > 0 then host.wait(POLL_INTERVAL) end
    end
  end)
  for _, one in ipairs(running) do
    if one.child then one.child:close() end
  end
  host.file.remove_temporary(folder)
  if not fine then error(message == host.interrupt and message or trace or message, 0) end
end

return processes
