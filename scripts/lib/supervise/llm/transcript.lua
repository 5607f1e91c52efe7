--- transcript.lua: transcript.jsonl, which keeps every exchange with a model: a line per attempt,
--- on disk before its answer is read, and a line per generation with the decision.

local failure = require "limax.base.failure"
local host = require "limax.host"
local schema = require "limax.engine.schema"
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

local sha256, words = schema.text(("%x"):rep(64), "64 hexadecimal digits"), schema.string
local required, whole = schema.required, schema.whole(0, 2 ^ 53)
-- The fields of a line that are read again.
local rule = schema.record { schema = required(schema.choice { SCHEMA }),
  kind = required(schema.choice { "attempt", "outcome" }), repetition = required(whole),
  generation = required(whole), source = words, why = words, reason = words, unchanged = whole,
  proposal = schema.table, client = schema.table,
  asks = schema.list(schema.record { messages_sha256 = required(sha256),
    template_sha256 = required(sha256) }, { expected = "a list" }) }

--- Reads a transcript; raises an error with file and line if it is damaged.
function transcript.read(path)
  local content, message = source.read_own(path)
  if not content then failure.raise(2, message) end
  local outcomes, number = {}, 0
  for row in whole_lines(content):gmatch "([^\n]*)\n" do
    number = number + 1
    local line, problem = sealed.open(row)
    if line then problem = select(2, rule(line, "")) end
    if problem then failure.raise(2, ("%s: line %d: %s"):format(path, number, problem)) end
    line.asks = line.asks or {}
    if line.kind == "outcome" then outcomes[key_of(line.repetition, line.generation)] = line end
  end
  return setmetatable({ path = path, outcomes = outcomes }, Transcript)
end

--- Opens the transcript of a run folder at its end, without an incomplete last line.
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
function Transcript:write(kind, repetition, generation, line)
  if not self.path then return end
  line.schema, line.kind, line.repetition, line.generation = SCHEMA, kind, repetition, generation
  local ok, message = host.file.append(self.path, sealed.add(host.json.encode(line) .. "\n"))
  if not ok then failure.raise_machine("disk", message) end
end

return transcript
