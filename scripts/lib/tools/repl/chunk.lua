--- chunk.lua: compiles typed text: as an expression if possible, so that its value is shown. A
--- top-level `local` remains defined, `time(...)` times its expression, a trailing `;` mutes.

local tokens = require "limax.tools.repl.tokens"

local chunk = {}

-- Is this the message of an incomplete text? A string in quotes ends with its line, unless a
-- backslash continues it.
local function is_incomplete(message, text)
  if not message:match "near '?<eof>'?$" then return false end
  return not message:match ": unfinished string" or text:match "\\$" ~= nil
end

-- The token that closes the parenthesis at token `first`.
local function closing_of(list, first)
  local depth = 0
  for i = first, #list do
    if list[i].text == "(" then depth = depth + 1 end
    if list[i].text == ")" then depth = depth - 1 end
    if depth == 0 then return i end
  end
end

-- Is token i the prompt's `time` with an expression? Functions and texts are passed unchanged.
local function times(list, i)
  local before, inner = list[i - 1], list[i + 2]
  if list[i].text ~= "time" or not list[i + 1] or list[i + 1].text ~= "(" or not inner then
    return false
  end
  if before and (before.text == "." or before.text == ":" or before.text == "function") then
    return false
  end
  return inner.text ~= "function" and inner.kind ~= "string" and inner.text ~= ")"
end

-- Wraps the expression of `time(expression)` in a function, so that it is not evaluated before.
local function with_time(text)
  local list, edits = tokens.of_code(text), {}
  for i = 1, #list do
    local last = times(list, i) and closing_of(list, i + 1)
    if last then
      local from, to = list[i + 1].last, list[last].first
      edits[#edits + 1] = { from, "function() return " }
      -- a line break after a possible comment
      local comment = text:sub(from, to):find("--", 1, true)
      edits[#edits + 1] = { to - 1, comment and "\nend" or " end" }
    end
  end
  table.sort(edits, function(a, b) return a[1] > b[1] end)
  for _, edit in ipairs(edits) do
    text = text:sub(1, edit[1]) .. edit[2] .. text:sub(edit[1] + 1)
  end
  return text
end

-- The text without its last `;`, and whether there was one.
local function unmuted(text)
  local list = tokens.of_code(text)
  local last = list[#list]
  if not last or last.text ~= ";" then return text, false end
  return text:sub(1, last.first - 1) .. " " .. text:sub(last.last + 1), true
end

---@class limax.repl.chunk
---@field call function takes a function that receives the values of an expression
---@field muted boolean its values are not shown
---@field names string[] declared by its top-level `local`

--- Compiles a text; otherwise nil, message, incomplete.
---@param name string chunk name, "=input"
---@param first integer|nil number of its first line in messages, 1 if left out
---@return limax.repl.chunk|nil
---@return string|nil message
---@return boolean|nil incomplete
function chunk.compile(text, environment, name, first)
  -- the `=` of other prompts of Lua
  text = text:gsub("^%s*=%f[^=]", "")
  -- cheap: a statement of many lines is tried after each of them
  local _, as_expression = loadstring("return " .. text, name)
  local _, as_statement = loadstring(text, name)
  if as_expression and as_statement and (is_incomplete(as_expression, text)
    or is_incomplete(as_statement, text)) then
    return nil, as_statement, true
  end
  -- line breaks above the text give messages their line; after thousands of lines they cost more
  -- than the text, so only the chosen form gets them
  local function numbered(code) return loadstring(("\n"):rep((first or 1) - 1) .. code, name) end
  local expression, muted = unmuted(text)
  local timed = with_time(expression)
  local names, form = {}, "return " .. timed
  if loadstring(form, name) then
    -- a call after `return` is a tail call, whose errors lose their line; the line break is for a
    -- text that ends in a comment
    for _, call in ipairs { "(...)(" .. timed .. ")", "(...)(" .. timed .. "\n)" } do
      if loadstring(call, name) then
        form = call
        break
      end
    end
  else
    form, names = tokens.keep_locals(with_time(text))
    if not loadstring(form, name) then return nil, select(2, numbered(form)), false end
  end
  local call = numbered(form)
  -- compiled traces do not check hooks, and Ctrl-C must always work at the prompt
  jit.off(call, true)
  return { call = setfenv(call, environment), muted = muted, names = names }
end

return chunk
