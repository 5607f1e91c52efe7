--- replay.lua: supervises a repetition by another run's transcript: applies its proposals, failures
--- and fallbacks again, without a network, by the request that they answered (the same question
--- must be asked again), or by generation. A decision that the transcript lacks ends the run.

local exchange = require "limax.supervise.llm.exchange"
local failure = require "limax.base.failure"
local host = require "limax.host"
local llm = require "limax.supervise.llm"
local prompt = require "limax.supervise.llm.prompt"
local reader = require "limax.run.reader"
local schema = require "limax.engine.schema"
local source = require "limax.base.source"
local supervisor = require "limax.supervise.llm.supervisor"
local transcript = require "limax.supervise.llm.transcript"

---@class limax.llm.replay
---@field name string of the supervisor that is replayed
local Replay = { name = "llm" }
Replay.__index = Replay

local function raise(text, ...) failure.raise(2, 'supervisor "replay": ' .. text:format(...)) end

-- The recorded run's options that determine the questions.
local function recorded_options(folder, options)
  local config = reader.read(folder).config
  local recorded = type(config.supervisor) == "table" and config.supervisor or {}
  local context = options.context or recorded.context
  if type(context) == "table" then
    raise("the context of %s is a function of %s: name it here too, context = f, or"
      .. ' match = "generation"', folder, context["function"].file)
  end
  return { prompt = options.prompt, context = context,
    context_tokens = options.context_tokens or recorded.context_tokens }
end

-- Begins the replay of a repetition. Raises on a folder without a complete transcript.
local function start(options, run)
  local origin, folder = run.experiment.origin, options.run
  if not folder then raise 'expected run = "DIR", the folder of the run to be replayed' end
  if not host.file.exists(folder) and origin then
    folder = source.folder_of(origin) .. "/" .. folder
  end
  reader.read(folder)
  local path = folder .. "/" .. transcript.FILE
  if host.file.exists(path) ~= "file" then
    raise("there is no %s: only a run that a model supervised can be replayed", path)
  end
  return setmetatable({ run = run, folder = folder, path = path, own_prompt = options.prompt ~= nil,
    recorded = transcript.read(path), exchange = options.match ~= "generation"
      and exchange.new(recorded_options(folder, options), run) }, Replay)
end

local function stop(text, ...) failure.raise(1, "replay: " .. text:format(...)) end

-- The hash of this generation's request, made with the version of the prompt that the recorded run
-- used.
function Replay:request(step, ask)
  if not self.own_prompt then
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
  if not recorded then
    stop("%s has no outcome of generation %d, repetition %d; a replay never asks a model",
      self.path, generation, repetition)
  end
  local ask = recorded.asks[1]
  -- a generation in which no model was asked has no request
  if not self.exchange or not ask then return recorded end
  local sha256 = self:request(step, ask)
  if ask.messages_sha256 == sha256 then return recorded end
  stop("the question of generation %d, repetition %d, differs from that in %s (SHA-256 %.12s, there"
    .. " %.12s): the experiment, the prompt or the build has changed;"
    .. ' match = "generation" uses its answers anyway', generation, repetition, self.path, sha256,
    ask.messages_sha256)
end

--- As `limax.llm.session:decide`.
function Replay:decide(step) return supervisor.apply(self:find(step), step.judge) end

return {
  options = {
    run = schema.text("[^%c]+", "the path of a run folder"),
    match = schema.choice { "request", "generation" },
    prompt = llm.options.prompt, context = llm.options.context,
    context_tokens = llm.options.context_tokens,
  },
  start = start,
}
