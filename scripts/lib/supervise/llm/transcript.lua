--- transcript.lua: transcript.jsonl, which keeps every exchange with a model: a line per attempt,
--- on disk before its answer is read, and a line per generation with the decision.

local failure = require "limax.base.failure"
local host = require "limax.host"
local sealed = require "limax.base.sealed"
local source = require "limax.base.source"

local transcript = {}

transcript.FILE = "transcript.jsonl"
local SCHEMA = "limax.transcript/1"

-- ---- reading ------------------------------------------------------------------------------------

-- The last line of a process that was killed may be incomplete: it counts as not written.
local function whole_lines(text) return text:sub(1, text:match ".*()\n" or 0) end

local function key_of(repetition, name) return repetition .. ":" .. name end

-- What is wrong with a line; nil where nothing is.
local function problem_of(line)
  if type(line) ~= "table" then return "expected an object" end
  if line.schema ~= SCHEMA then
    return ("expected schema %s, got %s"):format(SCHEMA, tostring(line.schema))
  end
  for _, name in ipairs { "repetition", "generation" } do
    if type(line[name]) ~= "number" then return "expected a number as " .. name end
  end
  if line.kind ~= "attempt" and line.kind ~= "outcome" then
    return "expected kind attempt or outcome, got " .. tostring(line.kind)
  end
  if line.kind == "outcome" and type(line.asks) ~= "table" then
    return "expected a list as asks"
  end
end

---@class limax.llm.recorded
---@field outcomes table<string, table> "repetition:generation" -> its last outcome line
---@field attempts table<string, integer> likewise, number of attempts
---@field by_request table<string, table> "repetition:SHA-256" of a first request -> the last one
local Recorded = {}
Recorded.__index = Recorded

--- Reads the lines of a transcript; raises with file and line what is wrong with one.
function transcript.read(path)
  local text, message = source.read(path)
  if not text then failure.raise(2, message) end
  local recorded, number = { outcomes = {}, attempts = {}, by_request = {} }, 0
  for row in whole_lines(text):gmatch "([^\n]*)\n" do
    number = number + 1
    local place = ("%s: line %d"):format(path, number)
    local line, unreadable = host.json.decode(row, place)
    if line == nil then failure.raise(2, unreadable) end
    local problem = problem_of(line)
    if problem then failure.raise(2, place .. ": " .. problem) end
    line.hash = nil
    local key = key_of(line.repetition, line.generation)
    if line.kind == "attempt" then
      recorded.attempts[key] = (recorded.attempts[key] or 0) + 1
    else
      recorded.outcomes[key] = line
      local first = line.asks[1]
      if first and first.messages_sha256 then
        recorded.by_request[key_of(line.repetition, first.messages_sha256)] = line
      end
    end
  end
  return setmetatable(recorded, Recorded)
end

--- The outcome of a generation; nil if there is none.
function Recorded:outcome(repetition, generation)
  return self.outcomes[key_of(repetition, generation)]
end

--- The outcome of the generation that began with this request; nil if there is none.
function Recorded:of_request(repetition, sha256)
  return self.by_request[key_of(repetition, sha256)]
end

-- ---- writing ------------------------------------------------------------------------------------

---@class limax.llm.transcript
---@field path string|nil nil: a run without a folder, which keeps nothing
---@field recorded limax.llm.recorded|nil of a run that is resumed
---@field attempts table<string, integer> "repetition:generation" -> number of attempts
local Transcript = {}
Transcript.__index = Transcript

--- Opens the transcript of a run folder at its end, without an incomplete last line.
---@param folder limax.run_folder|nil
function transcript.open(folder)
  local self = setmetatable({ attempts = {} }, Transcript)
  if not folder then return self end
  self.path = folder.path .. "/" .. transcript.FILE
  local text = source.read(self.path)
  if text then
    local whole = whole_lines(text)
    if #whole < #text then
      local ok, message = host.file.truncate(self.path, #whole)
      if not ok then failure.raise(1, message) end
    end
    self.recorded = transcript.read(self.path)
    self.attempts = self.recorded.attempts
  end
  return self
end

-- Raises if it cannot be written, as other lines of a run do: a resume asks again.
function Transcript:write(line, kind, repetition, generation)
  if not self.path then return end
  line.schema, line.kind, line.repetition, line.generation = SCHEMA, kind, repetition, generation
  local ok, message = host.file.append(self.path, sealed.add(host.json.encode(line) .. "\n"))
  if not ok then failure.raise_machine("disk", message) end
end

--- Adds an attempt.
---@param line table the client's record and its request
function Transcript:attempt(repetition, generation, line)
  local key = key_of(repetition, generation)
  self.attempts[key] = (self.attempts[key] or 0) + 1
  line.attempt = self.attempts[key]
  self:write(line, "attempt", repetition, generation)
end

--- Adds the outcome of a generation.
function Transcript:outcome(repetition, generation, line)
  self:write(line, "outcome", repetition, generation)
end

return transcript
