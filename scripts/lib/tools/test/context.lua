--- context.lua: `t` of a test: its checks, device and golden values. A check that fails ends the
--- test and reports its line in the suite, what was expected and what it got.

local choice = require "limax.base.choice"
local host = require "limax.host"
local compare = require "limax.tools.test.compare"
local engine = require "limax.engine"
local golden = require "limax.tools.test.golden"
local schema = require "limax.engine.schema"
local statistics = require "limax.tools.test.statistics"
local strict = require "limax.engine.strict"
local suggest = require "limax.engine.suggest"

local context = {}

-- rounding of a few operations: the default of `near`
local NEAR = 1e-9

---@class limax.test_context
---@field name string of the test
---@field suite string its suite's name
---@field file string path of the suite's file
---@field device limax.device|nil if the test names devices or threads
---@field threads integer|nil if the test names threads
---@field precision string|nil if the test names precisions
---@field integrator string|nil if the test names integrators
---@field seed integer|nil if the test names seeds
---@field checks integer that were made
local methods = {}
local class = {}

-- Fields that a test may lack, by its matrix.
local MAY_LACK = { device = true, threads = true, precision = true, integrator = true, seed = true }

function class.__index(_, key)
  if methods[key] or MAY_LACK[key] then return methods[key] end
  strict.unknown("a test's t", key, methods, MAY_LACK)
end

--- The class of a failed check: `text` and `where`, FILE:LINE.
context.failure = {
  __tostring = function(self) return ("%s: %s"):format(self.where, self.text) end,
}

--- The class of a skipped test: its `reason`.
context.skipped = { __tostring = function(self) return "skipped: " .. self.reason end }

local function fail(text)
  local _, line, source = engine.place()
  error(setmetatable({ text = text, where = ("%s:%d"):format(source, line) }, context.failure), 0)
end

local tolerance = schema.number { minimum = 0 }
local near_options = schema.fields { rtol = tolerance, atol = tolerance }
local golden_options = schema.fields { class = schema.choice(golden.class_names),
  rtol = tolerance, atol = tolerance, why = schema.any }
local statistics_options = schema.fields { seeds = schema.any, expected = schema.any,
  rtol = tolerance, atol = tolerance, at_least = schema.any, at_most = schema.any,
  level = schema.number { above = 0, below = 1 } }

-- Options of a check, with defaults.
local function checked(rule, options, what)
  local result, message = rule(options, what)
  if message then fail(message) end
  return result
end

local function report(what, differences)
  if #differences == 0 then return end
  local text = ("%s: %s"):format(what, compare.text(differences[1]))
  if #differences > 1 then text = ("%s (the worst of %d)"):format(text, #differences) end
  fail(text)
end

--- Fails unless |got - expected| <= atol + rtol |expected|, for numbers and for every number of
--- nested tables and views. Without a tolerance, rtol is 1e-9.
---@param got any
---@param expected any
---@param options { rtol: number|nil, atol: number|nil }|nil
function methods:near(got, expected, options)
  options = checked(near_options, options, "near")
  local atol = options.atol or 0
  local rtol = options.rtol or (options.atol and 0 or NEAR)
  report(("near (rtol %g, atol %g)"):format(rtol, atol),
    compare.near(expected, got, { rtol = rtol, atol = atol }))
end

--- Fails unless every number has the same 64 bits, and all else is equal.
---@param got any
---@param expected any
function methods:same_bits(got, expected)
  report("same_bits", compare.same_bits(expected, got))
end

--- Calls `draw` for each seed, and fails if chance would explain its values less often than
--- `level`: their mean against `expected`, `at_least` or `at_most` by Student's t. Prints the mean.
---@param draw fun(seed: integer): number|boolean
---@param options limax.test_statistics
function methods:statistically(draw, options)
  options = checked(statistics_options, options, "statistically")
  local failure, text = statistics.check(draw, options)
  if failure then fail("statistically: " .. failure) end
  self:note(text)
end

--- Fails unless both are equal, element by element; NaN equals NaN.
---@param got any
---@param expected any
function methods:equal(got, expected) report("equal", compare.equal(expected, got)) end

--- Fails unless `condition` is true (or anything but nil and false).
---@param condition any
---@param text string|nil what should hold
function methods:ok(condition, text)
  if not condition then
    fail(text or ("expected a true value, got %s"):format(tostring(condition)))
  elseif condition == 0 then
    fail "ok: got 0, which is true in Lua; compare it, such as t:ok(count > 0)"
  end
  return condition
end

--- Fails unless `call` raises a message that contains `pattern`, literally or as a Lua pattern.
---@param pattern string
---@param call fun()
---@return string message that was raised
function methods:raises(pattern, call)
  if type(pattern) ~= "string" or type(call) ~= "function" then
    fail 'raises: write t:raises("a part of the message", function() ... end)'
  end
  local fine, message = pcall(call)
  if fine then fail(("raises: expected an error with %q, and none was raised"):format(pattern)) end
  local class_of = type(message) == "table" and getmetatable(message)
  if message == host.interrupt or class_of == context.failure or class_of == context.skipped then
    error(message, 0)
  end
  message = tostring(message)
  if not message:find(pattern, 1, true) and not message:find(pattern) then
    fail(("raises: expected an error with %q, got %q"):format(pattern, message))
  end
  return message
end

--- Ends the test here, neither passed nor failed.
---@param reason string
function methods:skip(reason)
  error(setmetatable({ reason = tostring(reason) }, context.skipped), 0)
end

-- The tolerance of a golden: rtol, atol, why, and the name of its class.
local function golden_tolerance(options)
  local kind = golden.class(options.class, options.rtol, options.atol)
  local rtol, atol, why = options.rtol, options.atol or 0, options.why
  if rtol == nil then rtol = options.class and kind.rtol or 0 end
  if rtol > kind.most then
    fail(("golden: rtol %g is more than the class %q allows, %g"):format(rtol, kind.name,
      kind.most))
  end
  if (rtol > 0 or atol > 0) and (type(why) ~= "string" or why == "") then
    fail "golden: a tolerance needs a reason: why = \"...\""
  end
  return rtol, atol, why or "the same bits", kind.name
end

--- Fails unless the values are near those recorded in golden/SUITE_FILE/NAME.json. A missing golden
--- fails; `limax test --update-golden` records. `class` is the kind of tolerance ("bits",
--- "rounding", "short horizon", "statistics"), which sets rtol if it is left out; `why` is its
--- reason.
---@param name string letters, digits, _ and -
---@param values table numbers, strings, tables and views
---@param options { class: string|nil, rtol: number|nil, atol: number|nil, why: string|nil
--- }|nil exact if left out
function methods:golden(name, values, options)
  options = checked(golden_options, options, "golden")
  if type(name) ~= "string" or not name:match "^[%w_%-]+$" then
    fail(("golden: a name has letters, digits, _ and -, got %s"):format(tostring(name)))
  end
  if type(values) ~= "table" then
    fail(("golden: expected a table of values, got %s"):format(tostring(values)))
  end
  local rtol, atol, why, kind = golden_tolerance(options)
  local goldens = self.state.goldens
  local owner = goldens[name]
  if owner and owner ~= self.name then
    fail(("golden: %q belongs to the test %q of this file"):format(name, owner))
  end
  goldens[name] = self.name
  -- the other instances of a test compare with what the first has recorded
  local update = not self.state.recorded[name] and self.state.update or nil
  local failure, change = golden.check({
    path = golden.path(self.file, name), suite = self.suite, test = self.name, name = name,
    values = values, class = kind, rtol = rtol, atol = atol, why = why,
    device = self.device and tostring(self.device) or "the default",
  }, update)
  if failure then fail(failure) end
  if change then
    self.state.recorded[name] = true
    self:note(("golden %s: %s"):format(name, change))
  end
end

--- Prints a line with the test's result.
---@param text string
function methods:note(text) self.notes[#self.notes + 1] = tostring(text) end

--- The value of the suite's fixture of this name, which is made once for this test, or once for the
--- file if it is shared.
---@param name string
---@return any
function methods:fixture(name)
  local fixture = self.fixtures[name]
  if not fixture then
    fail(("fixture: the suite has no %q%s"):format(tostring(name),
      suggest.ending(name, choice.sorted_keys(self.fixtures))))
  end
  local shared = fixture.shared
  local kept = shared and self.state.shared or self.made
  local key = shared and self.suite .. "\0" .. name or name
  if kept[key] == nil then
    -- a shared one belongs to no test
    local value = fixture.make(not shared and self or nil)
    if value == nil then fail(("fixture: %q made nothing"):format(name)) end
    kept[key] = value
    if fixture.close then
      table.insert(shared and self.state.closing or self.closing,
        function() fixture.close(value) end)
    end
  end
  return kept[key]
end

--- Options of a simulation with the device, precision and integrator of the test's matrix.
---@param options table|nil
---@return table
function methods:with(options)
  local merged = { device = self.device, precision = self.precision,
    integrator = self.integrator }
  for name, value in pairs(options or {}) do merged[name] = value end
  return merged
end

--- A new, empty folder, removed after the test.
---@return string path
function methods:folder()
  local path, message = host.file.temporary()
  if not path then fail("folder: " .. message) end
  self.folders[#self.folders + 1] = path
  return path
end

--- Ends fixtures, the last made first.
---@param closing fun()[]
---@return string|nil failure of the first that failed
function context.close_all(closing)
  local wrong
  for i = #closing, 1, -1 do
    local fine, message = pcall(closing[i])
    if not fine then wrong = wrong or ("a fixture's close: " .. tostring(message)) end
  end
  return wrong
end

--- Ends what a test has opened: fixtures, the last made first, then its folders and its device.
---@return string|nil failure of a fixture's close
function methods:close()
  local wrong = context.close_all(self.closing)
  for _, path in ipairs(self.folders) do host.file.remove_temporary(path) end
  if self.device then self.device:free "its test was over" end
  return wrong
end

local CHECKS = { near = true, same_bits = true, statistically = true, equal = true, ok = true,
  raises = true, golden = true }

-- `t.near(...)` instead of `t:near(...)`; and the number of checks.
for name, method in pairs(methods) do
  methods[name] = function(self, ...)
    if getmetatable(self) ~= class then fail(("write a colon: t:%s(...)"):format(name)) end
    if CHECKS[name] then self.checks = self.checks + 1 end
    return method(self, ...)
  end
end

---@class limax.test_file_state what the tests of a file share
---@field update { reason: string|nil }|nil
---@field goldens table<string, string> the test that owns each golden of the file
---@field recorded table<string, boolean> goldens that this run has recorded
---@field shared table<string, any> shared fixtures by suite and name
---@field closing fun()[] end them

---@param update { reason: string|nil }|nil how goldens are recorded; nil: they are compared
---@return limax.test_file_state
function context.file_state(update)
  return { update = update, goldens = {}, recorded = {}, shared = {}, closing = {} }
end

---@param fields table those of limax.test_context, fixtures and state
---@return limax.test_context
function context.new(fields)
  fields.notes, fields.folders, fields.made, fields.closing, fields.checks = {}, {}, {}, {}, 0
  return setmetatable(fields, class)
end

return context
