--- client.lua: asks a language model over the chat completions protocol within a budget of
--- seconds: one layer of retries, a ladder of capabilities, a breaker, caps. What can go wrong ends
--- as nil and a failure with a class; only misuse and Ctrl-C raise.

local attempt = require "limax.supervise.llm.attempt"
local breaker = require "limax.supervise.llm.breaker"
local capabilities = require "limax.supervise.llm.capabilities"
local defaults = require "limax.settings.defaults"
local endpoint = require "limax.supervise.llm.endpoint"
local engine = require "limax.engine"
local envelope = require "limax.supervise.llm.envelope"
local host = require "limax.host"
local options_rules = require "limax.supervise.llm.options"
local retry = require "limax.supervise.llm.retry"
local spending = require "limax.supervise.llm.spending"
local tokens = require "limax.supervise.llm.tokens"

local client = {}

-- With less than this left no further attempt is begun: it could only fail.
local LEAST_ATTEMPT = 1 -- s
local PROBE = 5 -- s
local PROBE_TOKENS = 16 -- the least that some models take
local PROBE_MESSAGES = { { role = "user", content = "Answer with the word OK." } }

-- Failures that say nothing against the endpoint.
local ALIVE = { context = true, refusal = true, filter = true }

-- Not repeatable on purpose: clients that failed together should not come back together.
local function jitter()
  return tonumber(host.sha256(("%.9f"):format(host.clock())):sub(1, 8), 16) / 2 ^ 32
end

---@class limax.llm.client
---@field endpoint limax.llm.endpoint
---@field options table
---@field given table
---@field breaker limax.llm.breaker
---@field capabilities limax.llm.capabilities
---@field spending limax.llm.spending
---@field budget number s per generation
---@field timeout number s per attempt
local methods = {}
local class = { __index = methods }

---@class limax.llm.given what tests put in the place of the machine
---@field clock? fun(): number s, never steps back
---@field wait? fun(seconds: number)
---@field wall? fun(): number s since 1970
---@field http? fun(request: table): table|nil, string|nil, table|nil
---@field random? fun(): number from 0 to 1
---@field record? fun(attempt: table) called once for every attempt, before its text is parsed
---@field environment? fun(name: string): string|nil
---@field known? table<string, table> what was learnt of endpoints: clients that get the same table
--- share breaker and capabilities of an endpoint and model

-- Breaker and capabilities of an endpoint and model.
local function acquaintance(known, found, format)
  local name = table.concat({ found.shown, found.model, format or "" }, "\n")
  known[name] = known[name]
    or { breaker = breaker.new(), capabilities = capabilities.new(found.provider, format) }
  return known[name]
end

--- A client for the endpoint that options and environment name; nil and why there is none.
---@param options table as `options.rules` of limax.llm.options check them
---@param given? limax.llm.given
---@return limax.llm.client|nil
---@return string|nil message
function client.new(options, given)
  given = given or {}
  local conflict = options_rules.conflict(options)
  if conflict then return nil, conflict end
  local found, message = endpoint.find(options, given.environment)
  if not found then return nil, message end
  local where = found.loopback and "_loopback" or ""
  local fields = defaults.fields.llm
  local shared = acquaintance(given.known or {}, found, options.format)
  shared.breaker:begin()
  return setmetatable({
    endpoint = found, options = options,
    given = {
      clock = given.clock or host.clock, wait = given.wait or host.wait,
      wall = given.wall or os.time, http = given.http or host.http,
      random = given.random or jitter, record = given.record or function() end,
    },
    breaker = shared.breaker, capabilities = shared.capabilities,
    spending = spending.new(options),
    budget = options.budget or fields["budget" .. where].value,
    timeout = options.timeout or fields["timeout" .. where].value,
  }, class)
end

---@return { endpoint: string, model: string, provider: string, key: string|nil }
function methods:describe()
  local found = self.endpoint
  return { endpoint = found.redact(found.shown), model = found.redact(found.model),
    provider = found.provider, key = found.key_source }
end

--- A text without the key, in any form that redaction.lua knows.
---@param text string
---@return string
function methods:redact(text) return self.endpoint.redact(text) end

-- One attempt; counted before it is sent.
local function send(self, wish, timeout, number)
  local fields = self.capabilities:fields(wish)
  fields.model = self.endpoint.model
  local body, message = attempt.encode(fields, self.endpoint.redact)
  if not body then return { class = "request", headers = {}, message = message } end
  self.spending:count()
  local outcome = attempt.send { endpoint = self.endpoint, options = self.options,
    given = self.given, fields = fields, body = body, timeout = timeout, number = number,
    probe = wish.probe or false }
  local reply, refusal = outcome.reply, outcome.refusal
  if outcome.envelope and envelope.has_choice(outcome.envelope) then
    local text = reply and reply.content .. (reply.reasoning or "") or ""
    outcome.cost = self.spending:book(outcome.usage, outcome.prompt_tokens, tokens.of(text))
  end
  if refusal and outcome.class == "http" and (outcome.status == 400 or outcome.status == 422) then
    outcome.learnt = self.capabilities:learn(refusal, fields)
  end
  return outcome
end

local function answer_of(self, outcome)
  local reply, redact = outcome.reply, self.endpoint.redact
  local usage = outcome.usage
  local cut = tokens.cut(outcome.prompt_tokens, usage and usage.input_tokens)
  local answer = { usage = usage, cost = outcome.cost,
    truncated = cut or reply.finish_reason == "length",
    truncation = cut and "prompt" or reply.finish_reason == "length" and "answer" or nil }
  -- an escaped key shows only in the decoded text
  for _, name in ipairs { "content", "reasoning", "finish_reason", "model", "id" } do
    answer[name] = reply[name] and redact(reply[name])
  end
  return answer
end

local function failed(class_name, message, outcome)
  outcome = outcome or {}
  return { class = class_name, message = message, http_status = outcome.status,
    usage = outcome.usage, cost = outcome.cost }
end

local function no_time()
  return failed("budget", "no time is left in this generation's budget")
end

-- Seconds to wait before this failure is tried again; nil, and why where that is worth a word, if
-- it is not.
local function wait_for(self, outcome, count, timeouts, left)
  if not retry.wanted(outcome) then return nil end
  if count == retry.MOST then return nil, ("%d attempts failed"):format(count + 1) end
  if timeouts > retry.MOST_AFTER_TIMEOUT then return nil, "it came too late twice" end
  local seconds, reason = retry.wait(count + 1, outcome.headers, self.given.wall(),
    self.given.random())
  if not seconds then return nil, reason end
  if seconds + LEAST_ATTEMPT > left then return nil, "no time is left for another attempt" end
  return seconds
end

-- Attempts until one succeeds or none may follow; `number` of them were made before.
local function try(self, wish, deadline, number)
  local clock, retries, timeouts = self.given.clock, 0, 0
  while true do
    local left = deadline - clock()
    if left <= 0 then return nil, no_time(), number end
    local prompt = tokens.estimate(wish.messages)
    local refused = self.spending:refusal(prompt)
    if refused then return nil, failed("caps", refused), number end
    local outcome = send(self, wish, math.min(self.timeout, left), number + 1)
    if outcome.class == "request" then return nil, failed("request", outcome.message), number end
    number = number + 1
    if outcome.reply then return answer_of(self, outcome), nil, number end
    if outcome.kind == "timeout" then timeouts = timeouts + 1 end
    if not outcome.learnt then
      local seconds, reason = wait_for(self, outcome, retries, timeouts, deadline - clock())
      if not seconds then
        local message = outcome.message .. (reason and "; " .. reason or "")
        return nil, failed(outcome.class, message, outcome), number
      end
      retries = retries + 1
      self.given.wait(seconds)
    end
  end
end

-- One short request; nil where the endpoint answers, else the failure.
local function probe(self, left)
  local wish = { messages = PROBE_MESSAGES, max_tokens = PROBE_TOKENS, plain = true,
    probe = true }
  local refused = self.spending:refusal(tokens.estimate(wish.messages))
  if refused then return failed("caps", refused) end
  local outcome = send(self, wish, math.min(PROBE, self.timeout, left), 1)
  -- an answer without a text is one: all tokens may have gone into thinking
  local ran = outcome.envelope and envelope.has_choice(outcome.envelope)
  if ran or outcome.learnt or ALIVE[outcome.class] then return nil end
  return failed("breaker", "a probe found the endpoint failing: " .. outcome.message, outcome)
end

-- The messages of a caller, checked.
local function check_messages(messages)
  local fine = type(messages) == "table" and #messages > 0
  for _, message in ipairs(fine and messages or {}) do
    fine = fine and type(message) == "table" and type(message.role) == "string"
      and type(message.content) == "string"
  end
  if not fine then
    engine.fail "client:ask: expected a list of messages { role = , content = }, at least one"
  end
end

local function decide(self, messages, asked, deadline)
  local state, left = self.breaker:enter(asked.generation, self)
  if state == "open" then
    return nil, failed("breaker", ("the endpoint failed in %d generations; generations until it is"
      .. " probed: %d"):format(self.breaker.failures, left)), 0
  end
  local probed = 0
  if state == "probe" then
    local rest = deadline - self.given.clock()
    if rest <= 0 then return nil, no_time(), 0 end
    local failure = probe(self, rest)
    probed = 1
    if failure then
      if failure.class ~= "caps" then self.breaker:failed() end
      return nil, failure, failure.class == "caps" and 0 or probed
    end
  end
  local options = self.options
  local answer, failure, count = try(self, {
    messages = messages, schema = asked.schema, name = asked.name, plain = asked.plain,
    max_tokens = asked.max_tokens or options.max_tokens or defaults.fields.llm.max_tokens.value,
    temperature = options.temperature, seed = options.seed,
  }, deadline, probed)
  if answer or ALIVE[failure.class] then
    self.breaker:succeeded()
  elseif failure.class ~= "caps" and failure.class ~= "request" and count > probed then
    self.breaker:failed()
  end
  return answer, failure, count
end

---@class limax.llm.question
---@field schema? table JSON schema of the answer
---@field name? string of the schema
---@field budget? number s that this generation has left
---@field max_tokens? integer
---@field generation? integer to which this request belongs, for the breaker; without it, its own
---@field plain? boolean no form is asked of the answer

---@class limax.llm.answer
---@field content string
---@field reasoning string|nil
---@field finish_reason string|nil
---@field usage { input_tokens: integer, output_tokens: integer }|nil
---@field cost number|nil unknown where price or usage are
---@field model string|nil as the endpoint names it
---@field id string|nil
---@field attempts integer
---@field seconds number
---@field truncated boolean was the prompt or the answer cut?
---@field truncation "prompt"|"answer"|nil

---@class limax.llm.failure
---@field class "transport"|"timeout"|"http"|"quota"|"auth"|"envelope"|"budget"|"breaker"|"caps"|
---"refusal"|"filter"|"context"|"request"
---@field message string one line, without the key
---@field attempts integer
---@field seconds number
---@field http_status integer|nil
---@field usage { input_tokens: integer, output_tokens: integer }|nil where the model did run
---@field cost number|nil

--- Asks, and tries again where that makes sense, until the budget is used up.
---@param messages { role: string, content: string }[]
---@param asked? limax.llm.question
---@return limax.llm.answer|nil
---@return limax.llm.failure|nil
function methods:ask(messages, asked)
  check_messages(messages)
  asked = asked or {}
  local clock = self.given.clock
  local started = clock()
  local deadline = started + (asked.budget or self.budget)
  local answer, failure, attempts = decide(self, messages, asked, deadline)
  local result = answer or failure
  result.attempts, result.seconds = attempts, clock() - started
  return answer, failure
end

--- What has been used so far: calls, tokens, cost (null where it is unknown).
---@return table
function methods:totals() return self.spending:state() end

--- Breaker, capabilities and totals as plain values, for a checkpoint.
---@return table
function methods:state()
  return { endpoint = self:describe().endpoint, model = self:describe().model,
    breaker = self.breaker:state(), capabilities = self.capabilities:state(),
    totals = self.spending:state() }
end

--- Goes on where `state` was taken. What was learnt of another endpoint or model is left out.
---@param state table
function methods:restore(state)
  local here = self:describe()
  self.spending:restore(state.totals)
  if state.endpoint ~= here.endpoint or state.model ~= here.model then return end
  self.breaker:restore(state.breaker)
  self.capabilities:restore(state.capabilities)
end

return client
