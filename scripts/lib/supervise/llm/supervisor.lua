--- supervisor.lua: a repetition that a language model supervises. Before each generation it asks
--- the model, asks once more with its mistake, then asks the fallback, and else changes nothing.
--- Every decision is a line of the transcript, from which a resumed run can repeat it.

local client = require "limax.supervise.llm.client"
local defaults = require "limax.settings.defaults"
local exchange = require "limax.supervise.llm.exchange"
local failure = require "limax.base.failure"
local host = require "limax.host"
local parse = require "limax.supervise.llm.parse"
local source = require "limax.base.source"
local terminal = require "limax.base.terminal"
local transcript = require "limax.supervise.llm.transcript"
local usage = require "limax.supervise.llm.usage"

local supervisor = {}

---@class limax.llm.session
local Session = { name = "llm" }
Session.__index = Session

local function raise(message) failure.raise(2, 'supervisor "llm"' .. message) end

--- Begins the supervision of a repetition. Raises if there is no endpoint or prompt, or a parser
--- that cannot be used.
---@param options table checked options of the supervisor
---@param fallback limax.supervisor|nil replaces a model without a usable answer; nil: keep
function supervisor.start(run, options, fallback)
  local experiment = run.experiment
  local parser, message =
    parse.from(options.parse, experiment.origin and source.folder_of(experiment.origin))
  if not parser then raise(": " .. message) end
  local self = setmetatable({ run = run, options = options, fallback = fallback, parser = parser,
    exchange = exchange.new(options, run) }, Session)
  local unfit = fallback and fallback.unfit and fallback.unfit(run.config)
  if unfit then raise((".fallback: %s"):format(unfit)) end
  local client_options = source.copy(options)
  -- a schema of limax's form would exclude the form of the user's own parser
  client_options.format = options.format or (options.parse and "plain" or nil)
  -- shared by the repetitions: a dead endpoint costs its budgets once
  experiment.breaker = experiment.breaker or { failures = 0 }
  self.client, message = (options.client or client.new)(client_options,
    { breaker = experiment.breaker, record = function(attempt) self:record(attempt) end })
  if not self.client then raise(": " .. tostring(message)) end
  return self
end

-- The run folder exists when the first generation ends.
function Session:open()
  self.transcript = transcript.open(self.run.folder)
  local newest
  for generation = 1, #self.run.history - 1 do
    newest = self.transcript:outcome(self.run.repetition, generation) or newest
  end
  if not newest then return end
  if newest.client then self.client:restore(newest.client) end
  local ask, now = newest.asks[1], self.exchange.prompt.template
  if ask and ask.template_sha256 ~= now.sha256 then
    self.run:say(("%s has changed since generation %d; the run continues with the new version")
      :format(now.name, newest.generation))
  end
end

-- Called by the client for each attempt, before its answer is read.
function Session:record(attempt)
  local line, note = source.copy(attempt), self.notes[#self.notes]
  line.raw_body = line.raw_body and terminal.utf8(line.raw_body)
  line.endpoint, line.parser_sha256 = self.client:describe().endpoint, self.parser.sha256
  line.ask, line.template_sha256, line.messages_sha256 = note.purpose, note.template_sha256,
    note.messages_sha256
  self.attempts = self.attempts + 1
  line.attempt = self.attempts
  self.transcript:write("attempt", self.run.repetition, self.generation, line)
end

-- The recorded outcome of this generation if it answers the same question: a run that was stopped
-- after the answer came does not ask again.
function Session:recorded(step)
  local line = self.transcript:outcome(self.run.repetition, step.generation)
  if not line or not line.asks[1] then return line end
  local request = self.exchange:first(step.history)
  return request and request.messages_sha256 == line.asks[1].messages_sha256 and line or nil
end

-- The proposal in an answer, or nil; and its problems. `useful` is whether a field can be used.
function Session:read(answer)
  local content = answer.content or ""
  local parsed, message = self.parser:read(content:find "%S" and content or answer.reasoning or "",
    self.run.world.limits)
  if not parsed then return nil, { message } end
  local _, _, record = self.judge(parsed.proposal, nil, { supervisor = "llm" })
  local problems = {}
  for _, entry in ipairs(record.entries) do
    if entry.outcome == "rejected" then
      problems[#problems + 1] = ("%s: %s"):format(entry.field, entry.reason)
    elseif entry.outcome ~= "kept" then
      parsed.useful = true
    end
  end
  return parsed, problems
end

-- Asks the client once. Returns what `read` finds in the answer, the note for the outcome line, and
-- the answer.
function Session:ask(purpose, request)
  local note = { purpose = purpose, messages_sha256 = request.messages_sha256,
    template_sha256 = request.template_sha256, estimated_tokens = request.tokens,
    detail = request.detail }
  self.notes[#self.notes + 1] = note
  local began = host.clock()
  local answer, problem = self.client:ask(request.messages, { schema = request.schema,
    name = "proposal", budget = self.deadline - began, generation = self.generation })
  note.seconds, note.attempts = host.clock() - began, (answer or problem).attempts
  if not answer then
    note.http_status, note.failure = problem.http_status, problem.class
    note.message = terminal.line(problem.message, 400)
    return nil, nil, note
  end
  -- a client of the experiment's own may pass on what an endpoint reports
  local used = answer.usage or {}
  note.finish_reason, note.input_tokens, note.output_tokens = answer.finish_reason,
    usage.count(used.input_tokens), usage.count(used.output_tokens)
  if usage.is_cut(request.tokens, note.input_tokens) then
    self.run:say(("the endpoint read only %d tokens of a prompt of about %d: it cuts prompts; give"
      .. " its model a longer context, or lower context_tokens"):format(note.input_tokens,
      request.tokens), "cut prompt")
  end
  local parsed, problems = self:read(answer)
  note.problems = host.json.array(source.copy(problems))
  return parsed, problems, note, answer
end

-- The model's proposal; or nil, why there is no usable one, and the unusable one.
function Session:consult(history)
  local request, message = self.exchange:first(history)
  if not request then return nil, message end
  local first, problems, note, answer = self:ask("first", request)
  -- too long for the model: once more with half of it
  if note.failure == "context" then
    local shorter = self.exchange:first(history, math.floor(request.tokens / 2))
    if shorter and shorter.messages_sha256 ~= request.messages_sha256 then
      request = shorter
      first, problems, note, answer = self:ask("shrunk", request)
    end
  end
  if not answer then return nil, ("%s: %s"):format(note.failure, note.message) end
  if #problems == 0 then return first end
  local second, left
  local again = self.exchange:again(request, answer.content or "", problems)
  if again then second, left = self:ask("again", again) end
  if second and (second.useful or #left == 0) then return second end
  if first and first.useful then return first end
  return nil, "no usable answer: " .. (left or problems)[1], second or first
end

-- The outcome without a usable answer: the fallback's proposal, which may fail too. Without one the
-- ledger shows how the model's fields were rejected.
function Session:fall_back(step, why, rejected)
  local fallback = self.fallback
  if fallback then
    local ok, proposal, reason = failure.attempt_user(function()
      local proposal, reason = fallback.call(step.history, step.random, step.limits)
      host.json.encode { proposal } -- raises an error if it cannot be recorded
      return type(proposal) == "table" and proposal or nil, reason
    end)
    if ok then
      reason = type(reason) == "string" and "; " .. terminal.line(reason, 200) or ""
      return { source = fallback.name, why = why, proposal = proposal,
        reason = ("%s instead: %s%s"):format(fallback.name, why, reason) }
    end
    if failure.of_machine(proposal) then error(proposal, 0) end
    why, rejected = ("%s; the fallback %s failed: %s"):format(why, fallback.name,
      terminal.line(failure.bare(proposal), 200)), nil
  end
  return { source = "keep", why = why, reason = "kept: " .. why,
    proposal = rejected and rejected.proposal }
end

-- The outcome of this generation: source, proposal, reason.
function Session:decide_now(step)
  local every = self.options.ask_every
  if (step.generation - 1) % every ~= 0 then
    return { source = "held", reason = ("the model is asked every %d generations"):format(every) }
  end
  local ok, parsed, why, rejected = failure.attempt(self.consult, self, step.history)
  if not ok then
    if failure.of_machine(parsed) then error(parsed, 0) end
    -- most likely a client of the experiment's own
    why, rejected = "asking failed: " .. terminal.line(failure.bare(parsed), 200), nil
  elseif parsed then
    return { source = "model", proposal = parsed.proposal,
      reason = parsed.reason and "model: " .. parsed.reason or "model" }
  end
  local line = self:fall_back(step, why, rejected)
  -- printed once per cause; causes that differ only in a number are one. The failure that opened
  -- the breaker has reported it.
  if not why:find "^breaker: " then
    self.run:say(("before generation %d the model was not used: %s"):format(step.generation,
      line.why), "not used: " .. line.why:gsub("%d+", "#"))
  end
  return line
end

-- Reads live prompts again and keeps each version.
function Session:refresh_prompts()
  for _, file in ipairs { self.exchange.prompt, self.exchange.again_prompt } do
    local message = self.run.live_prompts and file:refresh()
    if message then self.run:say("the prompt before stays in use: " .. message) end
    message = file:keep(self.run.folder)
    if message then self.run:say("a prompt could not be kept: " .. message) end
  end
end

--- Decides about a generation: parameters, fields of materials, the record for the ledger, and
--- numbers for timing.jsonl.
function Session:decide(step)
  if not self.transcript then self:open() end
  self.generation, self.judge = step.generation, step.judge
  self.notes, self.attempts = {}, 0
  local began = host.clock()
  self.deadline = began + (self.options.budget or self.client.budget
    or defaults.fields.llm.budget.value)
  self:refresh_prompts()
  local recorded = self:recorded(step)
  if recorded then
    if recorded.client then self.client:restore(recorded.client) end
    return supervisor.apply(recorded, step.judge)
  end
  local line = self:decide_now(step)
  line.supervisor, line.asks, line.client = "llm", host.json.array(self.notes), self.client:state()
  local parameters, fields, record, numbers = supervisor.apply(line, step.judge)
  line.fields, line.seconds = record.entries, host.clock() - began
  self.transcript:write("outcome", self.run.repetition, step.generation, line)
  numbers.model_seconds, numbers.asks = 0, #self.notes
  for _, note in ipairs(self.notes) do
    numbers.model_seconds = numbers.model_seconds + (note.seconds or 0)
    for _, name in ipairs { "attempts", "input_tokens", "output_tokens" } do
      if type(note[name]) == "number" then numbers[name] = (numbers[name] or 0) + note[name] end
    end
  end
  return parameters, fields, record, numbers
end

--- Applies an outcome line to a generation, as `Session:decide`.
function supervisor.apply(line, judge)
  local parameters, fields, record =
    judge(line.proposal, line.reason, { supervisor = line.supervisor, source = line.source })
  return parameters, fields, record,
    { fallen_back = line.source ~= "model" and line.source ~= "held" }
end

return supervisor
