--- exchange.lua: the messages that ask a model about a generation, made from history, prompt and
--- context, and their hash. A replay makes the same messages from the same history.

local context = require "limax.supervise.llm.context"
local failure = require "limax.base.failure"
local host = require "limax.host"
local prompt = require "limax.supervise.llm.prompt"
local shown = require "limax.supervise.shown"
local source = require "limax.base.source"
local text = require "limax.supervise.llm.text"

local exchange = {}

---@class limax.llm.exchange
---@field prompt limax.llm.prompt_file
---@field again_prompt limax.llm.prompt_file
local Exchange = {}
Exchange.__index = Exchange

-- Longest answer that is shown to a model again, bytes.
local LONGEST_ECHO = 4000

---@class limax.llm.request
---@field messages limax.llm.message[]
---@field schema table
---@field template_sha256 string
---@field messages_sha256 string of messages and schema
---@field tokens integer estimated
---@field detail integer|nil level of the context, 1 for all

--- The questions of an experiment, by its options `prompt`, `again`, `context` and
--- `context_tokens`. Raises where a prompt is missing or cannot be read.
function exchange.new(options, run)
  local folder = run.experiment.origin and source.folder_of(run.experiment.origin)
  local function open(name)
    local file, message = prompt.open(name, folder)
    if not file then failure.raise(2, "supervisor \"llm\": " .. message) end
    return file
  end
  local own = type(options.context) == "function" and options.context or nil
  local paper = options.context == "paper"
  return setmetatable({ run = run, own = own, name = paper and "paper" or "summary",
    tokens = options.context_tokens or (paper and math.huge or context.TOKENS),
    prompt = open(options.prompt or (paper and "paper.md" or "supervise.md")),
    -- a parser of the user's own expects a form of its own
    again_prompt = open(options.again or (options.parse and "again_own.md" or "again.md")),
  }, Exchange)
end

local function with_hash(request)
  request.messages_sha256 = host.sha256(host.json.encode {
    messages = request.messages, schema = request.schema })
  return request
end

-- What the user's own context function returns; nil and a message.
local function own_holes(call, history, limits)
  local ok, values = failure.attempt_user(call, shown.of(history), limits)
  if not ok then return nil, "the context function failed: " .. failure.bare(values) end
  if type(values) ~= "table" then
    return nil, "the context function returned no table of { hole = text or table }"
  end
  return values
end

--- The request for the generation after the last of `history`; nil and a message.
---@param tokens? number most estimated tokens, instead of the experiment's
function Exchange:first(history, tokens)
  local run, most = self.run, tokens or self.tokens
  local facts = { name = self.name, history = history, limits = run.world.limits,
    allowed = run.config.supervision, first = run.world.first_fields, config = run.config }
  local schema, message
  self.form, schema = context.answer(facts)
  local own = {}
  if self.own then
    own, message = own_holes(self.own, history, run.world.limits)
    if not own then return nil, message end
  end
  local messages, count, level
  for k, detail in ipairs(context.levels(self.name)) do
    local holes = context.holes(facts, detail)
    holes.answer = self.form
    for name, value in pairs(own) do holes[name] = value end
    messages, message = self.prompt.template:fill(holes)
    if not messages then return nil, message end
    count, level = context.tokens(messages), k
    if count <= most then break end
  end
  return with_hash { messages = messages, schema = schema, tokens = count, detail = level,
    template_sha256 = self.prompt.template.sha256 }
end

--- The request that follows an answer which could not be used; nil and a message.
---@param content string the answer
function Exchange:again(request, content, problems)
  local more, message =
    self.again_prompt.template:fill { problems = problems, answer = self.form }
  if not more then return nil, message end
  local messages = { unpack(request.messages) }
  messages[#messages + 1] = { role = "assistant",
    content = content:find "%S" and text.beginning(content, LONGEST_ECHO) or "(empty)" }
  for _, each in ipairs(more) do messages[#messages + 1] = each end
  return with_hash { messages = messages, schema = request.schema,
    tokens = context.tokens(messages), template_sha256 = self.again_prompt.template.sha256 }
end

return exchange
