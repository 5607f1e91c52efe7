--- repl_text.lua: how the prompt reads text (tokens, top-level `local`) and shows values.

local array_text = require "limax.tools.repl.array_text"
local chunk = require "limax.tools.repl.chunk"
local show = require "limax.tools.repl.show"
local tokens = require "limax.tools.repl.tokens"

local suite = require("limax.test").suite "repl text"

suite:test("tokens are names, keywords, strings and numbers", function(t)
  local texts = {}
  for i, token in ipairs(tokens.of [==[a.b{'x\'y', [[long]]} --[[ c ]] 0x1F "-- no" -- e]==]) do
    texts[i] = token.text
  end
  t:equal(texts, { "a", ".", "b", "{", [['x\'y']], ",", "[[long]]", "}", "0x1F", '"-- no"' })
end)

suite:test("a top-level local becomes an assignment, without moving text", function(t)
  local function kept(text) return (tokens.keep_locals(text)) end
  t:equal(kept "local x = 1", "      x = 1")
  t:equal(kept "local x", "      x = nil;")
  t:equal(kept "local x, y local z = 1", "      x, y = nil;       z = 1")
  t:equal(kept "local function f() local a = 1 end", "      function f() local a = 1 end")
  for _, text in ipairs { "do local x = 1 end", "for i = 1, 2 do local x = i end",
    "while f() do local x end", "repeat local x = 1 until x", "if a then local x = 1 end",
    "f(function() local x = 1 end)", "x = 'local y'", "-- local y", "x = [[\nlocal y]]" } do
    t:equal(kept(text), text)
  end
  -- after a block it is top-level again
  t:equal(kept "if a then b() end local x = 1", "if a then b() end       x = 1")
  t:equal(select(2, tokens.keep_locals "local a, b = 1\nlocal function c() end"), { "a", "b", "c" })
end)

suite:test("incomplete statements are distinguished from errors", function(t)
  local function state(text)
    local compiled, _, incomplete = chunk.compile(text, {}, "=input")
    return compiled and "whole" or incomplete and "open" or "wrong"
  end
  for text, expected in pairs { ["f("] = "open", ["for i = 1, 2 do"] = "open", ["{ 1,"] = "open",
    ["x = [["] = "open", ["local x ="] = "open", ["1 +"] = "open",
    ["1 1"] = "wrong", ["end"] = "wrong", ["'abc"] = "wrong", ["'abc\\"] = "open",
    ["1"] = "whole", [""] = "whole",
    ["x = 1;"] = "whole", ["f(); -- c"] = "whole", ["return 3"] = "whole" } do
    t:equal(("%s: %s"):format(text, state(text)), ("%s: %s"):format(text, expected))
  end
end)

suite:test("values are truncated and summarised", function(t)
  local style = { color = false, ascii = true, width = 60 }
  local function shown(value) return show.value(value, style) end
  local many = {}
  for i = 1, 40 do many[i] = "entry" end
  t:ok(shown(many):find("... 16 more", 1, true), shown(many))
  t:equal(shown { a = true, [5] = "x", ["with blank"] = 1 },
    '{ [5] = "x", a = true, ["with blank"] = 1 }')
  local lattice = {}
  for x = 1, 4 do lattice[x] = { x, 2 * x, 0 / 0, -x } end
  t:equal(array_text.shape(lattice), { 4, 4 })
  t:equal(shown(lattice), "numbers [4][4]: min -4, mean 1.66667, max 8, NaN 4")
  t:equal(array_text.shape { 1, { 2 } }, nil)
  t:equal(array_text.shape { { 1, 2 }, { 3 } }, nil)
  t:equal(shown(("x"):rep(30)), '"' .. ("x"):rep(30) .. '"')
end)

suite:test("a value with too many lines is shown with less depth", function(t)
  local style = { color = false, ascii = true, width = 60 }
  local deep = {}
  for i = 1, 20 do
    deep["entry_" .. i] = { one = { two = i, list = { "a", "b" }, three = "word word word word" },
      four = "word word word word word word" }
  end
  local text = show.value(deep, style)
  t:ok(select(2, text:gsub("\n", "")) < 40, text)
  t:ok(text:find("entry_7 = { ... }", 1, true) or text:find("one = { ... }", 1, true), text)
  deep = { one = { two = { three = { 1, 2 } } } }
  t:equal(show.value(deep, style), "{ one = { two = { three = { 1, 2 } } } }")
end)
