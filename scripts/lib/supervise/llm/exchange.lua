--- exchange.lua: the messages that ask a model about a generation, made from history, prompt and
--- context, and their hash. A replay makes the same messages from the same history.

local context = require "limax.supervise.llm.context"
local failure = require "limax.base.failure"
local host = require "limax.host"
local prompt = require "limax.supervise.llm.prompt"
local shown = require "limax.supervise.shown"
local source = require "limax.base.source"
local terminal = require "limax.base.terminal"
local usage = require "limax.supervise.llm.usage"

local exchange = {}

---@class limax.llm.exchange
local Exchange = {}
Exchange.__index = Exchange

local LONGEST_ECHO = 4000 -- bytes of an answer that is shown to a model again

--- The questions of an experiment, by its options `prompt`, `again`, `context` and
--- `context_tokens`. Raises if a prompt is missing or cannot be read.
function exchange.new(options, run)
  local folder = run.experiment.origin and source.folder_of(run.experiment.origin)
  local function open(name, default)
    local file, message = prompt.open(name, default, folder)
    if not file then failure.raise(2, "supervisor \"llm\": " .. message) end
    return file
  end
  local paper = options.context == "paper"
  return setmetatable({ run = run, name = paper and "paper" or "summary",
    own = type(options.context) == "function" and options.context or nil,
    tokens = options.context_tokens or (paper and math.huge or context.TOKENS),
    prompt = open(options.prompt, paper and "paper.md" or "supervise.md"),
    -- a parser of the user's own expects a form of its own
    again_prompt = open(options.again, options.parse and "again_own.md" or "again.md"),
  }, Exchange)
end

-- A request: the hash of messages and schema, estimated tokens, and the level of the context.
local function request_of(messages, schema, template, detail)
  return { messages = messages, schema = schema, detail = detail,
    tokens = usage.estimate(messages), template_sha256 = template.sha256,
    messages_sha256 = host.sha256(host.json.encode { messages = messages, schema = schema }) }
end

-- Calls the user's own context function. Returns its table, {} without one; or nil and a message.
local function own_holes(call, history, limits)
  if not call then return {} end
  local ok, values = failure.attempt_user(call, shown.of(history), limits)
  if not ok then return nil, "the context function failed: " .. failure.bare(values) end
  if type(values) == "table" then return values end
  return nil, "the context function returned no table of { hole = text or table }"
end

--- The request for the generation after the last of `history`; nil and a message.
---@param tokens? number most estimated tokens, instead of the experiment's
function Exchange:first(history, tokens)
  local run, template = self.run, self.prompt.template
  local facts = { name = self.name, history = history, limits = run.world.limits,
    allowed = run.config.supervision, first = run.world.first_fields, config = run.config }
  local form, schema = context.answer(facts)
  self.form = form
  local own, problem = own_holes(self.own, history, run.world.limits)
  if not own then return nil, problem end
  local request
  for level, detail in ipairs(context.levels[self.name]) do
    local holes = context.holes(facts, detail)
    holes.answer = form
    for name, value in pairs(own) do holes[name] = value end
    local messages, message = template:fill(holes)
    if not messages then return nil, message end
    request = request_of(messages, schema, template, level)
    if request.tokens <= (tokens or self.tokens) then break end
  end
  return request
end

--- The request that follows an answer which could not be used; nil and a message.
function Exchange:again(request, content, problems)
  local template = self.again_prompt.template
  local more, message = template:fill { problems = problems, answer = self.form }
  if not more then return nil, message end
  local messages = { unpack(request.messages) }
  messages[#messages + 1] = { role = "assistant",
    content = content:find "%S" and terminal.beginning(content, LONGEST_ECHO) or "(empty)" }
  for _, each in ipairs(more) do messages[#messages + 1] = each end
  return request_of(messages, request.schema, template)
end

return exchange
