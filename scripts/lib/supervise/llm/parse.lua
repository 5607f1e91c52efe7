--- parse.lua: turns a model's text into a proposal. locate.lua, or a parser that the experiment
--- names, reads the text in a process of its own (host.sandbox). What comes back is plain data of
--- bounded size, without control characters. The ledger checks ranges.

local choice = require "limax.base.choice"
local host = require "limax.host"
local source = require "limax.base.source"
local terminal = require "limax.base.terminal"
local text = require "limax.supervise.llm.text"

local parse = {}

---@class limax.llm.parser
---@field source string Lua text that returns a function(text, limits)
---@field name string for messages
---@field sha256 string of the source
local Parser = {}
Parser.__index = Parser

-- Most fields of an object in a proposal: seven materials with five fields have 35.
local MOST_FIELDS = 100
-- Deepest tables of a proposal: parameters, materials, fields of a material, and one to be refused.
local DEEPEST = 4
-- Longest field name and longest reason that are kept, bytes.
local LONGEST_NAME, LONGEST_REASON = 60, 200

-- ---- parsers ------------------------------------------------------------------------------------

local function new(code, name)
  return setmetatable({ source = code, name = name, sha256 = host.sha256(code) }, Parser)
end

-- The source of one function, from its lines in a file: the text between a word `function` and a
-- word `end` that compiles to the same bytecode.
local function source_of(lines, call)
  local code = string.dump(call, true)
  for from in lines:gmatch "()%f[%w_]function%f[^%w_]" do
    -- it begins on the first line
    if lines:sub(1, from):find("\n", 1, true) then break end
    local last_line = lines:match ".*()\n" or 0
    for to in lines:gmatch "%f[%w_]end()%f[^%w_]" do
      if to > last_line and to > from then
        local found = lines:sub(from, to - 1):gsub("^function%s+[%w_%.]+", "function")
        found = "return (" .. found .. ")"
        local chunk = loadstring(found)
        local made = chunk and chunk()
        if type(made) == "function" and string.dump(made, true) == code then return found end
      end
    end
  end
end

-- A parser from a function of the experiment.
local function of_function(call)
  local info = debug.getinfo(call, "S")
  local place = ("parse (%s:%d)"):format(source.name_of(info.short_src), info.linedefined)
  local upvalue = debug.getupvalue(call, 1)
  if upvalue then
    return nil, ("%s: the parser runs in a process of its own and cannot use the local variable %s"
      .. " from outside; move it into the function"):format(place, upvalue)
  end
  local lines = info.source:sub(1, 1) == "@"
    and source.lines(info.source:sub(2), info.linedefined, info.lastlinedefined)
  local found = lines and source_of(lines, call)
  if not found then
    return nil, place .. ": cannot find the function's source; put it on lines of its own, or in a"
      .. ' file that returns it: parse = "file.lua"'
  end
  return new(found, "=" .. place)
end

--- The parser that an experiment names: nil for locate.lua, a file, or a function. nil and a
--- message where it cannot be used.
---@param parser nil|string|function
---@param folder? string of the experiment, where files are looked for
function parse.from(parser, folder)
  if type(parser) == "function" then return of_function(parser) end
  local path, missing = host.home .. "/scripts/lib/supervise/llm/locate.lua", nil
  if parser then path, missing = source.beside(parser, folder) end
  if missing then return nil, "parse: " .. missing end
  local code, message = source.read(path)
  if not code then return nil, "parse: " .. message end
  local name = "=" .. source.name_of(path)
  local chunk, syntax_error = loadstring(code, name)
  if not chunk then return nil, "parse: " .. syntax_error end
  return new(code, name)
end

-- ---- answers ------------------------------------------------------------------------------------

-- A copy without nulls and with clean names; nil and a message where it is too large.
local function plain(value, depth)
  if type(value) == "string" then return text.line(value, LONGEST_REASON) end
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
      if type(key) == "string" then key = text.line(key, LONGEST_NAME) end
      copy[key], message = plain(entry, depth + 1)
      if message then return nil, message end
    end
  end
  return copy
end

---@class limax.llm.parsed
---@field proposal table without `reason`
---@field reason string|nil of the model
---@field stage string where the object was found

--- Makes a limax.llm.parsed of what a parser returned; nil and a message for the model's second
--- try and the transcript.
---@param message string|nil
---@param stage string|nil
function parse.accept(value, message, stage)
  if value == nil then
    return nil, message and text.line(message, LONGEST_REASON) or "the parser found no proposal"
  end
  if type(value) ~= "table" or host.json.is_array(value) then
    return nil, "the parser returned no table of fields"
  end
  local proposal, problem = plain(value, 1)
  if not proposal then return nil, problem end
  local reason = proposal.reason
  proposal.reason = nil
  if type(reason) ~= "string" or reason == "" then reason = nil end
  return { proposal = proposal, reason = reason,
    stage = stage and text.line(stage, LONGEST_NAME) or "own parser" }
end

--- Reads a text as limax.llm.parsed; nil and a message. Nothing in it is executed.
function Parser:read(content, limits)
  if terminal.utf8(content) ~= content then return nil, "the answer is not UTF-8" end
  local ok, value, message, stage = host.sandbox { source = self.source, name = self.name,
    text = content, limits = limits }
  if not ok then return nil, "the parser failed: " .. text.line(value, LONGEST_REASON) end
  return parse.accept(value, message, stage)
end

return parse
