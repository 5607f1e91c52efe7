--- test.lua: what a suite file is written with:
---
---   local suite = require("limax.test").suite "my walker"
---   suite:test("travels", { devices = "all", limit = 20 }, function(t)
---     t:near(robot:distance(), 0.413, { rtol = 1e-3 })
---   end)
---
--- A suite only collects its tests; `limax test` (test/runner.lua) runs them. What `t` can do is in
--- test/context.lua.

local engine = require "limax.engine"
local suggest = require "limax.suggest"

local test = {}

--- The devices that `devices = "all"` stands for, in the order in which they are tried.
test.DEVICES = { "cpu", "cuda" }

local OPTIONS = { "devices", "threads", "limit", "tags" }

---@class limax.test_options
---@field devices "all"|string[]|nil run once on each; t.device is the open device
---@field threads integer[]|integer|nil run once with each number of threads; t.threads is it
---@field limit number|nil seconds of wall time that the test may take
---@field tags string[]|string|nil names to choose tests by

---@class limax.case
---@field name string
---@field devices string[]|nil
---@field threads integer[]|nil
---@field limit number|nil
---@field tags string[]
---@field run fun(t: limax.test_context)

---@class limax.suite
---@field name string
---@field cases limax.case[] in the order in which they were written
local methods = {}
local class = { __index = methods }

-- the list that suites are collected into while a file is read
local collected = {}

local function fail(what, expected, value)
  engine.fail(("%s: expected %s, got %s"):format(what, expected, tostring(value)))
end

local function list_of(what, value, kind)
  if value == nil then return nil end
  if type(value) ~= "table" then value = { value } end
  for i, entry in ipairs(value) do
    if type(entry) ~= kind then fail(("%s[%d]"):format(what, i), "a " .. kind, entry) end
  end
  return value
end

local function devices_of(value)
  if value == "all" then return test.DEVICES end
  local devices = list_of("devices", value, "string")
  for _, name in ipairs(devices or {}) do
    local known = false
    for _, device in ipairs(test.DEVICES) do known = known or device == name end
    if not known then
      engine.fail(("devices: unknown device %q%s"):format(name, suggest.ending(name, test.DEVICES)))
    end
  end
  return devices
end

--- Adds a test. Its name must be its own within the suite.
---@param name string
---@param options limax.test_options|nil may be left out
---@param run fun(t: limax.test_context)
---@overload fun(self: limax.suite, name: string, run: fun(t: limax.test_context))
function methods:test(name, options, run)
  if run == nil then options, run = {}, options end
  if type(name) ~= "string" or name == "" then fail("suite:test: name", "a string", name) end
  if type(options) ~= "table" then fail("suite:test: options", "a table", options) end
  if type(run) ~= "function" then fail("suite:test", "a function to run", run) end
  for _, case in ipairs(self.cases) do
    if case.name == name then
      engine.fail(("suite %q has a test %q already"):format(self.name, name))
    end
  end
  local unknown = {}
  for option in pairs(options) do
    local known = false
    for _, each in ipairs(OPTIONS) do known = known or each == option end
    if not known then unknown[#unknown + 1] = tostring(option) end
  end
  table.sort(unknown)
  if unknown[1] then
    engine.fail(("suite:test: unknown option %q%s"):format(unknown[1],
      suggest.ending(unknown[1], OPTIONS)))
  end
  if options.limit ~= nil and (type(options.limit) ~= "number" or not (options.limit > 0)) then
    fail("suite:test: limit", "a number of seconds above 0", options.limit)
  end
  self.cases[#self.cases + 1] = {
    name = name, run = run, limit = options.limit,
    devices = devices_of(options.devices), threads = list_of("threads", options.threads, "number"),
    tags = list_of("tags", options.tags, "string") or {},
  }
end

--- Begins a suite.
---@param name string
---@return limax.suite
function test.suite(name)
  if type(name) ~= "string" or name == "" then fail("suite: name", "a string", name) end
  for _, suite in ipairs(collected) do
    if suite.name == name then engine.fail(("this file has a suite %q already"):format(name)) end
  end
  local suite = setmetatable({ name = name, cases = {} }, class)
  collected[#collected + 1] = suite
  return suite
end

--- Calls `read`, which raises nothing, and returns the suites that it began.
---@param read fun()
---@return limax.suite[]
function test.collect(read)
  local before = collected
  collected = {}
  read()
  local suites = collected
  collected = before
  return suites
end

return test
