--- json.lua: JSON: round trips, exact numbers, errors with their place, rows as lines.

local engine = require "limax.engine"
local ffi = require "ffi"
local host = require "limax.host"

local json = host.json

local suite = require("limax.test").suite "json"

suite:test("values are unchanged by a round trip", function(t)
  for _, text in ipairs {
    "null", "true", "0", "-0.0", '""', "[]", "{}", "[[],{}]", '{"":""}', '"\\u0000é\\"\\\\\\n"',
    '{"a":[1,2,{"b":null}],"c":[],"d":{}}', "9007199254740992", "-9007199254740992", "5e-324",
    "1.7976931348623157e+308", "0.1", "1e-07", "1e+20",
  } do
    t:equal(json.encode((json.decode(text))), text)
  end
  t:ok(json.decode "null" == json.null)
  t:equal(tostring(json.null), "null")
  t:equal(json.encode { b = 1, a = 2, [""] = 3, B = 4 }, '{"":3,"B":4,"a":2,"b":1}')
  t:equal(json.encode { json.array {}, {}, json.array { 1 } }, "[[],{},[1]]")
  t:equal({ json.is_array {}, json.is_array { 1 }, json.is_array(json.decode "[]") },
    { false, true, true })
  t:equal(json.encode "\127é", '"\127é"')
  t:equal(json.encode({ a = { 1, 2 }, b = { { 1 }, {} }, c = {} }, { indent = 2 }), [[
{
  "a": [1, 2],
  "b": [
    [1],
    {}
  ],
  "c": {}
}]])
end)

suite:test("every double reads back with the same bits", function(t)
  local bits, list = ffi.new "union { double number; uint32_t half[2]; }", {}
  local random = engine.random(1, 1, "user")
  for _ = 1, 20000 do
    bits.half[0], bits.half[1] = random:integer(2 ^ 32 - 1), random:integer(2 ^ 32 - 1)
    -- neither infinite nor a NaN
    local is_finite = bit.band(bits.half[1], 0x7ff00000) ~= 0x7ff00000
    list[#list + 1] = is_finite and bits.number or nil
  end
  t:ok(#list > 19000)
  t:same_bits(json.decode(json.encode(list)), list)
end)

suite:test("invalid text is refused with its origin, wrong syntax with its place", function(t)
  for text, expected in pairs {
    [""] = "line 1, column 1: ",
    ["[1,\n 2,]"] = "line 2, column 4: ",
    ['{"a": tru}'] = "line 1, column 10: ",
    ["[1] 2"] = "line 1, column 5: ",
    ["[1e400]"] = "number overflow",
    ["NaN"] = "line 1, column 1: ",
    ['{"a": 1,\n "b": 2, "a": 3}'] = 'some.json: the key "a" comes twice',
    ['{"\\"": 1, "\\"": 3}'] = 'some.json: the key """ comes twice',
    ["[9007199254740993]"] = "some.json: the whole number 9007199254740993 is beyond 2^53",
    ['["é",\n 123456789012345678901234]'] = "some.json: the whole number 12345678901234567",
    ['"é\255"'] = "line 1, column 3: not UTF-8",
    ['"\237\160\128"'] = "line 1, column 2: not UTF-8",
    ['"\\ud800"'] = "surrogate",
    ["[1\0]"] = "line 1, column 3: ",
    [("["):rep(201)] = "some.json: nested deeper than 200 levels",
  } do
    local value, message = json.decode(text, "some.json")
    t:equal(value, nil)
    t:ok(message:find("some.json: ", 1, true) == 1, message)
    t:ok(message:find(expected, 1, true), message)
  end
  t:ok(json.decode(("["):rep(200) .. ("]"):rep(200)))
  t:raises("string expected", function() json.decode(nil) end)
end)

suite:test("values that JSON cannot hold raise an error with their place", function(t)
  local itself = {}
  itself.again = itself
  for expected, value in pairs {
    ["NaN at a.b[2]"] = { a = { b = { 1, 0 / 0 } } },
    ["infinity at [1]"] = { 1 / 0 },
    ["an array with the key x"] = { 1, x = 2 },
    ["a key that is a number"] = { [2] = 1 },
    ["a key that is a boolean"] = { [true] = 1 },
    ["a function at f"] = { f = print },
    ["a cdata at c"] = { c = 1LL },
    ["a string that is not UTF-8 (byte 2) at s"] = { s = "a\255" },
    ["nested deeper than 200 levels (does it contain itself?)"] = itself,
  } do
    t:raises(expected, function() json.encode(value) end)
  end
  t:raises("a table with a metatable", function() json.array(setmetatable({}, {})) end)
end)
