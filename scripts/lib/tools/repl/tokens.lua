--- tokens.lua: splits Lua text into tokens, for a top-level `local` at the prompt, `time(...)` and
--- completion.

local tokens = {}

local keywords = {}
for word in ([[and break do else elseif end false for function goto if in local nil not or repeat
  return then true until while]]):gmatch "%a+" do
  keywords[word] = true
end

-- operators of several letters, the longest first
local long = { "...", "..", "==", "~=", "<=", ">=", "::" }

---@class limax.repl.token
---@field kind "name"|"keyword"|"number"|"string"|"comment"|"symbol"
---@field text string
---@field first integer position in the text
---@field last integer
---@field open boolean|nil an unfinished string or comment

-- The end of a short string that begins at `at`; nil if it is unfinished.
local function short_end(text, at)
  local quote, i = text:sub(at, at), at + 1
  while i <= #text do
    local letter = text:sub(i, i)
    if letter == "\\" then
      i = i + 1
    elseif letter == quote then
      return i
    elseif letter == "\n" then
      return nil
    end
    i = i + 1
  end
end

-- The end of a long bracket at `at`; false if there is none, nil if it is unfinished.
local function long_end(text, at)
  local level = text:match("^%[(=*)%[", at)
  if not level then return false end
  local _, last = text:find("]" .. level .. "]", at, true)
  return last
end

local function take(text, at)
  local letter = text:sub(at, at)
  local last = select(2, text:find("^[%a_][%w_]*", at))
  if last then
    local word = text:sub(at, last)
    return keywords[word] and "keyword" or "name", last
  end
  last = select(2, text:find("^%.?%d[%w_.]*", at))
  if last then
    -- the sign of an exponent belongs to the number
    if text:sub(last, last):match "[eE]" and not text:match("^0[xX]", at) then
      last = select(2, text:find("^[+-]%d*", last + 1)) or last
    end
    return "number", last
  end
  if letter == "'" or letter == '"' then return "string", short_end(text, at) end
  if text:sub(at, at + 1) == "--" then
    last = long_end(text, at + 2)
    if last ~= false then return "comment", last end
    return "comment", (text:find("\n", at, true) or #text + 1) - 1
  end
  last = long_end(text, at)
  if last ~= false then return "string", last end
  for _, each in ipairs(long) do
    if text:sub(at, at + #each - 1) == each then return "symbol", at + #each - 1 end
  end
  return "symbol", at
end

--- The tokens of a text, without blanks.
function tokens.of(text)
  local list, at = {}, 1
  while true do
    at = text:find("%S", at)
    if not at then return list end
    local kind, last = take(text, at)
    local open = last == nil or nil
    last = last or #text
    list[#list + 1] = { kind = kind, text = text:sub(at, last), first = at, last = last,
      open = open }
    at = last + 1
  end
end

--- The tokens without comments.
function tokens.of_code(text)
  local code = {}
  for _, token in ipairs(tokens.of(text)) do
    if token.kind ~= "comment" then code[#code + 1] = token end
  end
  return code
end

-- change of the depth of blocks at a keyword; `while` and `for` count with their `do`
local deeper = { ["function"] = 1, ["do"] = 1, ["if"] = 1, ["repeat"] = 1, ["end"] = -1,
  ["until"] = -1 }

-- The names after `local` at token i, the end of the last one, and whether values follow.
local function declared(list, i)
  local names, last = {}, nil
  while list[i + 1] and list[i + 1].kind == "name" do
    i = i + 1
    names[#names + 1], last = list[i].text, list[i].last
    if not (list[i + 1] and list[i + 1].text == ",") then break end
    i = i + 1
  end
  return names, last, list[i + 1] ~= nil and list[i + 1].text == "="
end

--- A text whose top-level `local x = 1` and `local function f()` assign to names of the prompt,
--- with unchanged lines and columns, and these names.
---@return string
---@return string[] names
function tokens.keep_locals(text)
  local list, depth, edits, names = tokens.of_code(text), 0, {}, {}
  for i, token in ipairs(list) do
    if token.kind == "keyword" then
      local follows = list[i + 1]
      if token.text == "local" and depth == 0 and follows then
        edits[#edits + 1] = { token.first, token.last, "     " }
        if follows.text == "function" then
          names[#names + 1] = list[i + 2] and list[i + 2].text
        else
          local found, last, valued = declared(list, i)
          for _, name in ipairs(found) do names[#names + 1] = name end
          if last and not valued then edits[#edits + 1] = { last + 1, last, " = nil;" } end
        end
      end
      depth = depth + (deeper[token.text] or 0)
    end
  end
  for k = #edits, 1, -1 do
    local edit = edits[k]
    text = text:sub(1, edit[1] - 1) .. edit[3] .. text:sub(edit[2] + 1)
  end
  return text, names
end

return tokens
