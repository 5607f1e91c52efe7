--- locate.lua: the parser of answers that is used when none is named, and a pattern for your own: a
--- file that returns a function(text, limits) -> proposal | nil, message. It runs in a Lua state
--- of its own that has string, table, math and json, and nothing else.
---
--- The place of the object is forgiving, its values are not. A model may think aloud, wrap the
--- object in a fence or in prose, and repeat the example before it answers: the LAST object that
--- holds a known field counts, because examples come first. Nothing is repaired: what is truncated
--- or no JSON counts as a whole as if it were not there, its insides too.

-- luacheck: read_globals json

-- Longest text that is searched, bytes: an answer has a few hundred.
local LONGEST = 262144
-- Most objects in an answer: with more of them nobody can say which one is meant.
local MOST = 512

-- Without what a model thought before it spoke. A block that never ends is all thought; one whose
-- beginning stood in the prompt ends at its closing tag.
local function spoken(text)
  for _, tag in ipairs { "think", "thinking", "reasoning" } do
    local open, close = "<" .. tag .. ">", "</" .. tag .. ">"
    local parts, at = {}, 1
    while true do
      local from, to = text:find(open, at, true)
      local ends, after = text:find(close, at, true)
      if ends and (not from or ends < from) then
        parts, at = {}, after + 1
      elseif from then
        parts[#parts + 1] = text:sub(at, from - 1)
        ends, after = text:find(close, to, true)
        if not ends then
          at = #text + 1
          break
        end
        at = after + 1
      else
        break
      end
    end
    parts[#parts + 1] = text:sub(at)
    text = table.concat(parts)
  end
  return text
end

-- The place of the brace that ends the object which begins at `at`; nil: it does not end.
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

-- Every object that stands for itself, in order, and what was wrong with the last that is none.
local function objects(text)
  local list, at, problem, truncated = {}, 1, nil, false
  while true do
    local open = text:find("{", at, true)
    if not open then break end
    if #list == MOST then return {}, ("the answer has more than %d objects"):format(MOST), false end
    -- after a brace of JSON comes a key or the end; any other brace belongs to prose
    if text:find('^%s*["}]', open + 1) then
      local close = closing(text, open)
      if not close then
        truncated = true
        break
      end
      local value, message = json.decode(text:sub(open, close), "the answer")
      if value ~= nil then
        list[#list + 1] = { value = value, from = open, to = close }
      else
        problem = message
      end
      at = close + 1
    else
      at = open + 1
      problem = problem or "it has braces, but after none of them comes a key in double quotes"
    end
  end
  if truncated then problem = "the object does not end: the answer is cut off" end
  return list, problem, truncated
end

local function is_object(value)
  return type(value) == "table" and value ~= json.null and not json.is_array(value)
end

local function has_known(value, known)
  for name in pairs(known) do
    if value[name] ~= nil then return true end
  end
  return false
end

-- The object that holds known fields: itself, or the only one inside that does.
local function candidate(value, known)
  if not is_object(value) then return nil end
  if has_known(value, known) then return value end
  local found
  for _, inner in pairs(value) do
    if is_object(inner) and has_known(inner, known) then
      if found then return nil end
      found = inner
    end
  end
  return found
end

return function(text, limits)
  local known = { materials = true }
  for _, limit in ipairs(limits) do
    if not limit.material then known[limit.field] = true end
  end
  text = text:gsub("^\239\187\191", "")
  if #text > LONGEST then
    return nil, ("the answer has %d bytes, more than %d"):format(#text, LONGEST)
  end
  local said = spoken(text)
  local list, problem, truncated = objects(said)
  -- a later object that was cut off may have been the answer: an earlier one is an example then
  if truncated then return nil, problem end
  for k = #list, 1, -1 do
    local proposal = candidate(list[k].value, known)
    if proposal then
      local around = said:sub(1, list[k].from - 1) .. said:sub(list[k].to + 1)
      local stage = "prose"
      if not around:find "%S" then stage = #said == #text and "whole" or "after thought"
      elseif around:find("```", 1, true) then stage = "fenced" end
      return proposal, nil, stage
    end
  end
  if #list > 0 then return nil, "no object in the answer holds a field that may be set" end
  return nil, problem or "there is no JSON object in the answer"
end
