--- processes.lua: runs each file of a plan in a process of its own, one or several at a time, so
--- that a test which loops, crashes or exits costs itself and nothing else: it is ended from
--- outside where need be, counts as failed, and the tests after it go on in another process. Files
--- are reported in the order of the plan, the first that is not over as it goes. Times in seconds.

local child = require "limax.tools.test.child"
local host = require "limax.host"

local processes = {}

-- between two looks at the processes: short against any file of tests
local LOOK = 0.02
-- beyond its limit, after which a test is ended from outside: it had its chance to say so itself
local GRACE = 2
-- from the interrupt, which lets a test tidy up, to the end without one; a process that cannot take
-- the interrupt ends itself after 2 s (bindings/host/signals.cpp)
local PATIENCE = 4

-- How a file's process is worth reporting when it was no test that failed.
local function end_of(file, text)
  local instance = { suite = file.path, label = "its process ends well", is_process = true }
  return instance, { status = "failed", seconds = 0, notes = {}, text = text }
end

-- Ends a process whose test is beyond its limit: politely first.
local function watch(one)
  local now = one.now
  if not (now and now.limit) then return end
  local over = host.clock() - now.since - now.limit - GRACE
  if over > 0 and not one.hung then
    one.hung = now
    one:signal "INT"
  elseif one.hung and over > PATIENCE then
    one:signal "KILL"
  end
end

---@class limax.test_file_run
---@field entry { file: limax.suite_file, instances: limax.test_instance[] }
---@field process limax.test_child|nil nil: it does not load, or is over
---@field told table[] what the reporter has yet to hear

local run = {}
run.__index = run

-- A process for these tests of the file; nil: all that were chosen.
function run:start(instances)
  self.options.number = self.options.number + 1
  self.process = child.start(self.entry, instances, self.options)
end

-- What the process was at when it ended, and the tests that it did not come to.
function run:ended(process)
  local now, left = process.now, {}
  -- the one beyond its limit has come back after all, and the signal met the next one
  if process.hung and now ~= process.hung then now = nil end
  for _, instance in ipairs(process.instances) do
    if process.open[instance] and not (now and now.instance == instance) then
      left[#left + 1] = instance
    end
  end
  local text = ("its process ended with status %s before this test did"):format(process.status)
  if process.hung then
    text = ("it did not come back within %g s of its limit of %g s: its process was ended"):format(
      GRACE, process.hung.limit)
  end
  local function failed(instance, since)
    table.insert(self.told, { "result", instance, { status = "failed", notes = {}, text = text,
      seconds = since and host.clock() - since or 0 } })
  end
  if now then failed(now.instance, now.since) end
  local went_on = now or #left < #process.instances
  if #left > 0 and went_on then
    -- each process settles one test at least: this comes to an end
    self:start(left)
    return
  end
  for _, instance in ipairs(left) do failed(instance) end
  if not now and #left == 0 and not process:ended_well() then
    table.insert(self.told, { "result", end_of(self.entry.file,
      ("it ended with status %s after its tests"):format(process.status)) })
  end
end

-- Takes what the process has said, and what its end means.
function run:look()
  local process = self.process
  if not process then return end
  process:read(self.told)
  watch(process)
  if not process:is_over() then return end
  -- what came between the last look and the end
  process:read(self.told, true)
  self.process = nil
  self:ended(process)
end

-- Tells the reporter what it has not heard.
function run:tell(reporter, counts, echo)
  for _, each in ipairs(self.told) do
    local what, first, second = unpack(each)
    if what == "printed" then
      echo(first, second)
    elseif what == "result" then
      counts[second.status] = counts[second.status] + 1
      reporter:result(first, second)
    else
      reporter[what](reporter, first)
    end
  end
  self.told = {}
end

local function begin(entry, options, counts)
  local file = entry.file
  local one = setmetatable({ entry = entry, told = { { "file", file } }, options = options }, run)
  if file.failure then
    counts.failed = counts.failed + 1
  else
    one:start(nil)
  end
  return one
end

-- Ends what still runs after an interrupt: politely first.
local function stop(running)
  local began = host.clock()
  for _, one in ipairs(running) do
    if one.process then one.process:signal "INT" end
  end
  for _, one in ipairs(running) do
    while one.process and host.clock() - began < 2 * PATIENCE and not one.process:is_over() do
      if host.clock() - began > PATIENCE then one.process:signal "KILL" end
      host.wait(LOOK)
    end
  end
end

---@class limax.test_processes_options
---@field jobs integer processes at a time
---@field choice limax.test_choice
---@field seed integer|nil of a drawn order
---@field echo fun(text: string, is_error: boolean) what tests print themselves

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
  local function whole()
    while next_file <= #plan.files or #running > 0 do
      local at_work = 0
      for _, one in ipairs(running) do at_work = at_work + (one.process and 1 or 0) end
      while at_work < options.jobs and next_file <= #plan.files do
        local one = begin(plan.files[next_file], setting, counts)
        next_file = next_file + 1
        at_work = at_work + (one.process and 1 or 0)
        running[#running + 1] = one
      end
      for _, one in ipairs(running) do one:look() end
      -- those behind the first are heard when it is over: files are never mixed
      while running[1] do
        running[1]:tell(reporter, counts, options.echo)
        if running[1].process then break end
        table.remove(running, 1)
      end
      if #running > 0 then host.wait(LOOK) end
    end
  end
  local fine, message, trace = host.protect(whole)
  stop(running)
  for _, name in ipairs(host.file.list(folder) or {}) do host.file.remove(folder .. "/" .. name) end
  host.file.remove(folder)
  if not fine then error(message == host.interrupt and message or trace or message, 0) end
  reporter:finish(counts)
  return counts
end

return processes
