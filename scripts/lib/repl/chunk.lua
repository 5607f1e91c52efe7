--- chunk.lua: what was typed as a function to run: an expression first, so that its value is shown;
--- a top-level `local` stays; `time(...)` times what stands in it; a trailing `;` mutes.

local tokens = require "limax.repl.tokens"

local chunk = {}

-- The message of a text that ends where it should go on.
local function is_incomplete(message) return message:match "near '?<eof>'?$" ~= nil end

-- `time(expression)` gets a function of the expression: as an argument it would be over before.
local function with_time(text)
  local list = tokens.of_code(text)
  local last = #list
  if last > 0 and list[last].text == ";" then last = last - 1 end
  if last < 4 or list[1].text ~= "time" or list[2].text ~= "(" or list[last].text ~= ")"
    or list[3].text == "function" or last == 4 and list[3].kind == "string" then
    return text
  end
  return text:sub(1, list[2].last) .. "function() return "
    .. text:sub(list[2].last + 1, list[last].first - 1) .. "\nend" .. text:sub(list[last].first)
end

-- The text without its last `;`, and whether there was one.
local function unmuted(text)
  local list = tokens.of_code(text)
  local last = list[#list]
  if not last or last.text ~= ";" then return text, false end
  return text:sub(1, last.first - 1) .. " " .. text:sub(last.last + 1), true
end

---@class limax.repl.chunk
---@field call function takes a function that is handed the values of an expression
---@field muted boolean its values are not shown
---@field names string[] that its top-level `local` declares

--- The function of a text; otherwise nil, message, incomplete.
---@param text string
---@param environment table
---@param name string chunk name, "=input"
---@return limax.repl.chunk|nil
---@return string|nil message
---@return boolean|nil incomplete
function chunk.compile(text, environment, name)
  local expression, muted = unmuted(text)
  local timed = with_time(expression)
  local call = loadstring("return " .. timed, name)
  local names = {}
  if call then
    -- a call after `return` is a tail call, whose errors would lose their line
    -- (the line break: for a text that ends in a comment)
    call = loadstring("(...)(" .. timed .. ")", name)
      or loadstring("(...)(" .. timed .. "\n)", name) or call
  else
    local _, as_expression = loadstring("return " .. text, name)
    local statement, as_statement
    statement, names = tokens.keep_locals(text)
    call, as_statement = loadstring(statement, name)
    if not call then
      return nil, as_statement, is_incomplete(as_expression or "") or is_incomplete(as_statement)
    end
  end
  -- compiled traces check no hook: at the prompt Ctrl-C must always come through
  jit.off(call, true)
  return { call = setfenv(call, environment), muted = muted, names = names }
end

return chunk
