--- locate.lua: the default parser of answers, and an example of your own: a file that returns a
--- function(text, limits) -> proposal | nil, message. It runs in a process of its own that has
--- string, table, math and json.
---
--- A model may think aloud, put the object into a fence or prose, and repeat the example before it
--- answers. So the object may be anywhere, and the last one with a field that may be set counts.
--- Nothing is repaired: text that is truncated or not JSON is ignored as a whole.

-- luacheck: read_globals json

-- Longest text that is searched, bytes: an answer has a few hundred.
local LONGEST = 262144
-- Most objects in an answer: of more it is unclear which one is meant.
local MOST = 512

-- Without what a model thought before its answer. A block that never ends is all thought; one that
-- began in the prompt ends at its closing tag.
local function without_thoughts(text)
  for _, tag in ipairs { "think", "thinking", "reasoning" } do
    local open, close = "<" .. tag .. ">", "</" .. tag .. ">"
    local kept, at = "", 1
    while true do
      local from, to = text:find(open, at, true)
      local ends, after = text:find(close, at, true)
      if ends and (not from or ends < from) then
        kept, at = "", after + 1
      elseif from then
        kept = kept .. text:sub(at, from - 1)
        at = (select(2, text:find(close, to, true)) or #text) + 1
      else
        break
      end
    end
    text = kept .. text:sub(at)
  end
  return text
end

-- The place of the brace that ends the object which begins at `at`; nil where it does not end.
local function closing(text, at)
  local depth = 0
  while true do
    at = text:find('[{}"]', at)
    if not at then return nil end
    local letter = text:byte(at)
    if letter == 123 then
      depth = depth + 1
    elseif letter == 125 then
      depth = depth - 1
      if depth == 0 then return at end
    else
      repeat
        at = text:find('["\\]', at + 1)
        if not at then return nil end
        local escape = text:byte(at) == 92
        if escape then at = at + 1 end
      until not escape
    end
    at = at + 1
  end
end

-- All outermost objects in order; and what is wrong with the text that looks like one. nil and a
-- message where the answer is cut off or has too many objects.
local function objects(text)
  local list, at, problem = {}, 1, nil
  while true do
    local open = text:find("{", at, true)
    if not open then return list, problem end
    if #list == MOST then return nil, ("the answer has more than %d objects"):format(MOST) end
    -- in JSON a brace is followed by a key or the end; any other brace belongs to prose
    if text:find('^%s*["}]', open + 1) then
      local close = closing(text, open)
      -- an object that was cut off may have been the answer, and an earlier one an example
      if not close then return nil, "the object does not end: the answer is cut off" end
      local value, message = json.decode(text:sub(open, close), "the answer")
      if value ~= nil then
        list[#list + 1] = { value = value, from = open, to = close }
      else
        problem = message
      end
      at = close + 1
    else
      at = open + 1
      problem = problem or "no brace in the answer is followed by a key in double quotes"
    end
  end
end

local function is_object(value)
  return type(value) == "table" and value ~= json.null and not json.is_array(value)
end

local function has_field(value, fields)
  for name in pairs(fields) do
    if value[name] ~= nil then return true end
  end
  return false
end

-- The object with fields that may be set: itself, or the only one inside that has some.
local function candidate(value, fields)
  if not is_object(value) then return nil end
  if has_field(value, fields) then return value end
  local found
  for _, inner in pairs(value) do
    if is_object(inner) and has_field(inner, fields) then
      if found then return nil end
      found = inner
    end
  end
  return found
end

return function(text, limits)
  local fields = { materials = true }
  for _, limit in ipairs(limits) do
    if not limit.material then fields[limit.field] = true end
  end
  text = text:gsub("^\239\187\191", "")
  if #text > LONGEST then
    return nil, ("the answer has %d bytes, more than %d"):format(#text, LONGEST)
  end
  local answer = without_thoughts(text)
  local list, problem = objects(answer)
  if not list then return nil, problem end
  for k = #list, 1, -1 do
    local proposal = candidate(list[k].value, fields)
    if proposal then
      local around = answer:sub(1, list[k].from - 1) .. answer:sub(list[k].to + 1)
      local stage = "prose"
      if not around:find "%S" then stage = #answer == #text and "whole" or "after thought"
      elseif around:find("```", 1, true) then stage = "fenced" end
      return proposal, nil, stage
    end
  end
  if #list > 0 then return nil, "no object in the answer has a field that may be set" end
  return nil, problem or "there is no JSON object in the answer"
end
