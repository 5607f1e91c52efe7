--- client.lua: asks a language model over the chat completions protocol within a budget of
--- seconds: retries, a simpler form of a refused request, a breaker, caps. A failure is nil and a
--- table with a class.

local attempt = require "limax.supervise.llm.attempt"
local defaults = require "limax.settings.defaults"
local endpoint = require "limax.supervise.llm.endpoint"
local fault = require "limax.engine.fault"
local host = require "limax.host"
local source = require "limax.base.source"
local usage = require "limax.supervise.llm.usage"

local client = {}

---@class limax.llm.client
---@field budget number s per generation
---@field timeout number s per attempt
---@field failed_in integer|nil the generation that failed last
local Client = {}
Client.__index = Client

--- A client for the endpoint that options and environment name; nil and a message if there is
--- none. `machine` may replace clock, wait, http and environment; its `record` is called for every
--- attempt, before its text is parsed; clients with the same `breaker` count failures together.
---@param options table as `options` of limax.supervise.llm check them
---@param machine? { clock?: fun(): number, wait?: fun(seconds: number), http?: function,
--- environment?: fun(name: string): string|nil, record?: fun(attempt: table),
--- breaker?: { failures: integer } }
function client.new(options, machine)
  machine = machine or {}
  local found, message = endpoint.find(options, machine.environment)
  if not found then return nil, message end
  local where, fields = found.loopback and "_loopback" or "", defaults.fields.llm
  return setmetatable({
    endpoint = found, options = options,
    spent = { calls = 0, input_tokens = 0, output_tokens = 0 },
    machine = { clock = machine.clock or host.clock, wait = machine.wait or host.wait,
      http = machine.http or host.http, record = machine.record or function() end,
      breaker = machine.breaker or { failures = 0 } },
    budget = options.budget or fields["budget" .. where].value,
    timeout = options.timeout or fields["timeout" .. where].value,
  }, Client)
end

local RETRIES = 2 -- after the first attempt
local FIRST_WAIT = 0.5 -- s before the first retry; it doubles
local LEAST_ATTEMPT = 1 -- s; with less time left an attempt could only fail

-- Statuses, with 500 and above, and kinds of failure of host.http. A certificate, an encoding or a
-- size would fail again.
local REPEATED = { [408] = true, [409] = true, [429] = true, resolve = true, connect = true,
  connect_timeout = true, timeout = true, reset = true, partial = true, tls = true }
local FINAL = { quota = true, context = true, envelope = true }

-- One attempt of at most `timeout` seconds, unless a cap forbids it.
local function send(self, messages, format, question, timeout)
  local prompt, spent = usage.estimate(messages), self.spent
  local refused = usage.refusal(self.options, spent, prompt)
  if refused then return { class = "caps", message = refused } end
  if timeout <= 0 then
    return { class = "budget", message = "no time is left in this generation's budget" }
  end
  local outcome = attempt.send(self, messages, format, question, timeout)
  spent.calls = spent.calls + 1
  local read = outcome.reply
  if read then
    -- without a usage estimates count
    local used = read.usage or { input_tokens = prompt,
      output_tokens = usage.estimate { read, { content = read.reasoning or "" } } }
    spent.input_tokens = spent.input_tokens + used.input_tokens
    spent.output_tokens = spent.output_tokens + used.output_tokens
  end
  return outcome
end

-- Seconds to wait before a failed attempt is repeated; nil if it is not, and perhaps why. `left` is
-- the rest of the budget in seconds.
local function wait_after(outcome, retries, left)
  local repeated = REPEATED[outcome.kind or outcome.status]
    or not outcome.kind and outcome.status >= 500
  if not repeated or FINAL[outcome.class] then return nil end
  if retries == RETRIES then return nil, ("%d attempts failed"):format(RETRIES + 1) end
  -- dates, and numbers that only Lua reads ("0x10", "nan"), are not valid waits
  local asked = (outcome.headers["retry-after"] or ""):match "^%s*(%d+%.?%d*)%s*$"
  local seconds = tonumber(asked) or FIRST_WAIT * 2 ^ retries
  if seconds + LEAST_ATTEMPT > left then
    return nil, ("no time is left to wait %.3g s and try again"):format(seconds)
  end
  return seconds
end

-- Attempts until one succeeds or none may follow. Returns answer, failure and the number of
-- attempts.
local function try(self, messages, question, deadline)
  local machine, format = self.machine, self.options.format or "json_schema"
  local attempts, retries = 0, 0
  while true do
    local left = deadline - machine.clock()
    local outcome = send(self, messages, format, question, math.min(self.timeout, left))
    local failure = { class = outcome.class, message = outcome.message,
      http_status = outcome.status }
    if not outcome.headers then return nil, failure, attempts end
    attempts = attempts + 1
    if not outcome.class then
      outcome.reply.format = format
      return outcome.reply, nil, attempts
    elseif outcome.form_refused then
      format = "plain"
    else
      local seconds, reason = wait_after(outcome, retries, deadline - machine.clock())
      if reason then failure.message = failure.message .. "; " .. reason end
      if not seconds then return nil, failure, attempts end
      retries = retries + 1
      machine.wait(seconds)
    end
  end
end

-- After so many failed generations in a row an endpoint is not asked again.
local PATIENCE = 3

-- Failures of a working endpoint.
local ALIVE = { context = true, refusal = true, filter = true }

-- Counts a failed generation for the breaker, several failures in one once. The message of the last
-- one states that no other is asked.
local function count(self, failure, attempts, generation)
  local breaker = self.machine.breaker
  if not failure or ALIVE[failure.class] then
    breaker.failures = 0
  elseif attempts > 0 and failure.class ~= "caps"
    and not (generation and generation == self.failed_in) then
    self.failed_in, breaker.failures = generation, breaker.failures + 1
    if breaker.failures == PATIENCE then
      failure.message = ("the endpoint failed in %d generations in a row and is not asked again in"
        .. " this run: %s"):format(PATIENCE, failure.message)
    end
  end
end

---@class limax.llm.answer: limax.llm.reply
---@field format "json_schema"|"json_object"|"plain" what the endpoint accepted
---@field attempts integer
---@field seconds number

---@class limax.llm.failure
---@field class string see README.md
---@field message string one line, without the key
---@field attempts integer
---@field seconds number
---@field http_status integer|nil

--- Asks, and retries where that can help, until the budget is used up. A question may have the JSON
--- schema of its answer and its name, the seconds that its generation has left, and the number of
--- that generation, for the breaker; without a number it is a generation of its own.
---@param question? { schema?: table, name?: string, budget?: number, generation?: integer }
---@return limax.llm.answer|nil
---@return limax.llm.failure|nil
function Client:ask(messages, question)
  question = question or {}
  local started, attempts = self.machine.clock(), 0
  local answer, failure
  if self.machine.breaker.failures >= PATIENCE then
    failure = { class = "breaker", message = "the endpoint is not asked again in this run" }
  else
    answer, failure, attempts =
      try(self, messages, question, started + (question.budget or self.budget))
    count(self, failure, attempts, question.generation)
  end
  local result = answer or failure
  result.attempts, result.seconds = attempts, self.machine.clock() - started
  return answer, failure
end

function Client:describe()
  local found = self.endpoint
  return { endpoint = found.shown, model = found.model, provider = found.provider,
    key = found.key_source }
end

--- Requests and tokens so far, with which a resumed run continues. The breaker is left out: a
--- resumed run asks an endpoint again that failed before.
function Client:state() return { totals = source.copy(self.spent) } end

--- Continues from the state of another client, which a transcript has.
function Client:restore(state)
  local totals = type(state.totals) == "table" and state.totals or {}
  for name in pairs(self.spent) do
    local number = totals[name]
    if not (type(number) == "number" and number >= 0 and number < math.huge) then
      fault.raise(("transcript.jsonl: client.totals.%s: expected a number from 0"):format(name))
    end
    self.spent[name] = number
  end
end

return client
