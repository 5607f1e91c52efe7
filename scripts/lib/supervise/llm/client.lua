--- client.lua: asks a language model over the chat completions protocol within a budget of
--- seconds: retries, smaller forms of the request, a breaker, caps. A failure is nil and a table
--- with a class; only Ctrl-C raises.

local attempt = require "limax.supervise.llm.attempt"
local defaults = require "limax.settings.defaults"
local endpoint = require "limax.supervise.llm.endpoint"
local form = require "limax.supervise.llm.form"
local host = require "limax.host"
local reply = require "limax.supervise.llm.reply"
local retry = require "limax.supervise.llm.retry"
local source = require "limax.base.source"
local usage = require "limax.supervise.llm.usage"

local client = {}

-- The breaker's short request, and its seconds. Some models accept no fewer tokens.
local PROBE = { messages = { { role = "user", content = "Answer with the word OK." } },
  max_tokens = 16, plain = true, probe = true }
local PROBE_TIME = 5

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
---@field shared { breaker: limax.llm.breaker, form: limax.llm.form } by clients of this endpoint
--- and model
---@field own { totals: limax.llm.totals, generation: integer|nil } of this client; the newest
--- generation
---@field budget number s per generation
---@field timeout number s per attempt
local Client = {}
Client.__index = Client

---@class limax.llm.machine replaces parts of the machine in tests
---@field clock? fun(): number s, never steps back
---@field wait? fun(seconds: number)
---@field http? fun(request: table): table|nil, string|nil, table|nil
---@field random? fun(): number from 0 to 1
---@field record? fun(attempt: table) called once for every attempt, before its text is parsed
---@field environment? fun(name: string): string|nil
---@field endpoints? table<string, table> clients with the same table share what they learn of an
--- endpoint and model

--- A client for the endpoint that options and environment name; nil and a message where there is
--- none.
---@param options table as `options` of limax.supervise.llm check them
---@param machine? limax.llm.machine
---@return limax.llm.client|nil
---@return string|nil message
function client.new(options, machine)
  machine = machine or {}
  if options.max_cost and not options.price then
    return nil, "max_cost needs price = { input = , output = }, per 1e6 tokens: without it the"
      .. " cost is unknown"
  end
  local found, message = endpoint.find(options, machine.environment)
  if not found then return nil, message end
  local endpoints = machine.endpoints or {}
  local name = table.concat({ found.shown, found.model, options.format or "" }, "\n")
  endpoints[name] = endpoints[name]
    or { breaker = retry.breaker(), form = form.new(found.provider, options.format) }
  retry.begin(endpoints[name].breaker)
  local where, fields = found.loopback and "_loopback" or "", defaults.fields.llm
  return setmetatable({
    endpoint = found, options = options, shared = endpoints[name],
    own = { totals = usage.totals(options.price) },
    machine = {
      clock = machine.clock or host.clock, wait = machine.wait or host.wait,
      http = machine.http or host.http, random = machine.random or jitter,
      record = machine.record or function() end,
    },
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

-- One attempt of at most `timeout` seconds; an outcome that is not `sent` left no trace.
local function send(self, wish, timeout, number)
  if timeout <= 0 then
    return { class = "budget", message = "no time is left in this generation's budget" }
  end
  local options, totals = self.options, self.own.totals
  local refused = usage.refusal(options, totals, usage.prompt_tokens(wish.messages))
  if refused then return { class = "caps", message = refused } end
  local fields = form.fields(self.shared.form, wish)
  fields.model = self.endpoint.model
  local body, message = attempt.encode(fields, self.endpoint.redact)
  if not body then return { class = "request", message = message } end
  totals.calls = totals.calls + 1
  local outcome = attempt.send(self, { fields = fields, body = body, timeout = timeout,
    number = number, probe = wish.probe or false })
  outcome.sent, outcome.prompt_tokens = true, usage.prompt_tokens(fields.messages)
  local answer, refusal = outcome.reply, outcome.refusal
  outcome.model_ran = outcome.decoded and reply.has_choice(outcome.decoded)
  if outcome.model_ran then
    local written = answer and answer.content .. (answer.reasoning or "") or ""
    outcome.cost = usage.add(totals, options.price, outcome.usage, outcome.prompt_tokens,
      usage.tokens(written))
  end
  if refusal and outcome.class == "http" and (outcome.status == 400 or outcome.status == 422) then
    outcome.learnt = form.learn(self.shared.form, refusal, fields)
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

local function failed(outcome, class, message)
  return { class = class or outcome.class, message = message or outcome.message,
    http_status = outcome.status, usage = outcome.usage, cost = outcome.cost }
end

-- Attempts until one succeeds or none may follow; `number` of them were made before. Returns
-- answer, failure and the number of attempts.
local function try(self, wish, deadline, number)
  local machine, made = self.machine, { retries = 0, timeouts = 0 }
  while true do
    local outcome = send(self, wish, math.min(self.timeout, deadline - machine.clock()), number + 1)
    if not outcome.sent then return nil, failed(outcome), number end
    number = number + 1
    if outcome.reply then return answer_of(self, outcome), nil, number end
    if outcome.kind == "timeout" then made.timeouts = made.timeouts + 1 end
    if not outcome.learnt then
      local seconds, reason = retry.wait(outcome, made, deadline - machine.clock(),
        machine.random())
      if not seconds then
        local message = outcome.message .. (reason and "; " .. reason or "")
        return nil, failed(outcome, nil, message), number
      end
      made.retries = made.retries + 1
      machine.wait(seconds)
    end
  end
end

-- Generations since the last question of this client, 0 in the same one. A client that serves
-- several repetitions begins again at 0; questions without a number are generations of their own.
local function generations_passed(self, generation)
  local last = self.own.generation
  self.own.generation = generation
  if generation and generation == last then return 0 end
  return math.max(generation and last and generation - last or 1, 1)
end

-- Asks unless the breaker is open. Returns answer, failure and the number of attempts.
local function ask(self, messages, question, deadline)
  local breaker, options, probed = self.shared.breaker, self.options, 0
  local state, left = retry.enter(breaker, generations_passed(self, question.generation))
  if state == "open" then
    return nil, failed({}, "breaker", ("the endpoint failed in %d generations; generations until it"
      .. " is probed: %d"):format(breaker.failures, left)), 0
  elseif state == "probe" then
    local outcome = send(self, PROBE,
      math.min(PROBE_TIME, self.timeout, deadline - self.machine.clock()), 1)
    if not outcome.sent then return nil, failed(outcome), 0 end
    -- an answer without a text counts: all tokens may have been used for reasoning
    if not (outcome.model_ran or outcome.learnt or ALIVE[outcome.class]) then
      retry.failed(breaker)
      return nil, failed(outcome, "breaker",
        "a probe found the endpoint failing: " .. outcome.message), 1
    end
    probed = 1
  end
  local answer, failure, count = try(self, {
    messages = messages, schema = question.schema, name = question.name,
    max_tokens = options.max_tokens or defaults.fields.llm.max_tokens.value,
    temperature = options.temperature, seed = options.seed,
  }, deadline, probed)
  if answer or ALIVE[failure.class] then
    retry.succeeded(breaker)
  elseif failure.class ~= "caps" and failure.class ~= "request" and count > probed then
    retry.failed(breaker)
  end
  return answer, failure, count
end

---@class limax.llm.question
---@field schema? table JSON schema of the answer
---@field name? string of the schema
---@field budget? number s that this generation has left
---@field generation? integer to which this question belongs, for the breaker; without it, its own

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
function Client:totals() return source.copy(self.own.totals) end

--- Breaker, accepted fields and totals as plain values, for a checkpoint.
---@return table
function Client:state()
  local about, breaker = self:describe(), source.copy(self.shared.breaker)
  breaker.generation = self.own.generation
  return { endpoint = about.endpoint, model = about.model, breaker = breaker,
    capabilities = source.copy(self.shared.form), totals = self:totals() }
end

--- Continues from a checkpoint. What was learnt of another endpoint or model is left out.
function Client:restore(state)
  local about = self:describe()
  self.own.totals = source.copy(state.totals)
  if state.endpoint ~= about.endpoint or state.model ~= about.model then return end
  self.shared.breaker, self.shared.form = source.copy(state.breaker),
    source.copy(state.capabilities)
  self.own.generation = state.breaker.generation
end

return client
