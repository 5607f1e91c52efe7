--- exchange.lua: what a model is asked: the messages of a generation, from history, prompt and
--- context, and their hash. A pure function of these, so that a replay asks the same.

local answer = require "limax.supervise.llm.answer"
local context = require "limax.supervise.llm.context"
local failure = require "limax.base.failure"
local host = require "limax.host"
local prompt_file = require "limax.supervise.llm.prompt_file"
local source = require "limax.base.source"
local user_call = require "limax.base.user_call"

local exchange = {}

---@class limax.llm.exchange
---@field prompt limax.llm.prompt_file
---@field again_prompt limax.llm.prompt_file
local Exchange = {}
Exchange.__index = Exchange

-- Longest answer that is shown to a model once more, bytes.
local LONGEST_ECHO = 4000

---@class limax.llm.request
---@field messages limax.llm.message[]
---@field schema table
---@field template_sha256 string
---@field messages_sha256 string of messages and schema
---@field tokens integer estimated
---@field detail integer|nil level of the context, 1 for all

--- What to ask with: an experiment's options `prompt`, `again`, `context` and `context_tokens`.
--- Raises where a file is missing or cannot be read as a prompt.
---@param options table
---@param run limax.run
---@return limax.llm.exchange
function exchange.new(options, run)
  local folder = run.experiment.origin and source.folder_of(run.experiment.origin)
  local default = options.context == "paper" and "paper.md" or "supervise.md"
  local function open(name)
    local file, message = prompt_file.open(name, folder)
    if not file then failure.raise(2, "supervisor \"llm\": " .. message) end
    return file
  end
  local own = type(options.context) == "function" and options.context or nil
  -- whoever reads answers in a form of their own is not to be promised limax's
  local again = options.again or (options.parse and "again_own.md" or "again.md")
  local tokens = options.context_tokens
    or (options.context == "paper" and math.huge or context.TOKENS)
  return setmetatable({ run = run, own = own, tokens = tokens,
    name = own and "summary" or options.context or "summary",
    prompt = open(options.prompt or default), again_prompt = open(again) }, Exchange)
end

local function seal(request)
  request.messages_sha256 = host.sha256(host.json.encode {
    messages = request.messages, schema = request.schema })
  return request
end

--- The request for the generation after the last of `history`.
---@param history table[]
---@param tokens? number most estimated tokens, in the place of the experiment's
---@return limax.llm.request|nil
---@return string|nil message
function Exchange:first(history, tokens)
  local run, most = self.run, tokens or self.tokens
  local allowed = run.config.supervision
  local materials = history[#history].materials.materials
  self.form = answer.form(run.limits, allowed, materials)
  local schema = answer.schema(run.limits, allowed, materials)
  local given = { name = self.name, history = history, limits = run.limits, allowed = allowed,
    first = run.first_fields, form = self.form, config = run.config }

  local own = {}
  if self.own then
    local ok, values = user_call.attempt(self.own, history, run.limits)
    if not ok then return nil, "the context function failed: " .. failure.bare(values) end
    if type(values) ~= "table" then
      return nil, "the context function returned no table of { hole = text or table }"
    end
    own = values
  end
  local messages, message, count, level
  for k, detail in ipairs(context.levels(self.name)) do
    local holes = context.holes(given, detail)
    for name, value in pairs(own) do holes[name] = value end
    messages, message = self.prompt.template:fill(holes)
    if not messages then return nil, message end
    count, level = context.tokens(messages), k
    if count <= most then break end
  end
  return seal { messages = messages, schema = schema, tokens = count, detail = level,
    template_sha256 = self.prompt.template.sha256 }
end

-- The beginning of a text, whole letters of UTF-8.
local function beginning(text, longest)
  if #text <= longest then return text end
  while longest > 0 and text:byte(longest + 1) >= 0x80 and text:byte(longest + 1) < 0xc0 do
    longest = longest - 1
  end
  return text:sub(1, longest)
end

--- The request that follows an answer which could not be used.
---@param request limax.llm.request
---@param content string the answer
---@param problems string[]
---@return limax.llm.request|nil
---@return string|nil message
function Exchange:again(request, content, problems)
  local more, message =
    self.again_prompt.template:fill { problems = problems, answer = self.form }
  if not more then return nil, message end
  local messages = { unpack(request.messages) }
  messages[#messages + 1] = { role = "assistant",
    content = content:find "%S" and beginning(content, LONGEST_ECHO) or "(empty)" }
  for _, each in ipairs(more) do messages[#messages + 1] = each end
  return seal { messages = messages, schema = request.schema, tokens = context.tokens(messages),
    template_sha256 = self.again_prompt.template.sha256 }
end

return exchange
