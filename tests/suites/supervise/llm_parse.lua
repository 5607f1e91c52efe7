--- llm_parse.lua: from a model's text to a proposal: where the object may be, which values it may
--- have, parsers of the user's own, and random answers: parser and ledger never raise an error, and
--- no value leaves its range.

local engine = require "limax.engine"
local histories = require "support.histories"
local host = require "limax.host"
local parse = require "limax.supervise.llm.parse"
local proposals = require "limax.supervise.proposals"
local source = require "limax.base.source"

local suite = require("limax.test").suite "llm parse"

local LIMITS = proposals.limits(10)
local BOM = "\239\187\191"

local function read(text, parser) return (parser or parse.from()):read(text, LIMITS) end

suite:test("the object is found wherever a model puts it", function(t)
  local object = '{"mutation_rate": 0.2, "reason": "why } {not"}'
  for _, text in ipairs {
    object, BOM .. object .. "\n", "```json\n" .. object .. "\n```", "```\n" .. object,
    "Sure! I use {braces} and a quote \" here:\n" .. object .. "\nHope that helps {smile}.",
    '[' .. object .. ']', '{"proposal": ' .. object .. '}',
    "<think>first {\"mutation_rate\": 0.5}</think>" .. object,
    "so {\"mutation_rate\": 0.5}</think>" .. object,
    "The form is {\"mutation_rate\": 0.4, \"reason\": \"\"}. My answer: " .. object,
    object .. '\n{"note": "no field of mine"}', object .. "\n{'single': 1}",
  } do
    local got, message = read(text)
    t:ok(got, ("%s: %s"):format(text, tostring(message)))
    t:equal({ text, got.proposal, got.reason }, { text, { mutation_rate = 0.2 }, "why } {not" })
  end
end)

suite:test("text without a complete JSON object is not an answer, and is not repaired", function(t)
  local many = {}
  for k = 1, 4000 do many[k] = ('"k%d":%d'):format(k, k) end
  for text, expected in pairs {
    [""] = "no JSON object", ["[0.2]"] = "no JSON object",
    ['{"mutation_rate": 0.2, "reason": "so'] = "cut off",
    ['{"mutation_rate": 0.1} and then {"mutation_rate": 0.2, "mat'] = "cut off",
    ['{"wrong": {"mutation_rate": 0.2}, '] = "cut off",
    ["{'mutation_rate': 0.2}"] = "double quotes", ['{"mutation_rate": 0.2,}'] = "line 1",
    ['{"mutation_rate": NaN}'] = "line 1", ['{"mutation_rate": 1e999}'] = "overflow",
    ['{"mutation_rate": 0.2, "mutation_rate": 0.3}'] = "comes twice",
    ['{"mutation_rate": 12345678901234567890}'] = "beyond 2^53",
    ['{"reason": "\\ud800", "mutation_rate": 0.2}'] = "surrogate",
    ['{"reason": "\255", "mutation_rate": 0.2}'] = "UTF-8",
    ['{"Mutation_Rate": 0.2, "mutationRate": 0.2}'] = "no object in the answer has a field",
    ["<think>{\"mutation_rate\": 0.2}"] = "no JSON object",
    [('{"a":'):rep(2000) .. "1" .. ("}"):rep(2000)] = "nested deeper",
    [('{"a":'):rep(110) .. "1" .. ("}"):rep(110)] = "more than 100 objects",
    [('{"a":'):rep(1e4)] = "cut off", [("{}"):rep(1000)] = "more than 100 objects",
    ['{"reason": "' .. ("x"):rep(1e6) .. '"}'] = "more than 65536",
    ['{"mutation_rate": 0.1, ' .. table.concat(many, ",") .. "}"] = "more than 100 fields",
  } do
    local got, message = read(text)
    t:equal(got, nil)
    t:ok(message:find(expected, 1, true), ("%s: %s"):format(text:sub(1, 80), message))
    t:ok(#message <= 200 and not message:find "%c", message)
  end
end)

suite:test("values are kept as they are, for the ledger to judge", function(t)
  local got = t:ok(read [[{"mutation_rate": "0.2", "crossover_rate": null, "mutation_scale": true,
    "elite_fraction": [0.2], "Elites": 3, "x\ny": "a\u0000b",
    "materials": {"bone": {"stiffness": null, "amplitude": {"now": 1}}},
    "reason": "line\none\u001b[31m \u202e\u0085end"}]])
  t:equal(got.proposal, { mutation_rate = "0.2", mutation_scale = true, elite_fraction = { 0.2 },
    Elites = 3, materials = { bone = { amplitude = { now = 1 } } }, ["x y"] = "a\\u0000b" })
  t:equal(got.reason, "line one\\u001b[31m \\u202e\\u0085end")
  got = t:ok(read('{"mutation_rate": -0, "' .. ("é"):rep(100) .. '": 1, "reason": "'
    .. ("ü"):rep(500) .. '"}'))
  t:equal(got.reason, ("ü"):rep(100))
  t:ok(got.proposal[("é"):rep(30)])
  t:ok(pcall(host.json.encode, got.proposal))
  -- an answer with only nulls asks for no change
  t:equal(t:ok(read '{"mutation_rate": null, "reason": ""}'), { proposal = {} })
end)

-- ---- parsers of the user's own ------------------------------------------------------------------

suite:test("a parser may be a file or a text", function(t)
  local page, folder = source.read(host.home .. "/prompts/README.md"), t:folder()
  local code = t:ok(page:match "\n```lua\n(.-)\n```")
  assert(host.file.write_atomic(folder .. "/own.lua", code))
  assert(host.file.write_atomic(folder .. "/broken.lua", "return function(text"))
  for _, own in ipairs { t:ok(parse.from("own.lua", folder)), t:ok(parse.from(code)) } do
    t:equal(read("my rate: 0.3", own),
      { proposal = { mutation_rate = 0.3 }, reason = "from its text" })
    t:equal({ read("none", own) }, { nil, "expected rate: NUMBER" })
  end
  for expected, parser in pairs { ["nowhere.lua"] = "nowhere.lua",
    ["broken.lua:1"] = "broken.lua", ["parse:2"] = "return function(text)\nend end" } do
    local made, message = parse.from(parser, folder)
    t:equal(made, nil)
    t:ok(message:find(expected, 1, true), message)
  end
end)

suite:test("a parser that fails or returns nonsense gives a message", { limit = 60 }, function(t)
  for body, expected in pairs {
    ["error 'no idea'"] = "the parser failed: ", ["return { 1, 2 }"] = "returned no table",
    ["return nil, {}"] = "the parser found no proposal",
    ["return nil, 'two\\nlines'"] = "two lines",
  } do
    local got, message = read("x", t:ok(parse.from("return function(text)\n" .. body .. " end")))
    t:equal(got, nil)
    t:ok(message:find(expected, 1, true), ("%s: %s"):format(body, message))
  end
end)

-- ---- random answers -----------------------------------------------------------------------------

local GOOD = '{"mutation_rate": 0.2, "mutation_scale": 0.05, "crossover_rate": null,'
  .. ' "elite_fraction": 0.25, "reason": "a try", "materials": {"bone": {"stiffness": 12000},'
  .. ' "expanding muscle": {"amplitude": 0.2, "phase": 1, "stiffness": null}}}'

local PIECES = { "0", "-5", "1e308", "1e999", "NaN", "null", "true", '"0.2"', "0x10", '"\\u0000"',
  '"\\ud800"', "\255", "'x'", "[]", "{}", "[0.2]", '{"value": 1}', "\n", "```json\n", "<think>",
  "</think>", "{", "}", "[", "]", '"', "\\", "{{generations}}", "\239\187\191", "\0", "\27[2J", ",",
  ":", '"population": ', '"": ', '"steel": ', '"materials": 3' }

-- A good answer with one to four changes: a piece, in the place of some bytes or between them, a
-- repetition, an early end, another number.
local function answer(pick)
  local text = GOOD
  for _ = 1, pick(4) do
    local at = pick(#text + 1)
    local before, after = text:sub(1, at - 1), text:sub(at)
    local piece = PIECES[pick(#PIECES)]
    text = ({ before .. piece .. after:sub(1 + pick(10)), before .. piece .. after,
      before .. after:sub(1, pick(30)) .. after, text:sub(1, at),
      before .. after:gsub("[%d.]+", ("%.3g"):format((pick(2000) - 500) / 10 ^ (pick(6) - 1)), 1),
    })[pick(5)]
  end
  return text
end

-- ---- what must hold -----------------------------------------------------------------------------

local MATERIALS_NOW, FIRST = engine.materials("paper"):table().materials, {}
for _, material in ipairs(MATERIALS_NOW) do FIRST[material.name] = material end

-- Describes the first problem of a judged proposal; nil if there is none.
local function judged(proposal, limits, limit_of)
  local parameters, materials, record = proposals.judge { proposal = proposal, supervisor = "llm",
    limits = limits, parameters = histories.FIRST, materials = MATERIALS_NOW, first = FIRST,
    allowed = { hyperparameters = true, materials = true }, first_step = 1e-6,
    cost = function(fields) return 1e-4 / math.sqrt(fields.bone.stiffness) end }
  for _, entry in ipairs(record.entries) do
    local material, name = entry.field:match "^materials%.(.*)%.(.-)$"
    name = name or entry.field
    if entry.applied then
      local value = material and materials[material][name] or parameters[name]
      local limit, unit = limit_of[name], name == "stiffness" and FIRST[material].stiffness or 1
      local low, high = limit.minimum * unit, limit.maximum * unit
      -- the first value may be outside
      if value ~= entry.applied or value ~= entry.before
        and not (value >= low * (1 - 1e-12) and value <= high * (1 + 1e-12)) then
        return entry.field
      end
    end
  end
  local text = host.json.encode(record)
  if text:find "%c" then return "a control character in the ledger" end
  if #text > 20000 then return "a ledger line of " .. #text end
end

-- The default parser in this process: a process for each answer would take too long.
local locate = setfenv(assert(loadstring(parse.from().source)), { json = host.json,
  ipairs = ipairs })()

suite:test("ten thousand random answers", { limit = 120 }, function(t)
  local limits, limit_of, count = proposals.limits(10), {}, 10000
  for _, limit in ipairs(limits) do limit_of[limit.field] = limit end
  local random, found = engine.random(1, 1, "user"), 0
  local function pick(n) return random:integer(n) end
  for k = 1, count do
    local text = answer(pick)
    local place = ("answer %d: %q"):format(k, text)
    local ok, parsed, message = pcall(function() return parse.accept(locate(text, limits)) end)
    t:ok(ok, place)
    if parsed then
      found = found + 1
      local fine, wrong = pcall(judged, parsed.proposal, limits, limit_of)
      t:ok(fine and wrong == nil, ("%s: %s"):format(place, tostring(wrong)))
      t:ok(not parsed.reason or #parsed.reason <= 200 and not parsed.reason:find "%c", place)
    else
      t:ok(type(message) == "string" and #message <= 230 and not message:find "%c", place)
    end
  end
  t:note(("%d of %d answers held a proposal"):format(found, count))
  t:ok(found > count / 20 and found < count * 0.9)
end)
