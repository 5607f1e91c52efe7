--- llm_property.lua: answers that no model has given yet: mutations of good ones and junk from a
--- grammar. Whatever comes, parser, ledger and template end, raise nothing, and let no value past
--- its range. A million with --tags=full.

local host = require "limax.host"
local ledger = require "limax.supervise.ledger"
local parse = require "limax.supervise.llm.parse"
local template = require "limax.supervise.llm.template"

local suite = require("limax.test").suite "llm property"

-- A generator of its own, so that the answers are the same everywhere.
local function stream(seed)
  local state = seed
  return function(n)
    state = (state * 1103515245 + 12345) % 2147483648
    return math.floor(state / 65536) % n + 1
  end
end

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

local function mutated(text, pick)
  for _ = 1, pick(2) do
    local at = pick(#text + 1)
    local way = pick(5)
    if way == 1 then
      text = text:sub(1, at - 1) .. string.char(pick(256) - 1) .. text:sub(at + 1)
    elseif way == 2 then
      text = text:sub(1, at - 1) .. text:sub(at + pick(10))
    elseif way == 3 then
      text = text:sub(1, at - 1) .. GLUE[pick(#GLUE)] .. text:sub(at)
    elseif way == 4 then
      text = text:sub(1, at - 1) .. text:sub(at, at + pick(30)) .. text:sub(at)
    else
      text = text:sub(1, at)
    end
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

local MATERIAL_TABLE = {
  { name = "empty", letter = ".", kind = "empty" },
  { name = "expanding muscle", letter = "e", kind = "expanding", stiffness = 2000, amplitude = 0.25,
    phase = math.pi },
  { name = "soft tissue", letter = "s", kind = "passive", stiffness = 1000 },
  { name = "bone", letter = "b", kind = "passive", stiffness = 10000 },
}
local FIRST = { ["expanding muscle"] = { stiffness = 2000, amplitude = 0.25, phase = math.pi },
  ["soft tissue"] = { stiffness = 1000 }, bone = { stiffness = 10000 } }
local BEFORE = { mutation_rate = 0.1, mutation_scale = 0.1, crossover_rate = 0.4,
  elite_fraction = 0.3 }

local function within(limit, unit, value)
  local low, high = limit.minimum * unit, limit.maximum * unit
  return value >= low * (1 - 1e-12) and value <= high * (1 + 1e-12)
end

-- Judges a proposal and says what is wrong with the outcome; nil where nothing is.
local function judged(proposal, limits, limit_of)
  local parameters, materials, record = ledger.judge { proposal = proposal, supervisor = "llm",
    limits = limits, parameters = BEFORE, materials = MATERIAL_TABLE, first = FIRST,
    allowed = { hyperparameters = true, materials = true },
    cost = function(fields) return 1e-4 / math.sqrt(fields.bone.stiffness) end,
    first_step = 1e-6 }
  for name in pairs(BEFORE) do
    local value = parameters[name]
    if value ~= value or not within(limit_of[name], 1, value) then return name end
  end
  for material, fields in pairs(FIRST) do
    for field, first in pairs(fields) do
      local value = materials[material][field]
      local unit = field == "stiffness" and first or 1
      -- a value that the run began with may lie outside
      if value ~= first and not within(limit_of[field], unit, value) then
        return material .. "." .. field
      end
    end
  end
  -- what is written can be read
  local text = host.json.encode(record)
  if text:find "%c" then return "a control character in the ledger" end
  if #text > 20000 then return "a ledger line of " .. #text end
end

local function holds(t, count, seed)
  local limits = ledger.limits(10)
  local limit_of, text_of_limits = {}, host.json.encode(limits)
  for _, limit in ipairs(limits) do limit_of[limit.field] = limit end
  local parser, pick, found = parse.default(), stream(seed), 0
  for k = 1, count do
    local text = answer(pick)
    local ok, parsed, message = pcall(parser.read, parser, text, text_of_limits)
    t:ok(ok, ("answer %d: %q: %s"):format(k, text, tostring(parsed)))
    if parsed then
      found = found + 1
      local fine, wrong = pcall(judged, parsed.proposal, limits, limit_of)
      t:ok(fine and wrong == nil, ("answer %d: %q: %s"):format(k, text, tostring(wrong)))
      t:ok(not parsed.reason or #parsed.reason <= 200 and not parsed.reason:find "%c")
    else
      t:ok(type(message) == "string" and #message <= 230 and not message:find "%c",
        ("answer %d: %q: %s"):format(k, text, tostring(message)))
      t:ok(not message:find("the parser failed", 1, true), ("%q: %s"):format(text, message))
    end

    -- the same text as data, and as a prompt
    if pcall(host.json.encode, text) then
      local data = template.json { text, { text } }
      t:ok(not data:find "[<>`{%c\128-\255]", data)
      t:equal(host.json.decode(data), { text, { text } })
    end
    local prompt, complaint = template.read(text, "p.md")
    t:ok(prompt or complaint:find "^p%.md", complaint)
    if prompt then
      local messages, unfilled = prompt:fill { generations = "g", x = { text = 1 } }
      t:ok(messages or unfilled:find "^p%.md:%d", unfilled)
    end
  end
  t:note(("%d of %d answers held a proposal"):format(found, count))
  t:ok(found > count / 20 and found < count * 0.9)
end

suite:test("twenty thousand answers", { limit = 120 }, function(t) holds(t, 20000, 1) end)

suite:test("a million answers", { limit = 3600, tags = "full" }, function(t) holds(t, 1e6, 2) end)
