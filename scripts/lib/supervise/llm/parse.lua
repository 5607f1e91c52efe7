--- parse.lua: turns a model's text into a proposal. locate.lua, or a parser that the experiment
--- names, reads the text in a process of its own (host.sandbox). The result is plain data of
--- bounded size, without control characters. proposals.lua checks ranges.

local choice = require "limax.base.choice"
local host = require "limax.host"
local source = require "limax.base.source"
local terminal = require "limax.base.terminal"

local parse = {}

---@class limax.llm.parser
---@field sha256 string of its source
local Parser = {}
Parser.__index = Parser

-- Most fields of an object in a proposal: seven materials with five fields have 35.
local MOST_FIELDS = 100
-- Deepest tables of a proposal: parameters, materials, fields of a material, and one to be refused.
local DEEPEST = 4
-- Longest field name and longest reason that are kept, bytes.
local LONGEST_NAME, LONGEST_REASON = 60, 200

--- The parser that an experiment names: nil for locate.lua, a file, or Lua text of several lines.
--- nil and a message if it cannot be used.
---@param folder? string of the experiment, where files are looked for
function parse.from(parser, folder)
  local code, name, message = parser, "=parse", nil
  if not parser or not parser:find "\n" then
    local path = host.home .. "/scripts/lib/supervise/llm/locate.lua"
    if parser then path, message = source.beside(parser, folder) end
    if not message then code, message = source.read(path) end
    if message then return nil, "parse: " .. message end
    name = "=" .. source.name_of(path)
  end
  local chunk, syntax_error = loadstring(code, name)
  if not chunk then return nil, "parse: " .. syntax_error end
  return setmetatable({ source = code, name = name, sha256 = host.sha256(code) }, Parser)
end

-- A copy without nulls and with clean names; nil and a message if it is too large.
local function plain(value, depth)
  if type(value) == "string" then return terminal.line(value, LONGEST_REASON) end
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
      if type(key) == "string" then key = terminal.line(key, LONGEST_NAME) end
      copy[key], message = plain(entry, depth + 1)
      if message then return nil, message end
    end
  end
  return copy
end

--- Turns the result of a parser into a proposal and the model's reason; nil and a message for the
--- model's second try and the transcript.
---@return { proposal: table, reason: string|nil }|nil
function parse.accept(value, message)
  if value == nil then
    return nil, message and terminal.line(message, LONGEST_REASON) or "the parser found no proposal"
  end
  if type(value) ~= "table" or host.json.is_array(value) then
    return nil, "the parser returned no table of fields"
  end
  local proposal, problem = plain(value, 1)
  if not proposal then return nil, problem end
  local reason = proposal.reason
  if type(reason) ~= "string" or reason == "" then reason = nil end
  proposal.reason = nil
  return { proposal = proposal, reason = reason }
end

--- Reads a text, as `parse.accept`. Nothing in it is executed.
function Parser:read(content, limits)
  if terminal.utf8(content) ~= content then return nil, "the answer is not UTF-8" end
  local ok, value, message = host.sandbox { source = self.source, name = self.name,
    text = content, limits = limits }
  if not ok then return nil, "the parser failed: " .. terminal.line(value, LONGEST_REASON) end
  return parse.accept(value, message)
end

return parse
