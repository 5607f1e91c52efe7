--- locate.lua: the default parser of answers, and an example of your own: a file that returns a
--- function(text, limits) -> proposal | nil, message. It runs in a process of its own that has
--- string, table, math and json.
---
--- A model may write its thoughts, put the object into a fence or prose, and repeat the example
--- before it answers. So the object may be anywhere, and the last one with a field that may be set
--- counts. Nothing is repaired: text that is truncated or not JSON is ignored as a whole.

-- luacheck: read_globals json

-- Longest text that is searched, bytes without thoughts: an answer has a few hundred.
local LONGEST = 65536
-- Most objects in an answer: of more it is unclear which one is meant.
local MOST = 100

-- The object at the beginning of a text; nil if it does not end. Braces inside of its strings do
-- not count.
local function object_of(text)
  local braces = text:gsub("\\.", "  "):gsub('"[^"]*"', function(inside)
    return (" "):rep(#inside)
  end)
  local whole = braces:match "^%b{}"
  return whole and text:sub(1, #whole)
end

-- Has an object a field that may be set?
local function is_useful(value, limits)
  for _, limit in ipairs(limits) do
    if not limit.material and value[limit.field] ~= nil then return true end
  end
  return value.materials ~= nil
end

return function(text, limits)
  -- what a model thought before its answer: a block that never ends is all thought, one that began
  -- in the prompt ends at its closing tag
  for _, tag in ipairs { "think", "thinking", "reasoning" } do
    text = text:gsub("^.*</" .. tag .. ">", ""):gsub("<" .. tag .. ">.*$", "")
  end
  if #text > LONGEST then
    return nil, ("the answer has %d bytes, more than %d"):format(#text, LONGEST)
  end
  local found, problem, at, count = nil, "there is no JSON object in the answer", 1, 0
  while true do
    local open = text:find("{", at, true)
    if not open then break end
    at = open + 1
    -- in JSON a brace is followed by a key or the end; any other brace belongs to prose
    if text:find('^%s*["}]', at) then
      count = count + 1
      if count > MOST then return nil, ("the answer has more than %d objects"):format(MOST) end
      local object = object_of(text:sub(open))
      -- an object that was cut off may have been the answer, and an earlier one an example
      if not object then return nil, "the object does not end: the answer is cut off" end
      local value, message = json.decode(object, "the answer")
      if value == nil then
        problem = message
      elseif is_useful(value, limits) then
        found = value
      else
        problem = "no object in the answer has a field that may be set"
      end
      -- an object without such a field may contain one that has it
      if value == nil or value == found then at = open + #object end
    elseif count == 0 then
      problem = "no brace in the answer is followed by a key in double quotes"
    end
  end
  if found then return found end
  return nil, problem
end
