--- client.lua: asks a language model over the chat completions protocol within a budget of
--- seconds: retries, smaller forms of the request, a breaker, caps. A failure is nil and a table
--- with a class; only misuse and Ctrl-C raise.

local attempt = require "limax.supervise.llm.attempt"
local defaults = require "limax.settings.defaults"
local endpoint = require "limax.supervise.llm.endpoint"
local engine = require "limax.engine"
local form = require "limax.supervise.llm.form"
local host = require "limax.host"
local options_rules = require "limax.supervise.llm.options"
local reply = require "limax.supervise.llm.reply"
local retry = require "limax.supervise.llm.retry"
local usage = require "limax.supervise.llm.usage"

local client = {}

-- With less time left no further attempt is begun: it could only fail.
local LEAST_ATTEMPT = 1 -- s
local PROBE = 5 -- s
local PROBE_TOKENS = 16 -- the least that some models accept
local PROBE_MESSAGES = { { role = "user", content = "Answer with the word OK." } }

-- Failures of a working endpoint.
local ALIVE = { context = true, refusal = true, filter = true }

-- Not repeatable on purpose: clients that failed together should not return together.
local function jitter()
  return tonumber(host.sha256(("%.9f"):format(host.clock())):sub(1, 8), 16) / 2 ^ 32
end

---@class limax.llm.client
---@field endpoint limax.llm.endpoint
---@field options table
---@field machine limax.llm.machine
---@field breaker limax.llm.breaker
---@field form limax.llm.form
---@field account limax.llm.account
---@field budget number s per generation
---@field timeout number s per attempt
local Client = {}
Client.__index = Client

---@class limax.llm.machine replaces parts of the machine in tests
---@field clock? fun(): number s, never steps back
---@field wait? fun(seconds: number)
---@field wall? fun(): number s since 1970
---@field http? fun(request: table): table|nil, string|nil, table|nil
---@field random? fun(): number from 0 to 1
---@field record? fun(attempt: table) called once for every attempt, before its text is parsed
---@field environment? fun(name: string): string|nil
---@field endpoints? table<string, table> clients with the same table share what they learn of an
--- endpoint and model

--- A client for the endpoint that options and environment name; nil and a message where there is
--- none.
---@param options table as `options.rules` of limax.llm.options check them
---@param machine? limax.llm.machine
---@return limax.llm.client|nil
---@return string|nil message
function client.new(options, machine)
  machine = machine or {}
  local conflict = options_rules.conflict(options)
  if conflict then return nil, conflict end
  local found, message = endpoint.find(options, machine.environment)
  if not found then return nil, message end
  local endpoints = machine.endpoints or {}
  local name = table.concat({ found.shown, found.model, options.format or "" }, "\n")
  endpoints[name] = endpoints[name]
    or { breaker = retry.breaker(), form = form.new(found.provider, options.format) }
  endpoints[name].breaker:begin()
  local where, fields = found.loopback and "_loopback" or "", defaults.fields.llm
  return setmetatable({
    endpoint = found, options = options,
    machine = {
      clock = machine.clock or host.clock, wait = machine.wait or host.wait,
      wall = machine.wall or os.time, http = machine.http or host.http,
      random = machine.random or jitter, record = machine.record or function() end,
    },
    breaker = endpoints[name].breaker, form = endpoints[name].form,
    account = usage.account(options),
    budget = options.budget or fields["budget" .. where].value,
    timeout = options.timeout or fields["timeout" .. where].value,
  }, Client)
end

---@return { endpoint: string, model: string, provider: string, key: string|nil }
function Client:describe()
  local found = self.endpoint
  return { endpoint = found.redact(found.shown), model = found.redact(found.model),
    provider = found.provider, key = found.key_source }
end

-- One attempt.
local function send(self, wish, timeout, number)
  local fields = self.form:fields(wish)
  fields.model = self.endpoint.model
  local body, message = attempt.encode(fields, self.endpoint.redact)
  if not body then return { class = "request", headers = {}, message = message } end
  self.account:count()
  local outcome = attempt.send { endpoint = self.endpoint, options = self.options,
    machine = self.machine, fields = fields, body = body, timeout = timeout, number = number,
    probe = wish.probe or false }
  local answer, refusal = outcome.reply, outcome.refusal
  if outcome.decoded and reply.has_choice(outcome.decoded) then
    local written = answer and answer.content .. (answer.reasoning or "") or ""
    outcome.cost = self.account:add(outcome.usage, outcome.prompt_tokens, usage.tokens(written))
  end
  if refusal and outcome.class == "http" and (outcome.status == 400 or outcome.status == 422) then
    outcome.learnt = self.form:learn(refusal, fields)
  end
  return outcome
end

local function answer_of(self, outcome)
  local read, used = outcome.reply, outcome.usage
  local truncation = usage.is_cut(outcome.prompt_tokens, used and used.input_tokens) and "prompt"
    or read.finish_reason == "length" and "answer" or nil
  local answer = { usage = used, cost = outcome.cost, truncated = truncation ~= nil,
    truncation = truncation }
  -- a key in escapes shows only in the decoded text
  for _, name in ipairs { "content", "reasoning", "finish_reason", "model", "id" } do
    answer[name] = read[name] and self.endpoint.redact(read[name])
  end
  return answer
end

local function failed(class, message, outcome)
  outcome = outcome or {}
  return { class = class, message = message, http_status = outcome.status, usage = outcome.usage,
    cost = outcome.cost }
end

local function no_time()
  return failed("budget", "no time is left in this generation's budget")
end

-- Seconds to wait before a failed attempt is repeated; nil where it is not, and perhaps a reason.
local function wait_for(self, outcome, retries, timeouts, left)
  if not retry.wanted(outcome) then return nil end
  if retries == retry.MOST then return nil, ("%d attempts failed"):format(retries + 1) end
  if timeouts > retry.MOST_AFTER_TIMEOUT then return nil, "two attempts timed out" end
  local seconds, reason = retry.wait(retries + 1, outcome.headers, self.machine.wall(),
    self.machine.random())
  if not seconds then return nil, reason end
  if seconds + LEAST_ATTEMPT > left then return nil, "no time is left for another attempt" end
  return seconds
end

-- Attempts until one succeeds or none may follow; `number` of them were made before. Returns
-- answer, failure and the number of attempts.
local function try(self, wish, deadline, number)
  local clock, retries, timeouts = self.machine.clock, 0, 0
  while true do
    local left = deadline - clock()
    if left <= 0 then return nil, no_time(), number end
    local refused = self.account:refusal(usage.prompt_tokens(wish.messages))
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
      self.machine.wait(seconds)
    end
  end
end

-- One short request; nil where the endpoint answers, else the failure.
local function probe(self, left)
  if left <= 0 then return no_time() end
  local wish = { messages = PROBE_MESSAGES, max_tokens = PROBE_TOKENS, plain = true,
    probe = true }
  local refused = self.account:refusal(usage.prompt_tokens(wish.messages))
  if refused then return failed("caps", refused) end
  local outcome = send(self, wish, math.min(PROBE, self.timeout, left), 1)
  -- an answer without a text counts: all tokens may have been used for reasoning
  local ran = outcome.decoded and reply.has_choice(outcome.decoded)
  if ran or outcome.learnt or ALIVE[outcome.class] then return nil end
  return failed("breaker", "a probe found the endpoint failing: " .. outcome.message, outcome)
end

local function check_messages(messages)
  local valid = type(messages) == "table" and #messages > 0
  for _, message in ipairs(valid and messages or {}) do
    valid = valid and type(message) == "table" and type(message.role) == "string"
      and type(message.content) == "string"
  end
  if not valid then
    engine.fail "client:ask: expected a list of messages { role = , content = }, at least one"
  end
end

-- Asks unless the breaker is open. Returns answer, failure and the number of attempts.
local function ask(self, messages, question, deadline)
  local state, left = self.breaker:enter(question.generation, self)
  if state == "open" then
    return nil, failed("breaker", ("the endpoint failed in %d generations; generations until it is"
      .. " probed: %d"):format(self.breaker.values.failures, left)), 0
  end
  local probed = 0
  if state == "probe" then
    local failure = probe(self, deadline - self.machine.clock())
    if failure and failure.class == "breaker" then self.breaker:failed() end
    if failure then return nil, failure, failure.class == "breaker" and 1 or 0 end
    probed = 1
  end
  local options = self.options
  local answer, failure, count = try(self, {
    messages = messages, schema = question.schema, name = question.name, plain = question.plain,
    max_tokens = question.max_tokens or options.max_tokens or defaults.fields.llm.max_tokens.value,
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
---@field generation? integer to which this question belongs, for the breaker; without it, its own
---@field plain? boolean the answer may have any form

---@class limax.llm.answer
---@field content string
---@field reasoning string|nil
---@field finish_reason string|nil
---@field usage { input_tokens: integer, output_tokens: integer }|nil
---@field cost number|nil nil where price or usage are unknown
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

--- Asks, and retries where that can help, until the budget is used up.
---@param messages { role: string, content: string }[]
---@param question? limax.llm.question
---@return limax.llm.answer|nil
---@return limax.llm.failure|nil
function Client:ask(messages, question)
  check_messages(messages)
  question = question or {}
  local started = self.machine.clock()
  local answer, failure, attempts =
    ask(self, messages, question, started + (question.budget or self.budget))
  local result = answer or failure
  result.attempts, result.seconds = attempts, self.machine.clock() - started
  return answer, failure
end

--- Calls, tokens and cost so far.
---@return limax.llm.totals
function Client:totals() return self.account:state() end

--- Breaker, accepted fields and totals as plain values, for a checkpoint.
---@return table
function Client:state()
  local about = self:describe()
  return { endpoint = about.endpoint, model = about.model, breaker = self.breaker:state(),
    capabilities = self.form:state(), totals = self.account:state() }
end

--- Continues from a checkpoint. What was learnt of another endpoint or model is left out.
function Client:restore(state)
  local about = self:describe()
  self.account:restore(state.totals)
  if state.endpoint ~= about.endpoint or state.model ~= about.model then return end
  self.breaker:restore(state.breaker)
  self.form:restore(state.capabilities)
end

return client
