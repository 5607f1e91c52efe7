--- transcript.lua: transcript.jsonl, which keeps every exchange with a model: a line per attempt,
--- on disk before its answer is read, and a line per generation with the decision.

local failure = require "limax.base.failure"
local host = require "limax.host"
local sealed = require "limax.base.sealed"
local source = require "limax.base.source"

local transcript = {}

transcript.FILE = "transcript.jsonl"
local SCHEMA = "limax.transcript/1"

---@class limax.llm.transcript
---@field path string|nil nil: a run without a folder, which keeps nothing
---@field outcomes table<string, table> "repetition:generation" -> its last outcome line
local Transcript = {}
Transcript.__index = Transcript

local function key_of(repetition, generation)
  return tostring(repetition) .. ":" .. tostring(generation)
end

-- The last line of a process that was killed may be incomplete: it counts as not written.
local function whole_lines(text) return text:sub(1, text:match ".*()\n" or 0) end

-- What is wrong with a line; nil where nothing is.
local function problem_of(line)
  local schema = type(line) == "table" and line.schema
  if schema ~= SCHEMA then
    return ("expected schema %s, got %s"):format(SCHEMA, tostring(schema))
  end
  if line.kind == "outcome" and type(line.asks) ~= "table" then
    return "expected a list as asks"
  end
end

--- Reads a transcript; raises with file and line what is wrong with one.
function transcript.read(path)
  local text, message = source.read(path)
  if not text then failure.raise(2, message) end
  local outcomes, number = {}, 0
  for row in whole_lines(text):gmatch "([^\n]*)\n" do
    number = number + 1
    local place = ("%s: line %d"):format(path, number)
    local line, unreadable = host.json.decode(row, place)
    if line == nil then failure.raise(2, unreadable) end
    local problem = problem_of(line)
    if problem then failure.raise(2, place .. ": " .. problem) end
    if line.kind == "outcome" then outcomes[key_of(line.repetition, line.generation)] = line end
  end
  return setmetatable({ path = path, outcomes = outcomes }, Transcript)
end

--- Opens the transcript of a run folder at its end, without an incomplete last line.
---@param folder limax.run_folder|nil
function transcript.open(folder)
  local path = folder and folder.path .. "/" .. transcript.FILE
  local text = path and source.read(path)
  if not text then return setmetatable({ path = path, outcomes = {} }, Transcript) end
  local ok, message = host.file.truncate(path, #whole_lines(text))
  if not ok then failure.raise(1, message) end
  return transcript.read(path)
end

--- The outcome of a generation; nil if there is none.
function Transcript:outcome(repetition, generation)
  return self.outcomes[key_of(repetition, generation)]
end

--- Adds a line. Raises if it cannot be written, as other lines of a run do: a resume asks again.
---@param kind "attempt"|"outcome"
function Transcript:write(kind, repetition, generation, line)
  if not self.path then return end
  line.schema, line.kind, line.repetition, line.generation = SCHEMA, kind, repetition, generation
  local ok, message = host.file.append(self.path, sealed.add(host.json.encode(line) .. "\n"))
  if not ok then failure.raise_machine("disk", message) end
end

return transcript
