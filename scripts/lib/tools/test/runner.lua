--- runner.lua: loads suite files, makes an instance of each test for every combination of its
--- matrix, and runs the chosen ones in the order of the file.

local axes = require "limax.tools.test.axes"
local choices = require "limax.base.choice"
local context = require "limax.tools.test.context"
local engine = require "limax.engine"
local failure = require "limax.base.failure"
local host = require "limax.host"
local script = require "limax.base.script"
local test = require "limax.test"

local runner = {}

---@class limax.test_instance
---@field suite string
---@field fixtures table<string, limax.test_fixture> of its suite
---@field case limax.case
---@field label string the test's name and its values of the matrix
---@field limit number|nil s of wall time
---@field values table<string, any> device, precision, integrator, threads, seed

---@class limax.suite_file
---@field path string
---@field instances limax.test_instance[]
---@field failure string|nil why it does not load

local function instances_of(suite, case)
  local list = {}
  for _, one in ipairs(axes.combinations(case.axes)) do
    -- only the CPU has threads
    if one.values.threads and not one.values.device then one.values.device = "cpu" end
    list[#list + 1] = {
      suite = suite.name, fixtures = suite.fixtures, case = case, values = one.values,
      label = one.text == "" and case.name or ("%s [%s]"):format(case.name, one.text),
    }
  end
  return list
end

-- A message and its traceback without the frames of the binding and of `limax test`.
local function own_lines(trace)
  local lines = {}
  for line in tostring(trace):gsub("\n\t", "\n  "):gmatch "[^\n]+" do
    local ours = false
    for _, place in ipairs { "/bindings/", "/scripts/lib/tools/test/",
      "/scripts/commands/test.lua:" } do
      ours = ours or line:find(host.home .. place, 1, true) ~= nil
    end
    if #lines == 0 or not ours then lines[#lines + 1] = line end
  end
  return table.concat(lines, "\n")
end

-- A protected call in which os.exit raises: its status would hide failed tests.
local function without_exit(protect, ...)
  rawset(os, "exit", function() error("a suite must not end its process: os.exit", 2) end)
  local function finish(...)
    rawset(os, "exit", nil)
    return ...
  end
  return finish(protect(...))
end

--- "SUITE: TEST", for --only and --filter.
function runner.title(instance) return ("%s: %s"):format(instance.suite, instance.label) end

-- s that a file may take to load
local LONGEST_LOAD = 60

-- Runs a file; limax's own suites also find tests/support.
local function run_file(path)
  local chunk = script.load(path)
  local tests = host.home .. "/tests"
  if host.file.absolute(path):sub(1, #tests + 1) == tests .. "/" then
    package.path = ("%s;%s/?.lua"):format(package.path, tests)
  end
  return chunk()
end

--- Loads one file. What it requires from its own folder is unloaded afterwards, so that files do
--- not affect each other.
---@param longest? number s that it may take, 60 if absent
function runner.load(path, longest)
  local path_before, loaded = package.path, {}
  for name in pairs(package.loaded) do loaded[name] = true end
  local message
  local suites = test.collect(function()
    local fine, value, trace = without_exit(failure.attempt_within, longest or LONGEST_LOAD,
      run_file, path)
    if fine then return end
    message = failure.status(value) and tostring(value) or own_lines(trace)
  end)
  package.path = path_before
  for name in pairs(package.loaded) do
    if not loaded[name] and name:sub(1, 5) ~= "limax" then package.loaded[name] = nil end
  end
  local file, titles = { path = path, instances = {}, failure = message }, {}
  for _, suite in ipairs(message and {} or suites) do
    for _, case in ipairs(suite.cases) do
      for _, instance in ipairs(instances_of(suite, case)) do
        local title = runner.title(instance)
        if titles[title] then
          file.failure = ("%s: there are two tests %q"):format(path, title)
        end
        titles[title] = true
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

--- The files of the paths; of a folder its .lua files, sorted.
function runner.files(paths)
  local files = {}
  for _, path in ipairs(paths) do
    if host.file.exists(path) == "folder" then
      local folder, before = path:gsub("/+$", ""), #files
      local names, message = host.file.list(path)
      if not names then failure.raise(2, message) end
      for _, name in ipairs(names) do
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
---@field only string[] "SUITE: TEST" in full; where there is one, nothing else runs
---@field filter string|nil part of "SUITE: TEST", literally or as a Lua pattern
---@field tags string[] at least one of these; "-slow": not this one
---@field limit number|nil s of tests that set none

-- Tests with this tag take minutes: they run only if it or their title is named.
local LONG = "full"

--- Whether an instance is among the chosen.
function runner.chosen(instance, choice)
  local name = runner.title(instance)
  if #choice.only > 0 then return choices.contains(choice.only, name) end
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

local function outcome(checks, fine, value, trace)
  if fine and checks == 0 then
    return { status = "failed", text = "it passed without a check: call t:ok, t:near, t:equal,"
      .. " t:raises, t:golden or t:statistically" }
  elseif fine then
    return { status = "passed" }
  end
  local class = type(value) == "table" and getmetatable(value)
  if class == context.skipped then return { status = "skipped", text = value.reason } end
  if class == context.failure then
    return { status = "failed", text = value.text, where = value.where }
  end
  local first = failure.first_trace(value)
  return { status = "failed", text = own_lines(first or trace or value) }
end

-- The device of an instance, or the result of one that cannot run.
local function prepare(instance)
  local name = instance.values.device
  local reason = instance.case.skip or axes.impossible(instance.values)
  if reason then return nil, { status = "skipped", text = reason } end
  if not name then return nil end
  local fine, device = pcall(engine.device, name, { threads = instance.values.threads })
  if fine then return device end
  if device == host.interrupt then error(device, 0) end
  -- only a GPU may be missing
  return nil, { status = name == "cpu" and "failed" or "skipped", text = failure.bare(device) }
end

-- Runs a test: the event of its result.
local function run(file, instance, state)
  local started = host.clock()
  local device, result = prepare(instance)
  local interrupted
  local t = context.new {
    name = instance.case.name, suite = instance.suite, file = file.path, device = device,
    threads = instance.values.threads, precision = instance.values.precision,
    integrator = instance.values.integrator, seed = instance.values.seed,
    fixtures = instance.fixtures, state = state,
  }
  if not result then
    local limit = instance.limit
    local fine, value, trace = without_exit(host.protect, instance.case.run, t)
    interrupted = not fine and value == host.interrupt
    result = outcome(t.checks, fine, value, trace)
    local took = host.clock() - started
    if fine and limit and took > limit then
      result = { status = "failed", text = ("took %.3g s; its limit is %g s"):format(took, limit) }
    end
  end
  local wrong = t:close()
  if interrupted then error(host.interrupt, 0) end
  if wrong and result.status == "passed" then result = { status = "failed", text = wrong } end
  result.event, result.suite, result.test = "test", instance.suite, instance.label
  result.notes, result.seconds = host.json.array(t.notes), host.clock() - started
  -- so that garbage of this test does not slow the next one
  collectgarbage "collect"
  return result
end

---@class limax.test_plan
---@field files { file: limax.suite_file, instances: limax.test_instance[] }[]
---@field total integer tests, and files that do not load

--- The chosen tests, file by file, in their order.
function runner.plan(files, choice)
  local plan = { files = {}, total = 0 }
  for _, file in ipairs(files) do
    local instances = {}
    for _, instance in ipairs(file.failure and {} or file.instances) do
      if runner.chosen(instance, choice) then
        instance.limit = instance.case.limit or choice.limit
        table.insert(instances, instance)
      end
    end
    if file.failure or #instances > 0 then
      table.insert(plan.files, { file = file, instances = instances })
      plan.total = plan.total + #instances + (file.failure and 1 or 0)
    end
  end
  return plan
end

--- Runs a plan in this process.
---@param update { reason: string|nil }|nil see golden.lua
---@param take fun(event: limax.test_event) see report.lua
function runner.run_all(plan, update, take)
  for _, entry in ipairs(plan.files) do
    local file, state = entry.file, context.file_state(update)
    take { event = "file", path = file.path, failure = file.failure }
    for i, instance in ipairs(entry.instances) do
      -- a test that never returns cannot report itself
      take { event = "start", suite = instance.suite, test = instance.label,
        limit = instance.limit }
      local result = run(file, instance, state)
      local wrong = i == #entry.instances and context.close_all(state.closing)
      if wrong and result.status == "passed" then
        result.status, result.text = "failed", wrong
      end
      take(result)
    end
  end
end

return runner
