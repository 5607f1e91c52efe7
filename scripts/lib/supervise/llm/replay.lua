--- replay.lua: a repetition that a transcript supervises: every proposal, time-out and fallback of
--- another run comes back as it was, without a network and without a clock. What the transcript
--- does not hold ends the run; nobody is asked in its place.

local exchange = require "limax.supervise.llm.exchange"
local failure = require "limax.base.failure"
local host = require "limax.host"
local prompt_file = require "limax.supervise.llm.prompt_file"
local source = require "limax.base.source"
local supervisor = require "limax.supervise.llm.supervisor"
local transcript = require "limax.supervise.llm.transcript"

local replay = {}

---@class limax.llm.replay
---@field name string of the supervisor that is replayed
local Replay = { name = "llm" }
Replay.__index = Replay

local function raise(text, ...) failure.raise(2, 'supervisor "replay": ' .. text:format(...)) end

-- The recorded run's options that say what was asked.
local function recorded_options(folder, options)
  local path = folder .. "/config.json"
  local text, message = source.read(path)
  local config = text and host.json.decode(text, path)
  if not config then
    raise("%s is no run folder: %s", folder, message or "config.json is broken")
  end
  local theirs = type(config.supervisor) == "table" and config.supervisor or {}
  local merged = { prompt = options.prompt, context = options.context,
    context_tokens = options.context_tokens }
  for _, name in ipairs { "context", "context_tokens" } do
    if merged[name] == nil then merged[name] = theirs[name] end
  end
  if type(merged.context) == "table" then
    raise("the context of %s is a function of %s: name it here too, context = f, or"
      .. ' match = "generation"', folder, merged.context["function"].file)
  end
  return merged
end

--- Begins the replay of a repetition. Raises on a folder without a whole transcript.
---@param run limax.run
---@param options { run: string, match: "request"|"generation" }
---@return limax.llm.replay
function replay.start(run, options)
  local origin = run.experiment.origin
  local folder = options.run
  if not folder then raise 'expected run = "DIR", the folder of the run to be replayed' end
  if not host.file.exists(folder) and origin then
    folder = source.folder_of(origin) .. "/" .. folder
  end
  local path = folder .. "/" .. transcript.FILE
  if host.file.exists(path) ~= "file" then
    raise("there is no %s: only a run that a model supervised can be replayed", path)
  end
  local self = setmetatable({ run = run, folder = folder, match = options.match or "request",
    recorded = transcript.read(path) }, Replay)
  if self.match == "request" then
    self.own_prompt = options.prompt ~= nil
    self.exchange = exchange.new(recorded_options(folder, options), run)
  end
  return self
end

-- The request of this generation, made with the version of the prompt that the recorded run used.
function Replay:request(given, recorded)
  local ask = recorded and recorded.asks[1]
  if ask and not self.own_prompt then
    local version, message = prompt_file.version(self.folder, ask.template_sha256)
    if not version then
      failure.raise(1, ("replay: the prompt of generation %d is gone: %s"):format(given.generation,
        message))
    end
    self.exchange.prompt.template = version
  end
  local request, message = self.exchange:first(given.history)
  if request then return request end
  failure.raise(1, ("replay: the prompt of generation %d cannot be filled: %s")
    :format(given.generation, message))
end

-- The outcome line of this generation.
function Replay:find(given)
  local repetition, generation = self.run.repetition, given.generation
  local here = ("%s/%s"):format(self.folder, transcript.FILE)
  local recorded = self.recorded:outcome(repetition, generation)
  -- a generation in which nobody was asked has no request
  local silent = recorded and #recorded.asks == 0
  if self.match == "request" and not silent then
    local request = self:request(given, recorded)
    -- a prompt may ask the same in several generations
    if recorded and recorded.asks[1].messages_sha256 == request.messages_sha256 then
      return recorded
    end
    local found = self.recorded:of_request(repetition, request.messages_sha256)
    if found then return found end
    if recorded then
      failure.raise(1, ("replay: generation %d of repetition %d asks another question than %s holds"
        .. " (SHA-256 %.12s, there %.12s): the experiment, the prompt or the build is another;"
        .. ' match = "generation" takes its answers nevertheless'):format(generation, repetition,
        here, request.messages_sha256, recorded.asks[1].messages_sha256 or "none"))
    end
  end
  if recorded then return recorded end
  failure.raise(1, ("replay: %s holds no outcome of generation %d, repetition %d; a replay never"
    .. " asks a model"):format(here, generation, repetition))
end

--- As `limax.llm.session:decide`.
---@param given limax.supervision.given
---@return table parameters
---@return table fields
---@return table record
---@return table numbers
function Replay:decide(given)
  local line = self:find(given)
  local parameters, fields, record = supervisor.apply(line, given.judge)
  return parameters, fields, record, { fallen_back = supervisor.is_fallback(line.source) }
end

return replay
