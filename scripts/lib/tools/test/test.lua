--- test.lua: the module of suite files:
---
---   local suite = require("limax.test").suite "my walker"
---   suite:test("travels", { devices = "all", limit = 20 }, function(t)
---     t:near(robot:distance(), 0.413, { rtol = 1e-3 })
---   end)
---
--- A suite only collects its tests; `limax test` (runner.lua) runs them. The methods of `t` are in
--- context.lua.

local axes = require "limax.tools.test.axes"
local engine = require "limax.engine"
local schema = require "limax.engine.schema"
local strict = require "limax.engine.strict"

local test = {}

--- The devices that `devices = "all"` selects, in the order in which they run.
test.DEVICES = axes.list[1].all

local OPTIONS = {
  limit = schema.number { above = 0, unit = "s" }, skip = schema.text(".+", "a reason"),
  tags = schema.any,
}
for _, axis in ipairs(axes.list) do OPTIONS[axis.option] = schema.any end
local test_options = schema.fields(OPTIONS)
local fixture_options = schema.fields { shared = schema.boolean(false), close = schema.any }
local one_line = schema.text("%C+", "one line of text")

-- A test runs once for every combination of its devices, precisions, integrators, threads and
-- seeds.
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
---@field axes table<string, any[]> see axes.lua
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
---@field cases limax.case[] in the order of the file
---@field fixtures table<string, limax.test_fixture> by name
local methods = {}
local class = { __index = methods }

-- the suites of the file that is being read
local collected = {}

local function check_function(value, path)
  if type(value) ~= "function" then schema.refuse(path, "a function", value) end
end

-- Checks the arguments of a method that takes a name, options that may be left out, and a function.
local function read_arguments(self, method, name, options, call, rule)
  if getmetatable(self) ~= class then
    engine.fail(("write a colon: suite:%s(...)"):format(method))
  end
  if call == nil then options, call = {}, options end
  local what = "suite:" .. method
  schema.demand(one_line, name, what .. ": name")
  check_function(call, what)
  return schema.demand(rule, options, what), call
end

--- Adds a test. Its name must be unique within the suite.
---@param name string
---@param options limax.test_options|nil may be left out
---@param run fun(t: limax.test_context)
---@overload fun(self: limax.suite, name: string, run: fun(t: limax.test_context))
function methods:test(name, options, run)
  options, run = read_arguments(self, "test", name, options, run, test_options)
  for _, case in ipairs(self.cases) do
    if case.name == name then
      engine.fail(("suite %q already has a test %q"):format(self.name, name))
    end
  end
  local tags = options.tags or {}
  self.cases[#self.cases + 1] = { name = name, run = run, limit = options.limit,
    skip = options.skip, axes = axes.read(options),
    tags = type(tags) == "table" and tags or { tags } }
end

--- Defines what several tests start with: `t:fixture(name)` makes it at the first use in a test,
--- and `close` ends it after that test. A shared one is made once for the file, without a `t`, and
--- ended after the file's last test; tests must not change it.
---@param name string
---@param options { close: fun(value: any)|nil, shared: boolean|nil }|nil may be left out
---@param make fun(t: limax.test_context|nil): any
---@overload fun(self: limax.suite, name: string, make: fun(t: limax.test_context): any)
function methods:fixture(name, options, make)
  options, make = read_arguments(self, "fixture", name, options, make, fixture_options)
  if options.close ~= nil then check_function(options.close, "suite:fixture.close") end
  if self.fixtures[name] then
    engine.fail(("suite %q already has a fixture %q"):format(self.name, name))
  end
  self.fixtures[name] = { make = make, close = options.close, shared = options.shared }
end

--- Begins a suite.
---@param name string
---@return limax.suite
function test.suite(name)
  schema.demand(one_line, name, "suite: name")
  for _, suite in ipairs(collected) do
    if suite.name == name then engine.fail(("this file already has a suite %q"):format(name)) end
  end
  local suite = setmetatable({ name = name, cases = {}, fixtures = {} }, class)
  collected[#collected + 1] = suite
  return suite
end

--- Did a file begin a suite although `limax test` does not run it?
---@return boolean
function test.begun() return #collected > 0 end

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

return strict.close("limax.test", test)
