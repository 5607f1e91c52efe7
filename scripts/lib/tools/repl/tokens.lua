--- tokens.lua: the tokens of Lua text that compiles, and with them a top-level `local` of the
--- prompt.

local tokens = {}

local KEYWORDS = {}
for word in ([[and break do else elseif end false for function goto if in local nil not or repeat
  return then true until while]]):gmatch "%a+" do
  KEYWORDS[word] = true
end

---@class limax.repl.token
---@field kind "name"|"keyword"|"other"
---@field text string
---@field first integer position in the text
---@field last integer

-- The end of a string in quotes that begins at `at`.
local function quoted_end(text, at)
  local stops = "[\\" .. text:sub(at, at) .. "]"
  local found = text:find(stops, at + 1)
  while found and text:sub(found, found) == "\\" do found = text:find(stops, found + 2) end
  return found or #text
end

-- Kind and end of the token at `at`; operators are single letters here.
local function take(text, at)
  local last = select(2, text:find("^[%a_][%w_]*", at))
  if last then return KEYWORDS[text:sub(at, last)] and "keyword" or "name", last end
  local is_comment = text:sub(at, at + 1) == "--"
  local level = text:match("^%[(=*)%[", is_comment and at + 2 or at)
  if level then
    last = select(2, text:find("]" .. level .. "]", at, true)) or #text
  elseif is_comment then
    last = (text:find("\n", at, true) or #text + 1) - 1
  elseif text:find("^[\"']", at) then
    last = quoted_end(text, at)
  else
    last = select(2, text:find("^%d[%w_.]*", at)) or at
  end
  return is_comment and "comment" or "other", last
end

--- The tokens of a text, without comments.
function tokens.of(text)
  local list, at = {}, text:find "%S"
  while at do
    local kind, last = take(text, at)
    if kind ~= "comment" then
      list[#list + 1] = { kind = kind, text = text:sub(at, last), first = at, last = last }
    end
    at = text:find("%S", last + 1)
  end
  return list
end

-- change of the depth of blocks at a keyword; `while` and `for` count with their `do`
local DEEPER = { ["function"] = 1, ["do"] = 1, ["if"] = 1, ["repeat"] = 1, ["end"] = -1,
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
  local list, depth, edits, names = tokens.of(text), 0, {}, {}
  for i, token in ipairs(list) do
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
    depth = depth + (token.kind == "keyword" and DEEPER[token.text] or 0)
  end
  for k = #edits, 1, -1 do
    local first, last, with = unpack(edits[k])
    text = text:sub(1, first - 1) .. with .. text:sub(last + 1)
  end
  return text, names
end

return tokens
