--- llm_property.lua: mutations of good answers and junk from a grammar. Parser, ledger and prompt
--- never raise an error, and no value leaves its range. A million answers with --tags=full.

local engine = require "limax.engine"
local histories = require "support.histories"
local host = require "limax.host"
local ledger = require "limax.supervise.ledger"
local model_stage = require "support.model_stage"
local parse = require "limax.supervise.llm.parse"
local prompt = require "limax.supervise.llm.prompt"

local suite = require("limax.test").suite "llm property"

local FIELDS = { "mutation_rate", "mutation_scale", "crossover_rate", "elite_fraction", "materials",
  "reason", "stiffness", "amplitude", "phase", "population", "Mutation_Rate", "x", "",
  "materials.bone", "__index" }
local MATERIALS = { "bone", "soft tissue", "expanding muscle", "contracting muscle", "empty", "e",
  "b", "steel", "bone " }
local SCALARS = { "0", "-0", "0.2", "1e-3", "-5", "1e308", "1e999", "-1e999", "NaN", "Infinity",
  "null", "true", "false", '"0.2"', '"20%"', "0x10", "0,2", "9007199254740993", "1e-320", ".5",
  '"\\u0000"', '"\\ud800"', '"<think>"', '"{"', '"}"', '"\\""', '"\255"', '"é"', "'x'", "[]", "{}",
  "[0.2]", '{"value": 1}' }
local GLUE = { "", " ", "\n", "```json\n", "\n```", "```", "<think>", "</think>", "<thinking>",
  "Sure: ", "{", "}", "[", "]", '"', "\\", "{{generations}}", "\239\187\191", "\0", "\27[2J", "//c",
  "/*", ",", ":", "os.exit(3)", "%s%n", "]]", "--", "<|im_end|>" }

-- An object of random fields, mostly well formed.
local function object(pick, depth)
  local parts = {}
  for _ = 1, pick(5) - 1 do
    local names = depth == 2 and MATERIALS or FIELDS
    local value
    if depth < 4 and pick(3) == 1 then
      value = object(pick, depth + 1)
    else
      value = SCALARS[pick(#SCALARS)]
      -- plain numbers are what models give most
      if pick(2) == 1 then value = ("%.3g"):format((pick(2000) - 500) / 10 ^ (pick(6) - 1)) end
    end
    parts[#parts + 1] = ('"%s": %s'):format(names[pick(#names)], value)
  end
  return "{" .. table.concat(parts, pick(40) == 1 and " " or ", ") .. "}"
end

-- A text with one or two changes: a byte, a gap, glue, a repetition, an early end.
local function mutated(text, pick)
  for _ = 1, pick(2) do
    local at = pick(#text + 1)
    local before, after = text:sub(1, at - 1), text:sub(at)
    text = ({ before .. string.char(pick(256) - 1) .. after:sub(2),
      before .. after:sub(1 + pick(10)), before .. GLUE[pick(#GLUE)] .. after,
      before .. after:sub(1, pick(30)) .. after, text:sub(1, at) })[pick(5)]
  end
  return text
end

local GOOD = '{"mutation_rate": 0.2, "mutation_scale": 0.05, "crossover_rate": null,'
  .. ' "elite_fraction": 0.25, "reason": "a try", "materials": {"bone": {"stiffness": 12000},'
  .. ' "expanding muscle": {"amplitude": 0.2, "phase": 1, "stiffness": null}}}'

local function answer(pick)
  local way = pick(4)
  if way == 1 then return mutated(GOOD, pick) end
  if way == 2 then
    local parts = {}
    for k = 1, pick(12) do parts[k] = GLUE[pick(#GLUE)] end
    table.insert(parts, pick(#parts + 1), object(pick, 1))
    return table.concat(parts)
  end
  local text = GLUE[pick(#GLUE)] .. object(pick, 1) .. GLUE[pick(#GLUE)]
  return way == 3 and text or mutated(text, pick)
end

-- ---- what must hold -----------------------------------------------------------------------------

local MATERIALS_NOW, FIRST = {}, {}
local paper = engine.materials "paper"
for i = 1, paper.count do
  MATERIALS_NOW[i] = paper:get(i)
  FIRST[MATERIALS_NOW[i].name] = MATERIALS_NOW[i]
end

-- What is wrong with the judgement of a proposal; nil where nothing is.
local function judged(proposal, limits, limit_of)
  local parameters, materials, record = ledger.judge { proposal = proposal, supervisor = "llm",
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
  string = string, table = table, ipairs = ipairs, pairs = pairs, type = type,
  select = select })()

local function check(t, count, seed)
  local limits, limit_of = ledger.limits(10), {}
  for _, limit in ipairs(limits) do limit_of[limit.field] = limit end
  local pick, found = model_stage.picks(seed), 0
  for k = 1, count do
    local text = answer(pick)
    local ok, parsed, message = pcall(function() return parse.accept(locate(text, limits)) end)
    t:ok(ok, ("answer %d: %q: %s"):format(k, text, tostring(parsed)))
    if parsed then
      found = found + 1
      local fine, wrong = pcall(judged, parsed.proposal, limits, limit_of)
      t:ok(fine and wrong == nil, ("answer %d: %q: %s"):format(k, text, tostring(wrong)))
      t:ok(not parsed.reason or #parsed.reason <= 200 and not parsed.reason:find "%c")
    else
      t:ok(type(message) == "string" and #message <= 230 and not message:find "%c",
        ("answer %d: %q: %s"):format(k, text, tostring(message)))
    end

    -- the same text as data, and as a prompt
    if pcall(host.json.encode, text) then
      local data = prompt.json { text, { text } }
      t:ok(not data:find "[<>`{%c\128-\255]", data)
      t:equal(host.json.decode(data), { text, { text } })
    end
    local template, complaint = prompt.read(text, "p.md")
    t:ok(template or complaint:find "^p%.md", complaint)
    if template then
      local messages, unfilled = template:fill { generations = "g", x = { text = 1 } }
      t:ok(messages or unfilled:find "^p%.md:%d", unfilled)
    end
  end
  t:note(("%d of %d answers held a proposal"):format(found, count))
  t:ok(found > count / 20 and found < count * 0.9)
end

suite:test("ten thousand answers", { limit = 120 }, function(t) check(t, 10000, 1) end)

suite:test("a million answers", { limit = 3600, tags = "full" }, function(t) check(t, 1e6, 2) end)
