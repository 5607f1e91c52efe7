--- chunk.lua: compiles typed text: as an expression if possible, so that its value is shown. A
--- top-level `local` remains defined, a trailing `;` mutes.

local tokens = require "limax.tools.repl.tokens"

local chunk = {}

-- Is this the message of an incomplete text? A string in quotes ends with its line, unless a
-- backslash continues it.
local function is_incomplete(message, text)
  if not message:match "near '?<eof>'?$" then return false end
  return not message:match ": unfinished string" or text:match "\\$" ~= nil
end

-- The text without its last `;`, and whether there was one.
local function unmuted(text)
  local list = tokens.of(text)
  local last = list[#list]
  if not last or last.text ~= ";" then return text, false end
  return text:sub(1, last.first - 1) .. " " .. text:sub(last.last + 1), true
end

-- Statements and an expression, whose values are passed to a function; nil if they do not compile.
-- A call after `return` is a tail call, whose errors lose their line; the line break is for a text
-- that ends in a comment.
local function passing(statements, expression)
  for _, ending in ipairs { ")", "\n)" } do
    local form = ("%s(...)(%s%s"):format(statements, expression, ending)
    if loadstring(form) then return form end
  end
end

-- Statements that end in an expression, `walk:step(1); walk:center()[1]`, in a form that passes its
-- values on, and the names that they declare; nil for any other text. Without `anywhere` only
-- behind a `;`.
local function ending_in_expression(text, anywhere)
  local list = tokens.of(text)
  for i = 2, #list do
    if anywhere or list[i - 1].text == ";" then
      local before, last = unmuted(text:sub(1, list[i].first - 1)), text:sub(list[i].first)
      if passing(before .. "; ", last) then
        local statements, names = tokens.keep_locals(before)
        return passing(statements .. "; ", last), names
      end
    end
  end
end

---@class limax.repl.chunk
---@field call function takes a function that receives the values of an expression
---@field muted boolean its values are not shown
---@field names string[] declared by its top-level `local`

--- Compiles a text; otherwise nil, message, incomplete.
---@param name string chunk name, "=input"
---@param first integer|nil number of its first line in messages, 1 if left out
function chunk.compile(text, environment, name, first)
  -- the `=` of other prompts of Lua
  text = text:gsub("^%s*=%f[^=]", "")
  -- cheap: a statement of many lines is tried after each of them
  local _, as_expression = loadstring("return " .. text, name)
  local _, as_statement = loadstring(text, name)
  local expression, muted = unmuted(text)
  local mixed, mixed_names
  if as_expression and as_statement then
    local incomplete = is_incomplete(as_expression, text) or is_incomplete(as_statement, text)
    -- what an expression behind statements lacks, as in `x = 1; x`
    local bare = as_statement:match "'=' expected near '?<eof>'?$"
    if bare or not incomplete then
      mixed, mixed_names = ending_in_expression(expression, bare)
    end
    if incomplete and not mixed then return nil, as_statement, true end
  end
  -- line breaks above the text give messages their line; after thousands of lines they cost more
  -- than the text, so only the chosen form gets them
  local function numbered(code) return loadstring(("\n"):rep((first or 1) - 1) .. code, name) end
  local names, form = {}, "return " .. expression
  if mixed then
    form, names = mixed, mixed_names
  elseif loadstring(form, name) then
    form = passing("", expression) or form
  else
    form, names = tokens.keep_locals(text)
    if not loadstring(form, name) then return nil, select(2, numbered(form)), false end
  end
  local call = numbered(form)
  -- compiled traces do not check hooks, and Ctrl-C must always work at the prompt
  jit.off(call, true)
  return { call = setfenv(call, environment), muted = muted, names = names }
end

return chunk
