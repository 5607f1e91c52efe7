--- prompt.lua: prompts: texts with {{holes}} in files. A prompt can do nothing but fill holes, and
--- a value is never searched for holes. A table is written as JSON whose strings cannot end a
--- fence, open a tag or control a terminal. A run folder keeps every version that was used, by its
--- hash.

local choice = require "limax.base.choice"
local failure = require "limax.base.failure"
local host = require "limax.host"
local source = require "limax.base.source"

local prompt = {}

---@class limax.llm.message
---@field role "system"|"user"|"assistant"
---@field content string

---@class limax.llm.template
---@field name string the file, for messages
---@field sha256 string
local Template = {}
Template.__index = Template

-- All but letters, digits and signs that neither markup nor templates nor chat formats use.
local SPECIAL = "[^%w %.,:;!%?%+%-%*/=%(%)'_%%\\\1\2]"

local function escaped(character) return ("\\u%04x"):format(character:byte()) end

-- The inside of a JSON string as ASCII with special characters escaped. The encoder has checked
-- that it is UTF-8.
local function escape_string(inside)
  local ascii = inside:gsub("[\194-\244][\128-\191]*", function(sequence)
    local first = sequence:byte()
    local code = first % (first < 0xe0 and 0x20 or first < 0xf0 and 0x10 or 0x08)
    for k = 2, #sequence do code = code * 0x40 + sequence:byte(k) % 0x40 end
    if code < 0x10000 then return ("\\u%04x"):format(code) end
    code = code - 0x10000
    return ("\\u%04x\\u%04x"):format(0xd800 + math.floor(code / 0x400), 0xdc00 + code % 0x400)
  end)
  return '"' .. ascii:gsub(SPECIAL, escaped) .. '"'
end

--- A value as JSON with all special characters of its strings escaped; it reads back equal.
function prompt.json(value)
  -- JSON has no raw control characters: two of them hold the places of \\ and \"
  local json = host.json.encode(value):gsub("\\\\", "\1"):gsub('\\"', "\2")
  json = json:gsub('"([^"]*)"', escape_string):gsub("\2", '\\"'):gsub("\1", "\\\\")
  return json
end

local function is_utf8(text) return (pcall(host.json.encode, text)) end

--- Reads a prompt; nil and a message if it has an error. The first line `---` separates the
--- system's message, above it, from the user's.
---@param name string its file, for messages
function prompt.read(original, name)
  if not is_utf8(original) then return nil, name .. ": is not UTF-8" end
  local text = original:gsub("^\239\187\191", ""):gsub("\r\n", "\n")
  if not text:find "%S" then return nil, name .. ": is empty" end
  local parts, at = {}, 1
  for open in function() return (text:find("{{", at, true)) end do
    local _, line = text:sub(1, open):gsub("\n", "")
    local place = ("%s:%d: "):format(name, line + 1)
    local hole, close = text:match("^{{%s*([%a_][%w_]*)%s*}}()", open)
    if not hole then
      return nil, place .. "expected a hole, two braces around a name, such as {{generations}}"
    end
    parts[#parts + 1] = text:sub(at, open - 1)
    parts[#parts + 1] = { hole = hole, place = place }
    at = close
  end
  parts[#parts + 1] = text:sub(at)
  return setmetatable({ name = name, original = original, sha256 = host.sha256(original),
    parts = parts }, Template)
end

-- A value as it enters the text; nil and a message.
local function text_of(value)
  if type(value) == "table" then
    local ok, text = pcall(prompt.json, value)
    return ok and text or nil, not ok and failure.bare(text) or nil
  elseif type(value) ~= "string" then
    return nil, "expected a text or a table, got a " .. type(value)
  end
  return is_utf8(value) and value or nil, "is not UTF-8"
end

--- The messages with every hole filled; nil and a message with file, line and hole where one has no
--- value. Values without a hole are left out.
function Template:fill(values)
  local texts, system = {}, nil
  for _, part in ipairs(self.parts) do
    if type(part) == "string" then
      -- only a line of the template itself separates messages
      local above, below = part:match "^(.-)\n%-%-%-[ \t]*\n(.*)$"
      if above and not system then
        system, texts, part = table.concat(texts) .. above, {}, below
      end
      texts[#texts + 1] = part
    elseif values[part.hole] == nil then
      return nil, ("%snothing fills the hole %s; values exist for: %s"):format(part.place,
        part.hole, table.concat(choice.sorted_keys(values), ", "))
    else
      local text, message = text_of(values[part.hole])
      if not text then return nil, ("%sthe hole %s: %s"):format(part.place, part.hole, message) end
      texts[#texts + 1] = text
    end
  end
  local user = { role = "user", content = table.concat(texts) }
  return system and { { role = "system", content = system }, user } or { user }
end

local FOLDER = "prompts" -- of versions, in a run folder

---@class limax.llm.prompt_file
---@field template limax.llm.template the version in use
local File = {}
File.__index = File

local function read_file(path, sha256)
  local text, message = (sha256 and source.read_own or source.read)(path)
  if not text then return nil, message end
  if sha256 and host.sha256(text) ~= sha256 then
    return nil, path .. " does not match its name, which is its SHA-256"
  end
  return prompt.read(text, source.name_of(path))
end

--- The path of a prompt that an experiment names: beside the experiment, else one of limax's own.
function prompt.path(name, folder)
  local path = name:sub(1, 1) == "/" and name or ("%s/%s"):format(folder or ".", name)
  return host.file.exists(path) == "file" and path or ("%s/prompts/%s"):format(host.home, name)
end

--- Opens a prompt; nil and a message.
---@param name string|nil as an experiment names it; nil: limax's own, `default`
function prompt.open(name, default, folder)
  local path = name and prompt.path(name, folder) or ("%s/prompts/%s"):format(host.home, default)
  if host.file.exists(path) ~= "file" then
    return nil, ("prompt: there is no file %s beside the experiment, nor in %s/prompts"):format(
      name, host.home)
  end
  local template, message = read_file(path)
  if not template then return nil, "prompt: " .. message end
  return setmetatable({ path = path, template = template }, File)
end

--- A version that a run folder keeps; nil and a message.
function prompt.version(folder, sha256)
  return read_file(("%s/%s/%s.md"):format(folder, FOLDER, sha256), sha256)
end

--- Reads the file again. If it cannot be used, the version before stays in use.
---@return string|nil message why
function File:refresh()
  local template, message = read_file(self.path)
  self.template = template or self.template
  return message
end

--- Keeps the version in use in a run folder.
---@return string|nil message why it could not be kept
function File:keep(folder)
  local sha256 = self.template.sha256
  if not folder or self.kept == sha256 then return nil end
  local place = folder.path .. "/" .. FOLDER
  local ok, message = host.file.mkdir(place)
  if ok then
    ok, message = host.file.write_atomic(("%s/%s.md"):format(place, sha256), self.template.original)
  end
  if not ok then return message end
  self.kept = sha256
end

return prompt
