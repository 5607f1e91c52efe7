--- template.lua: the text of a prompt with {{holes}}. Filling is all that it can do: no conditions,
--- no loops, and a value is never looked into for holes of its own. A table enters as JSON in which
--- no character is left that could end a fence, open a tag or steer a terminal.

local choice = require "limax.base.choice"
local failure = require "limax.base.failure"
local host = require "limax.host"

local template = {}

---@class limax.llm.message
---@field role "system"|"user"|"assistant"
---@field content string

---@class limax.llm.template
---@field name string the file, for messages
---@field original string the text as it was
---@field sha256 string of it
---@field parts table[] texts and holes, in order
local Template = {}
Template.__index = Template

-- ---- tables as data -----------------------------------------------------------------------------

-- Inside JSON strings nothing but these stands as it is: words, and signs that neither markup,
-- fences, templates nor chat formats use.
local PLAIN = "[^%w %.,:;!%?%+%-%*/=%(%)'_%%]"

local function escaped(letter)
  -- what JSON has escaped already
  if letter == "\\" or letter == '"' then return nil end
  return ("\\u%04x"):format(letter:byte())
end

-- A string literal's inside as ASCII. Bytes above 127 are UTF-8, which the encoder has checked.
local function inert(inside)
  local ascii = inside:gsub("[\194-\244][\128-\191]*", function(sequence)
    local first = sequence:byte()
    local code = first % (first < 0xe0 and 0x20 or first < 0xf0 and 0x10 or 0x08)
    for k = 2, #sequence do code = code * 0x40 + sequence:byte(k) % 0x40 end
    if code < 0x10000 then return ("\\u%04x"):format(code) end
    code = code - 0x10000
    return ("\\u%04x\\u%04x"):format(0xd800 + math.floor(code / 0x400), 0xdc00 + code % 0x400)
  end)
  return (ascii:gsub(PLAIN, escaped))
end

--- A value as JSON whose strings hold only letters, digits and harmless signs as they are; the rest
--- is escaped, so that it still reads back equal.
---@param value any
---@return string
function template.json(value)
  local text, parts, at = host.json.encode(value), {}, 1
  while true do
    local quote = text:find('"', at, true)
    if not quote then break end
    local close = quote
    repeat
      close = text:find('["\\]', close + 1)
      local is_escape = text:byte(close) == 92
      if is_escape then close = close + 1 end
    until not is_escape
    parts[#parts + 1] = text:sub(at, quote)
    parts[#parts + 1] = inert(text:sub(quote + 1, close - 1))
    parts[#parts + 1] = '"'
    at = close + 1
  end
  parts[#parts + 1] = text:sub(at)
  return table.concat(parts)
end

-- ---- reading and filling ------------------------------------------------------------------------

local function line_of(text, at)
  local _, breaks = text:sub(1, at - 1):gsub("\n", "")
  return breaks + 1
end

--- Reads a prompt. A line `---` parts the system's message, above it, from the user's.
---@param text string
---@param name string its file, for messages
---@return limax.llm.template|nil
---@return string|nil message
function template.read(text, name)
  local original, sha256 = text, host.sha256(text)
  if not pcall(host.json.encode, text) then return nil, name .. ": is not UTF-8" end
  text = text:gsub("^\239\187\191", ""):gsub("\r\n", "\n")
  if not text:find "%S" then return nil, name .. ": is empty" end
  local parts, at = {}, 1
  while true do
    local open = text:find("{{", at, true)
    parts[#parts + 1] = text:sub(at, (open or #text + 1) - 1)
    if not open then break end
    local hole, close = text:match("^{{%s*([%a_][%w_]*)%s*}}()", open)
    if not hole then
      return nil, ("%s:%d: expected a hole, two braces around a name, such as {{generations}}")
        :format(name, line_of(text, open))
    end
    parts[#parts + 1] = { hole = hole, line = line_of(text, open) }
    at = close
  end
  return setmetatable({ name = name, original = original, sha256 = sha256, parts = parts },
    Template)
end

-- A value as it enters the text.
local function entered(value)
  if type(value) == "table" then
    local ok, text = pcall(template.json, value)
    if ok then return text end
    return nil, failure.bare(text)
  end
  if type(value) ~= "string" then
    return nil, "expected a text or a table, got a " .. type(value)
  end
  if not pcall(host.json.encode, value) then return nil, "is not UTF-8" end
  return value
end

--- Fills every hole. A hole without a value is an error; values without a hole are left out.
---@param values table<string, string|table>
---@return limax.llm.message[]|nil
---@return string|nil message names file, line and hole
function Template:fill(values)
  local texts, system = { "" }, nil
  for _, part in ipairs(self.parts) do
    if type(part) == "string" then
      -- a line of the template itself: a value cannot part messages
      local above, below = part:match "^(.-)\n%-%-%-[ \t]*\n(.*)$"
      if above and not system then
        texts[#texts + 1] = above
        system = table.concat(texts)
        texts = { below }
      else
        texts[#texts + 1] = part
      end
    else
      local value = values[part.hole]
      if value == nil then
        return nil, ("%s:%d: nothing fills the hole %s; known are: %s"):format(self.name, part.line,
          part.hole, table.concat(choice.sorted_keys(values), ", "))
      end
      local text, message = entered(value)
      if not text then
        return nil, ("%s:%d: the hole %s: %s"):format(self.name, part.line, part.hole, message)
      end
      texts[#texts + 1] = text
    end
  end
  local user = { role = "user", content = table.concat(texts) }
  if system then return { { role = "system", content = system }, user } end
  return { user }
end

return template
