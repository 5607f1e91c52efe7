--- parse.lua: from a model's text to a proposal. The text is read in a Lua state of its own
--- (host.sandbox) by locate.lua or by a parser that the experiment names; what comes back is plain
--- data, made harmless for logs and bounded in size. Ranges are the ledger's.

local choice = require "limax.base.choice"
local host = require "limax.host"
local source = require "limax.base.source"

local parse = {}

---@class limax.llm.parser
---@field source string Lua text that returns a function(text, limits)
---@field name string for messages
---@field sha256 string of the source
local Parser = {}
Parser.__index = Parser

-- Most fields of an object of a proposal: seven materials of five fields are 35.
local MOST_FIELDS = 100
-- Deepest tables of a proposal: parameters, materials, fields of a material, and one to be refused.
local DEEPEST = 4
-- Longest name of a field and longest reason that are kept, bytes.
local LONGEST_NAME, LONGEST_REASON = 60, 200

-- ---- parsers ------------------------------------------------------------------------------------

local function new(text, name)
  return setmetatable({ source = text, name = name, sha256 = host.sha256(text) }, Parser)
end

--- The parser used when an experiment names none.
---@return limax.llm.parser
function parse.default()
  local path = host.home .. "/scripts/lib/supervise/llm/locate.lua"
  return new(assert(source.read(path)), "=locate.lua")
end

-- Names of what a function takes from around it.
local function upvalues(call)
  local names, index = {}, 1
  while true do
    local name = debug.getupvalue(call, index)
    if not name then break end
    names[index], index = name, index + 1
  end
  return names
end

-- The text of a function alone, out of the lines where it stands: from one of the words `function`
-- to one of the words `end`, with its own name left out. Which ones, the compiled code tells.
local function cut(lines, call)
  local code = string.dump(call, true)
  for from in lines:gmatch "()%f[%w_]function%f[^%w_]" do
    -- it begins on the first line
    if lines:sub(1, from):find("\n", 1, true) then break end
    local last_break = lines:match ".*()\n" or 0
    for to in lines:gmatch "%f[%w_]end()%f[^%w_]" do
      if to > last_break and to > from then
        local text = lines:sub(from, to - 1):gsub("^function%s+[%w_%.]+", "function")
        text = "return (" .. text .. ")"
        local chunk = loadstring(text)
        local made = chunk and chunk()
        if type(made) == "function" and string.dump(made, true) == code then return text end
      end
    end
  end
end

-- A parser from a function of the experiment: its text, for another Lua state.
local function of_function(call)
  local info = debug.getinfo(call, "S")
  local place = ("parse (%s:%d)"):format(source.name_of(info.short_src), info.linedefined)
  local around = upvalues(call)
  if #around > 0 then
    return nil, ("%s: a parser runs in a Lua state of its own, so it must stand alone, and this"
      .. " one uses %s from around it; move that inside"):format(place, table.concat(around, ", "))
  end
  local text
  if info.source:sub(1, 1) == "@" then
    text = source.lines(info.source:sub(2), info.linedefined, info.lastlinedefined)
  end
  text = text and cut(text, call)
  if not text then
    return nil, place .. ": the function's text cannot be told from its neighbours; put it on lines"
      .. " of its own, or in a file that returns it: parse = \"file.lua\""
  end
  return new(text, "=" .. place)
end

--- The parser that an experiment names: nil, a file, or a function.
---@param spec nil|string|function
---@param folder string|nil of the experiment, where files are looked for
---@return limax.llm.parser|nil
---@return string|nil message
function parse.from(spec, folder)
  if spec == nil then return parse.default() end
  if type(spec) == "function" then return of_function(spec) end
  local path = source.beside(spec, folder)
  local text, message = source.read(path)
  if not text then return nil, "parse: " .. message end
  local chunk, wrong = loadstring(text, "=" .. source.name_of(path))
  if not chunk then return nil, "parse: " .. wrong end
  return new(text, "=" .. source.name_of(path))
end

-- ---- answers ------------------------------------------------------------------------------------

-- A text for logs and ledger: one line, no control characters, of bounded length, still UTF-8.
local function clean(text, longest)
  text = text:gsub("[%c\127]+", " ")
  -- control characters of Latin-1, and those that turn the direction of writing
  text = text:gsub("\194[\128-\159]", " "):gsub("\226\128[\168-\174]", " ")
    :gsub("\226\129[\166-\169]", " ")
  if #text <= longest then return text end
  while longest > 0 and text:byte(longest + 1) >= 0x80 and text:byte(longest + 1) < 0xc0 do
    longest = longest - 1
  end
  return text:sub(1, longest)
end
parse.clean = clean

-- Without nulls, names clean; nil and a message where it is too large.
local function plain(value, depth)
  if type(value) == "string" then return clean(value, LONGEST_REASON) end
  if type(value) ~= "table" then return value end
  if depth > DEEPEST then return "a table" end
  local copy, keys = {}, choice.sorted_keys(value)
  if #keys > MOST_FIELDS then
    return nil, ("an object of the answer has more than %d fields"):format(MOST_FIELDS)
  end
  for _, key in ipairs(keys) do
    local entry = value[key]
    if entry ~= host.json.null then
      local message
      if type(key) == "string" then key = clean(key, LONGEST_NAME) end
      copy[key], message = plain(entry, depth + 1)
      if message then return nil, message end
    end
  end
  return copy
end

---@class limax.llm.parsed
---@field proposal table without `reason`
---@field reason string|nil what the model said
---@field stage string where the object stood

--- Reads a text. Nothing in it is executed.
---@param text string
---@param limits string the run's limits, as JSON
---@return limax.llm.parsed|nil
---@return string|nil message for the model's second try and the transcript
function Parser:read(text, limits)
  local ok, value, message, stage = host.sandbox { source = self.source, name = self.name,
    text = text, limits = limits }
  if not ok then return nil, "the parser failed: " .. clean(value, LONGEST_REASON) end
  if value == nil then
    return nil, message and clean(message, LONGEST_REASON) or "the parser found no proposal"
  end
  if type(value) ~= "table" or host.json.is_array(value) then
    return nil, "the parser returned no table of fields"
  end
  local proposal, wrong = plain(value, 1)
  if not proposal then return nil, wrong end
  local reason = proposal.reason
  proposal.reason = nil
  if type(reason) ~= "string" or reason == "" then reason = nil end
  return { proposal = proposal, reason = reason,
    stage = stage and clean(stage, LONGEST_NAME) or "own parser" }
end

return parse
