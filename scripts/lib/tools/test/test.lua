--- test.lua: what a suite file is written with:
---
---   local suite = require("limax.test").suite "my walker"
---   suite:test("travels", { devices = "all", limit = 20 }, function(t)
---     t:near(robot:distance(), 0.413, { rtol = 1e-3 })
---   end)
---
--- A suite only collects its tests; `limax test` (test/runner.lua) runs them. What `t` can do is in
--- test/context.lua.

local axes = require "limax.tools.test.axes"
local engine = require "limax.engine"
local suggest = require "limax.engine.suggest"

local test = {}

--- The devices that `devices = "all"` stands for, in the order in which they are tried.
test.DEVICES = axes.list[1].all

local OPTIONS = { "limit", "skip", "tags" }
for _, axis in ipairs(axes.list) do OPTIONS[#OPTIONS + 1] = axis.option end
local FIXTURE_OPTIONS = { "close", "shared" }

-- A test runs once for every combination of what it names of devices, precisions, integrators,
-- threads and seeds.
---@class limax.test_options
---@field devices "all"|string[]|string|nil t.device is the open device
---@field precisions "all"|string[]|string|nil t.precision is one of them
---@field integrators "all"|string[]|string|nil t.integrator is one of them
---@field threads integer[]|integer|nil of the CPU's device; t.threads is the number
---@field seeds integer[]|integer|nil t.seed is one of them
---@field limit number|nil seconds of wall time that the test may take
---@field skip string|nil why the test does not run for now
---@field tags string[]|string|nil names to choose tests by

---@class limax.case
---@field name string
---@field axes table<string, any[]> see test/axes.lua
---@field limit number|nil
---@field skip string|nil
---@field tags string[]
---@field run fun(t: limax.test_context)

---@class limax.test_fixture
---@field make fun(t: limax.test_context|nil): any
---@field close fun(value: any)|nil
---@field shared boolean

---@class limax.suite
---@field name string in reports
---@field cases limax.case[] in the order in which they were written
---@field fixtures table<string, limax.test_fixture> by name
local methods = {}
local class = { __index = methods }

-- the list that suites are collected into while a file is read
local collected = {}

local function fail(what, expected, value)
  engine.fail(("%s: expected %s, got %s"):format(what, expected, tostring(value)))
end

-- A name of one line, as it is printed and typed.
local function check_name(what, name)
  if type(name) ~= "string" or name == "" then fail(what, "a string", name) end
  if name:find "%c" then
    engine.fail(("%s: expected one line, got %q"):format(what, name))
  end
end

-- `suite.test(...)` in the place of `suite:test(...)`.
local function check_suite(self, method)
  if getmetatable(self) ~= class then
    engine.fail(("write a colon: suite:%s(...)"):format(method))
  end
end

local function check_names(what, options, known)
  local unknown = {}
  for option in pairs(options) do
    local is_known = false
    for _, each in ipairs(known) do is_known = is_known or each == option end
    if not is_known then unknown[#unknown + 1] = tostring(option) end
  end
  table.sort(unknown)
  if unknown[1] then
    engine.fail(("%s: unknown option %q%s"):format(what, unknown[1],
      suggest.ending(unknown[1], known)))
  end
end

--- Adds a test. Its name must be its own within the suite.
---@param name string
---@param options limax.test_options|nil may be left out
---@param run fun(t: limax.test_context)
---@overload fun(self: limax.suite, name: string, run: fun(t: limax.test_context))
function methods:test(name, options, run)
  check_suite(self, "test")
  if run == nil then options, run = {}, options end
  check_name("suite:test: name", name)
  if type(options) ~= "table" then fail("suite:test: options", "a table", options) end
  if type(run) ~= "function" then fail("suite:test", "a function to run", run) end
  for _, case in ipairs(self.cases) do
    if case.name == name then
      engine.fail(("suite %q has a test %q already"):format(self.name, name))
    end
  end
  check_names("suite:test", options, OPTIONS)
  if options.limit ~= nil and (type(options.limit) ~= "number" or not (options.limit > 0)) then
    fail("suite:test: limit", "a number of seconds above 0", options.limit)
  end
  if options.skip ~= nil and (type(options.skip) ~= "string" or options.skip == "") then
    fail("suite:test: skip", "a text that says why", options.skip)
  end
  self.cases[#self.cases + 1] = {
    name = name, run = run, limit = options.limit, skip = options.skip,
    axes = axes.read(options), tags = axes.list_of("tags", options.tags, "string") or {},
  }
end

--- Says how to make what several tests begin with: `t:fixture(name)` makes it when a test first
--- asks for it, and `close` ends it after that test. A shared one is made once for the file,
--- without a `t`, and ended after the file's last test: for what no test changes.
---@param name string
---@param options { close: fun(value: any)|nil, shared: boolean|nil }|nil may be left out
---@param make fun(t: limax.test_context|nil): any
---@overload fun(self: limax.suite, name: string, make: fun(t: limax.test_context): any)
function methods:fixture(name, options, make)
  check_suite(self, "fixture")
  if make == nil then options, make = {}, options end
  check_name("suite:fixture: name", name)
  if type(options) ~= "table" then fail("suite:fixture: options", "a table", options) end
  if type(make) ~= "function" then fail("suite:fixture", "a function that makes it", make) end
  check_names("suite:fixture", options, FIXTURE_OPTIONS)
  if options.close ~= nil and type(options.close) ~= "function" then
    fail("suite:fixture: close", "a function", options.close)
  end
  if self.fixtures[name] then
    engine.fail(("suite %q has a fixture %q already"):format(self.name, name))
  end
  self.fixtures[name] = { make = make, close = options.close, shared = options.shared == true }
end

--- Begins a suite.
---@param name string
---@return limax.suite
function test.suite(name)
  check_name("suite: name", name)
  for _, suite in ipairs(collected) do
    if suite.name == name then engine.fail(("this file has a suite %q already"):format(name)) end
  end
  local suite = setmetatable({ name = name, cases = {}, fixtures = {} }, class)
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
