--- processes.lua: runs each file of a plan in its own process, one or several at a time. A test
--- that loops, crashes or exits is ended, counts as failed, and the tests after it run in another
--- process. Files are reported in the order of the plan. Times in seconds.

local child = require "limax.tools.test.child"
local host = require "limax.host"

local processes = {}

-- s between polls of the processes
local POLL_INTERVAL = 0.02
-- beyond its limit, after which a test is ended from outside
local GRACE = 2
-- between the interrupt and the kill; a process that cannot handle the interrupt ends itself after
-- 2 s (bindings/host/signals.cpp)
local PATIENCE = 4

-- Ends a process whose test is beyond its limit: an interrupt first.
local function watch(process)
  local now = process.now
  if not (now and now.limit) then return end
  local over = host.clock() - now.since - now.limit - GRACE
  if over > 0 and not process.hung then
    process.hung = now
    process:signal "INT"
  elseif process.hung and over > PATIENCE then
    process:signal "KILL"
  end
end

---@class limax.test_file_run
---@field entry { file: limax.suite_file, instances: limax.test_instance[] }
---@field process limax.test_child|nil nil: it does not load, or has ended
---@field events table[] not yet reported
local run = {}
run.__index = run

-- A process for these tests of the file; nil: all that were chosen.
function run:start(instances)
  self.options.number = self.options.number + 1
  self.process = child.start(self.entry, instances, self.options)
end

function run:fail(instance, text, since)
  table.insert(self.events, { "result", instance, { status = "failed", notes = {}, text = text,
    seconds = since and host.clock() - since or 0 } })
end

-- Reports the test during which a process ended, and starts another one for the remaining tests.
function run:ended(process)
  local now, left = process.now, {}
  -- the test beyond its limit has returned, and the signal reached the next one
  if process.hung and now ~= process.hung then now = nil end
  for _, instance in ipairs(process.instances) do
    if process.open[instance] and not (now and now.instance == instance) then
      left[#left + 1] = instance
    end
  end
  local text = ("its process ended with status %s before this test did"):format(process.status)
  if process.hung then
    text = ("it did not return within %g s of its limit of %g s: its process was ended"):format(
      GRACE, process.hung.limit)
  end
  if now then self:fail(now.instance, text, now.since) end
  if #left > 0 and (now or #left < #process.instances) then
    -- each process finishes at least one test
    self:start(left)
    return
  end
  for _, instance in ipairs(left) do self:fail(instance, text) end
  if not now and #left == 0 and not process:ended_well() then
    self:fail({ suite = self.entry.file.path, label = "its process ends well", is_process = true },
      ("it ended with status %s after its tests"):format(process.status))
  end
end

function run:look()
  local process = self.process
  if not process then return end
  process:read(self.events)
  watch(process)
  if not process:is_over() then return end
  -- output between the last look and the end
  process:read(self.events, true)
  self.process = nil
  self:ended(process)
end

function run:report(reporter, counts, echo)
  for _, event in ipairs(self.events) do
    local what, first, second = unpack(event)
    if what == "printed" then
      echo(first, second)
    elseif what == "result" then
      counts[second.status] = counts[second.status] + 1
      reporter:result(first, second)
    else
      reporter[what](reporter, first)
    end
  end
  self.events = {}
end

local function begin(entry, options, counts)
  local one = setmetatable({ entry = entry, events = { { "file", entry.file } },
    options = options }, run)
  if entry.file.failure then
    counts.failed = counts.failed + 1
  else
    one:start(nil)
  end
  return one
end

-- Ends the processes after an interrupt.
local function stop(running)
  local began = host.clock()
  for _, one in ipairs(running) do
    if one.process then one.process:signal "INT" end
  end
  for _, one in ipairs(running) do
    while one.process and host.clock() - began < 2 * PATIENCE and not one.process:is_over() do
      if host.clock() - began > PATIENCE then one.process:signal "KILL" end
      host.wait(POLL_INTERVAL)
    end
  end
end

local function count_active(running)
  local count = 0
  for _, one in ipairs(running) do count = count + (one.process and 1 or 0) end
  return count
end

---@class limax.test_processes_options
---@field jobs integer processes at a time
---@field choice limax.test_choice
---@field seed integer|nil of a shuffled order
---@field echo fun(text: string, is_error: boolean) prints what tests print themselves

--- Runs a plan.
---@param plan limax.test_plan
---@param options limax.test_processes_options
---@param reporter table see report.lua
---@return limax.test_counts
function processes.run_all(plan, options, reporter)
  local folder = os.tmpname()
  os.remove(folder)
  assert(host.file.mkdir(folder))
  local counts = { passed = 0, failed = 0, skipped = 0 }
  reporter:begin(plan.total)
  local setting = { folder = folder, number = 0, choice = options.choice, seed = options.seed }
  local running, next_file = {}, 1
  local fine, message, trace = host.protect(function()
    while next_file <= #plan.files or #running > 0 do
      while count_active(running) < options.jobs and next_file <= #plan.files do
        running[#running + 1] = begin(plan.files[next_file], setting, counts)
        next_file = next_file + 1
      end
      for _, one in ipairs(running) do one:look() end
      -- the others wait until the first has ended, so that files are not mixed
      while running[1] do
        running[1]:report(reporter, counts, options.echo)
        if running[1].process then break end
        table.remove(running, 1)
      end
      if #running > 0 then host.wait(POLL_INTERVAL) end
    end
  end)
  stop(running)
  for _, name in ipairs(host.file.list(folder) or {}) do host.file.remove(folder .. "/" .. name) end
  host.file.remove(folder)
  if not fine then error(message == host.interrupt and message or trace or message, 0) end
  reporter:finish(counts)
  return counts
end

return processes
