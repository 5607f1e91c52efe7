--- replay.lua: a repetition that is supervised by another run's transcript: its proposals, failures
--- and fallbacks are applied again, without a network. What the transcript does not contain ends
--- the run.

local exchange = require "limax.supervise.llm.exchange"
local failure = require "limax.base.failure"
local host = require "limax.host"
local prompt = require "limax.supervise.llm.prompt"
local reader = require "limax.run.reader"
local source = require "limax.base.source"
local supervisor = require "limax.supervise.llm.supervisor"
local transcript = require "limax.supervise.llm.transcript"

local replay = {}

---@class limax.llm.replay
---@field name string of the supervisor that is replayed
local Replay = { name = "llm" }
Replay.__index = Replay

local function raise(text, ...) failure.raise(2, 'supervisor "replay": ' .. text:format(...)) end

-- The recorded run's options that determine the questions.
local function recorded_options(folder, options)
  local config = reader.read(folder).config
  local recorded = type(config.supervisor) == "table" and config.supervisor or {}
  local merged = { prompt = options.prompt }
  for _, name in ipairs { "context", "context_tokens" } do
    merged[name] = options[name]
    if merged[name] == nil then merged[name] = recorded[name] end
  end
  if type(merged.context) == "table" then
    raise("the context of %s is a function of %s: name it here too, context = f, or"
      .. ' match = "generation"', folder, merged.context["function"].file)
  end
  return merged
end

--- Begins the replay of a repetition. Raises on a folder without a complete transcript.
---@param options { run: string, match: "request"|"generation" }
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
  local self = setmetatable({ run = run, folder = folder, path = path,
    match = options.match or "request", recorded = transcript.read(path) }, Replay)
  if self.match == "request" then
    self.own_prompt = options.prompt ~= nil
    self.exchange = exchange.new(recorded_options(folder, options), run)
  end
  return self
end

local function stop(text, ...) failure.raise(1, "replay: " .. text:format(...)) end

-- The hash of this generation's request, made with the version of the prompt that the recorded run
-- used.
function Replay:request(step, ask)
  if ask and not self.own_prompt then
    local version, message = prompt.version(self.folder, ask.template_sha256)
    if not version then
      stop("the prompt of generation %d is missing: %s", step.generation, message)
    end
    self.exchange.prompt.template = version
  end
  local request, message = self.exchange:first(step.history)
  if request then return request.messages_sha256 end
  stop("the prompt of generation %d cannot be filled: %s", step.generation, message)
end

-- The outcome line of this generation.
function Replay:find(step)
  local repetition, generation = self.run.repetition, step.generation
  local recorded = self.recorded:outcome(repetition, generation)
  local ask = recorded and recorded.asks[1]
  local found, sha256 = recorded, nil
  -- a generation in which no model was asked has no request
  if self.match == "request" and (ask or not recorded) then
    sha256 = self:request(step, ask)
    -- a prompt may ask the same in several generations
    local same = ask and ask.messages_sha256 == sha256
    found = same and recorded or self.recorded:of_request(repetition, sha256)
  end
  if found then return found end
  if not recorded then
    stop("%s has no outcome of generation %d, repetition %d; a replay never asks a model",
      self.path, generation, repetition)
  end
  stop("the question of generation %d, repetition %d, differs from that in %s (SHA-256 %.12s, there"
    .. " %.12s): the experiment, the prompt or the build has changed;"
    .. ' match = "generation" uses its answers anyway', generation, repetition, self.path, sha256,
    ask.messages_sha256 or "none")
end

--- As `limax.llm.session:decide`.
function Replay:decide(step)
  local line = self:find(step)
  local parameters, fields, record = supervisor.apply(line, step.judge)
  return parameters, fields, record, { fallen_back = supervisor.is_fallback(line.source) }
end

return replay
