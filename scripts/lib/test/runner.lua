--- runner.lua: reads suite files, makes of each test one instance per device and number of threads,
--- runs the chosen ones in the order in which they were written, and tells a reporter.

local context = require "limax.test.context"
local engine = require "limax.engine"
local failure = require "limax.failure"
local host = require "limax.host"
local script = require "limax.script"
local test = require "limax.test"

local runner = {}

---@class limax.test_instance
---@field suite string
---@field case limax.case
---@field label string the test's name, with device and threads where it names them
---@field device string|nil
---@field threads integer|nil

---@class limax.suite_file
---@field path string as it was given
---@field instances limax.test_instance[]
---@field failure string|nil why it does not load

---@class limax.test_result
---@field status "passed"|"failed"|"skipped"
---@field text string|nil of a failure or the reason of a skip
---@field where string|nil FILE:LINE of a failed check
---@field notes string[]
---@field seconds number

-- The combinations of devices and threads that a test names.
local function instances_of(suite, case)
  local list = {}
  local devices = case.devices or (case.threads and { "cpu" }) or { false }
  for _, device in ipairs(devices) do
    for _, threads in ipairs(case.threads or { false }) do
      local parts = {}
      if case.devices then parts[1] = device end
      if threads then parts[#parts + 1] = threads == 1 and "1 thread" or threads .. " threads" end
      local label = case.name
      if #parts > 0 then label = ("%s [%s]"):format(label, table.concat(parts, ", ")) end
      list[#list + 1] = {
        suite = suite.name, case = case, label = label,
        device = device or nil, threads = threads or nil,
      }
    end
  end
  return list
end

-- A message and the lines of its trace, without those of the binding.
local function own_lines(trace)
  local lines = {}
  for line in tostring(trace):gmatch "[^\n]+" do
    local binding = #lines > 0 and line:find(host.home .. "/bindings/", 1, true)
    if not binding then lines[#lines + 1] = line end
  end
  return table.concat(lines, "\n")
end

--- Reads one file. What it requires from its own folder is forgotten afterwards, so that each file
--- begins afresh.
---@param path string
---@return limax.suite_file
function runner.load(path)
  local path_before, loaded = package.path, {}
  for name in pairs(package.loaded) do loaded[name] = true end
  local message
  local suites = test.collect(function()
    local fine, value, trace = host.protect(script.run, path)
    if fine then return end
    if value == host.interrupt then error(value, 0) end
    message = failure.status(value) and value or own_lines(trace)
  end)
  package.path = path_before
  for name in pairs(package.loaded) do
    if not loaded[name] and name:sub(1, 5) ~= "limax" then package.loaded[name] = nil end
  end
  local file = { path = path, instances = {}, failure = message }
  for _, suite in ipairs(message and {} or suites) do
    for _, case in ipairs(suite.cases) do
      for _, instance in ipairs(instances_of(suite, case)) do
        file.instances[#file.instances + 1] = instance
      end
    end
  end
  if not message and #suites == 0 then
    file.failure = ("%s begins no suite; its first line should be "
      .. 'local suite = require("limax.test").suite "NAME"'):format(path)
  end
  return file
end

--- Lua files of the paths: files as they are, of a folder those that lie in it, sorted.
---@param paths string[]
---@return string[]
function runner.files(paths)
  local files = {}
  for _, path in ipairs(paths) do
    if host.file.exists(path) == "folder" then
      local folder, before = path:gsub("/+$", ""), #files
      for _, name in ipairs(host.file.list(path) or {}) do
        if name:match "%.lua$" then files[#files + 1] = folder .. "/" .. name end
      end
      if #files == before then failure.raise(2, ("%s holds no .lua file"):format(path)) end
    else
      files[#files + 1] = path
    end
  end
  return files
end

---@class limax.test_choice
---@field filter string|nil part of "SUITE: TEST", as it stands or as a Lua pattern
---@field tags string[] at least one of these; "-slow": not this one

-- Tests with this tag take minutes: they run only where it is asked for.
local LONG = "full"

--- Whether an instance is among the chosen.
---@param instance limax.test_instance
---@param choice limax.test_choice
---@return boolean
function runner.chosen(instance, choice)
  local name = ("%s: %s"):format(instance.suite, instance.label)
  local filter = choice.filter
  if filter and not name:find(filter, 1, true) and not name:find(filter) then return false end
  local has = {}
  for _, tag in ipairs(instance.case.tags) do has[tag] = true end
  local wanted, found, long_wanted = false, false, false
  for _, tag in ipairs(choice.tags) do
    long_wanted = long_wanted or tag == LONG
    local refused = tag:match "^%-(.+)$"
    if refused and has[refused] then return false end
    if not refused then
      wanted = true
      found = found or has[tag] or false
    end
  end
  if has[LONG] and not long_wanted then return false end
  return found or not wanted
end

-- The device of an instance; nil and a reason where this machine has none.
local function open_device(instance)
  local name = instance.device
  if not name then return nil end
  local fine, device = pcall(engine.device, name, { threads = instance.threads })
  if fine then return device end
  if device == host.interrupt then error(device, 0) end
  -- without the line, which is the runner's
  return nil, (tostring(device):gsub("^[^\n:]+:%d+: ", ""))
end

local function outcome(fine, value, trace)
  if fine then return { status = "passed" } end
  local class = type(value) == "table" and getmetatable(value)
  if class == context.skipped then return { status = "skipped", text = value.reason } end
  if class == context.failure then
    return { status = "failed", text = value.text, where = value.where }
  end
  return { status = "failed", text = own_lines(trace or value) }
end

--- Runs one instance.
---@param file limax.suite_file
---@param instance limax.test_instance
---@param goldens table<string, string> owners of golden names, shared by a file's tests
---@param update boolean record goldens
---@return limax.test_result
function runner.run(file, instance, goldens, update)
  local started = host.clock()
  local device, reason = open_device(instance)
  local result, interrupted
  local t = context.new {
    name = instance.case.name, suite = instance.suite, file = file.path, device = device,
    threads = instance.threads, goldens = goldens, update = update,
  }
  if reason then
    -- only an accelerator may be missing; a CPU that does not open is a failure
    result = { status = instance.device == "cpu" and "failed" or "skipped", text = reason }
  else
    local limit = instance.case.limit
    engine.limit_time(limit)
    local fine, value, trace = host.protect(instance.case.run, t)
    engine.limit_time(nil)
    interrupted = not fine and value == host.interrupt
    result = outcome(fine, value, trace)
    local took = host.clock() - started
    if fine and limit and took > limit then
      result = { status = "failed", text = ("took %.3g s; its limit is %g s"):format(took, limit) }
    end
  end
  t:close()
  if interrupted then error(host.interrupt, 0) end
  result.notes, result.seconds = t.notes, host.clock() - started
  -- what a test leaves to the collector ends here, and not within the next one
  collectgarbage "collect"
  return result
end

---@class limax.test_counts
---@field passed integer
---@field failed integer
---@field skipped integer

--- Runs the chosen tests of all files.
---@param files limax.suite_file[]
---@param choice limax.test_choice
---@param update boolean
---@param reporter table see report.lua
---@return limax.test_counts
function runner.run_all(files, choice, update, reporter)
  local plan, total = {}, 0
  for i, file in ipairs(files) do
    plan[i] = {}
    for _, instance in ipairs(file.instances) do
      if runner.chosen(instance, choice) then table.insert(plan[i], instance) end
    end
    total = total + #plan[i] + (file.failure and 1 or 0)
  end
  local counts = { passed = 0, failed = 0, skipped = 0 }
  reporter:begin(total)
  for i, file in ipairs(files) do
    if file.failure or #plan[i] > 0 then reporter:file(file) end
    local goldens = {}
    if file.failure then counts.failed = counts.failed + 1 end
    for _, instance in ipairs(plan[i]) do
      local result = runner.run(file, instance, goldens, update)
      counts[result.status] = counts[result.status] + 1
      reporter:result(instance, result)
    end
  end
  reporter:finish(counts)
  return counts
end

return runner
