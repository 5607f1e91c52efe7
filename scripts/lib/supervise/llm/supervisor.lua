--- supervisor.lua: a repetition that a language model supervises. Before each generation it asks
--- the model, asks once more with what was wrong, then the fallback, and else changes nothing.
--- Every decision is a line of the transcript, from which a resumed run can repeat it.

local client = require "limax.supervise.llm.client"
local defaults = require "limax.settings.defaults"
local duration = require "limax.base.duration"
local exchange = require "limax.supervise.llm.exchange"
local failure = require "limax.base.failure"
local host = require "limax.host"
local parse = require "limax.supervise.llm.parse"
local source = require "limax.base.source"
local terminal = require "limax.base.terminal"
local text = require "limax.supervise.llm.text"
local transcript = require "limax.supervise.llm.transcript"
local usage = require "limax.supervise.llm.usage"

local supervisor = {}

---@class limax.llm.session
---@field client table client.lua, or the experiment's own
---@field name string
local Session = { name = "llm" }
Session.__index = Session

-- After so many equal answers in a row a message is printed.
local UNCHANGED = 5

local function raise(message) failure.raise(2, 'supervisor "llm"' .. message) end

--- Begins the supervision of a repetition. Raises on what is wrong before it runs: no endpoint, no
--- prompt, a parser that cannot be used.
---@param options table checked options of the supervisor
---@param fallback limax.supervisor|nil replaces a model without a usable answer; nil: keep
function supervisor.start(run, options, fallback)
  local self = setmetatable({ run = run, options = options, fallback = fallback, unchanged = 0 },
    Session)
  local folder = run.experiment.origin and source.folder_of(run.experiment.origin)
  local parser, message = parse.from(options.parse, folder)
  if not parser then raise(": " .. message) end
  self.parser = parser
  self.exchange = exchange.new(options, run)
  local unfit = fallback and fallback.unfit and fallback.unfit(run.config)
  if unfit then raise((".fallback: %s"):format(unfit)) end
  -- a schema of limax's form would exclude the form of the user's own parser
  local client_options = source.copy(options)
  client_options.format = options.format or (options.parse and "plain" or nil)
  -- shared by the repetitions: a dead endpoint costs its budgets once
  local experiment = run.experiment
  experiment.endpoints = experiment.endpoints or {}
  self.client, message = (options.client or client.new)(client_options,
    { endpoints = experiment.endpoints, record = function(attempt) self:record(attempt) end })
  if not self.client then raise(": " .. tostring(message)) end
  return self
end

-- ---- the transcript -----------------------------------------------------------------------------

-- The run folder exists when the first generation ends.
function Session:open()
  if self.transcript then return end
  self.transcript = transcript.open(self.run.folder)
  local recorded, outcome = self.transcript.recorded, nil
  -- the state after the newest generation on disk
  for generation = #self.run.history - 1, 1, -1 do
    outcome = outcome or recorded and recorded:outcome(self.run.repetition, generation)
  end
  if not outcome then return end
  self:resume_from(outcome)
  local ask, now = outcome.asks[1], self.exchange.prompt.template
  if ask and ask.template_sha256 ~= now.sha256 then
    self.run:say(("%s has changed since generation %d; the run continues with the new version")
      :format(now.name, outcome.generation))
  end
end

function Session:resume_from(outcome)
  if outcome.client then self.client:restore(outcome.client) end
  self.unchanged, self.answered = outcome.unchanged or 0, true
  self.same = outcome.answer_sha256
end

-- Called by the client for each attempt, before its answer is read.
function Session:record(attempt)
  local line, asking = source.copy(attempt), self.asking
  line.raw_body = line.raw_body and terminal.utf8(line.raw_body)
  line.endpoint = self.client:describe().endpoint
  line.ask, line.template_sha256 = asking.purpose, asking.template_sha256
  line.messages_sha256, line.parser_sha256 = asking.messages_sha256, self.parser.sha256
  self.transcript:attempt(self.run.repetition, self.generation, line)
end

-- ---- asking -------------------------------------------------------------------------------------

-- Asks the client once. Returns its answer or nil, and the note for the outcome line.
function Session:ask(purpose, request)
  local note = { purpose = purpose, messages_sha256 = request.messages_sha256,
    template_sha256 = request.template_sha256, estimated_tokens = request.tokens,
    detail = request.detail }
  self.notes[#self.notes + 1], self.asking = note, note
  local began = host.clock()
  local answer, problem = self.client:ask(request.messages, { schema = request.schema,
    name = "proposal", budget = self.deadline - began, generation = self.generation })
  note.seconds = host.clock() - began
  if not answer then
    note.attempts, note.http_status = problem.attempts, problem.http_status
    note.failure, note.message = problem.class, text.line(problem.message, 300)
    return nil, note
  end
  note.attempts, note.finish_reason = answer.attempts, answer.finish_reason
  note.truncation = answer.truncation
  -- a client of the experiment's own may pass on what an endpoint reports
  local used = answer.usage or {}
  note.input_tokens, note.output_tokens = usage.count(used.input_tokens),
    usage.count(used.output_tokens)
  note.cost = answer.cost
  return answer, note
end

-- What is wrong with the fields of a proposal, and whether any of them can be used.
local function problems_of(record)
  local problems, useful = {}, false
  for _, entry in ipairs(record.entries) do
    if entry.outcome == "rejected" then
      problems[#problems + 1] = ("%s: %s"):format(entry.field, entry.reason)
    elseif entry.outcome ~= "kept" then
      useful = true
    end
  end
  return problems, useful or #problems == 0
end

-- The proposal in an answer, or nil; and its problems.
function Session:read(answer, note)
  local content = answer.content or ""
  local thought = not content:find "%S" and answer.reasoning
  local parsed, message = self.parser:read(thought or content, self.run.world.limits)
  if not parsed then
    note.stage, note.problems = "none", host.json.array { message }
    return nil, { message }
  end
  note.stage = thought and "reasoning" or parsed.stage
  local _, _, record = self.judge(parsed.proposal, nil, { supervisor = "llm" })
  local problems, useful = problems_of(record)
  note.problems = host.json.array(problems)
  parsed.useful = useful
  return parsed, problems
end

-- The model's proposal; or nil, why there is no usable one, and the unusable one.
function Session:consult(history)
  local request, message = self.exchange:first(history)
  if not request then return nil, message end
  local answer, note = self:ask("first", request)
  -- too long for the model, or cut by its server: once more with half of it
  local cut = answer and answer.truncation == "prompt" and not self:read(answer, note)
  if note.failure == "context" or cut then
    local shorter = self.exchange:first(history, math.floor(request.tokens / 2))
    if shorter and shorter.messages_sha256 ~= request.messages_sha256 then
      request = shorter
      answer, note = self:ask("shrunk", request)
    end
  end
  if not answer then return nil, ("%s: %s"):format(note.failure, note.message) end

  local first, problems = self:read(answer, note)
  if #problems == 0 then return first end
  local second
  local second_request = self.exchange:again(request, answer.content or "", problems)
  if second_request then
    local again, again_note = self:ask("again", second_request)
    local left
    if again then second, left = self:read(again, again_note) end
    if second and second.useful then return second end
    problems = left or problems
  end
  if first and first.useful then return first end
  return nil, "no usable answer: " .. problems[1], second or first
end

-- ---- deciding -----------------------------------------------------------------------------------

local function kept(why, proposal)
  return { source = "keep", why = why, reason = "kept: " .. why, proposal = proposal }
end

-- The fallback's proposal and reason; raises an error if they cannot be recorded.
local function propose_instead(fallback, step)
  local proposal, reason = fallback.call(step.history, step.random, step.limits)
  if type(proposal) ~= "table" then proposal = nil end
  host.json.encode { proposal }
  return proposal, type(reason) == "string" and "; " .. text.line(reason, 200) or ""
end

-- The outcome without a usable answer: the fallback's proposal, which may fail too. Without one the
-- ledger shows how the model's fields were rejected.
function Session:fall_back(step, why, rejected)
  local fallback = self.fallback
  if not fallback then return kept(why, rejected and rejected.proposal) end
  local ok, proposal, reason = failure.attempt_user(propose_instead, fallback, step)
  if not ok then
    if failure.of_machine(proposal) then error(proposal, 0) end
    return kept(("%s; the fallback %s failed: %s"):format(why, fallback.name,
      text.line(failure.bare(proposal), 200)))
  end
  return { source = fallback.name, why = why, proposal = proposal,
    reason = ("%s instead: %s%s"):format(fallback.name, why, reason) }
end

-- Counts equal answers in a row.
function Session:compare(proposal)
  local sha256 = host.sha256(host.json.encode(proposal))
  self.unchanged = sha256 == self.same and self.unchanged + 1 or 1
  self.same = sha256
  if self.unchanged == UNCHANGED then
    self.run:say(("the model gave the same answer %d times in a row"):format(UNCHANGED))
  end
end

-- Estimates the time of all answers, once in an experiment.
function Session:project()
  local experiment = self.run.experiment
  if self.answered or experiment.projected then return end
  experiment.projected = true
  local config = self.run.config
  local answers = math.ceil((config.generations - 1) / self.options.ask_every)
  local seconds, repetitions = self:sum "seconds", config.repetitions
  local each = seconds * answers
  local all = repetitions > 1
    and (", %s for %d repetitions"):format(duration(each * repetitions), repetitions) or ""
  self.run:say(("the model answered in %.1f s: about %s for the %d answers of a repetition%s")
    :format(seconds, duration(each), answers, all))
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
    parsed, why, rejected = nil, "asking failed: " .. text.line(failure.bare(parsed), 200), nil
  end
  if not parsed then return self:fall_back(step, why, rejected) end
  self:compare(parsed.proposal)
  self:project()
  return { source = "model", proposal = parsed.proposal,
    reason = parsed.reason and "model: " .. parsed.reason or "model" }
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

-- Sum of a field over the notes of a generation; nil where no note has it.
function Session:sum(field)
  local total
  for _, note in ipairs(self.notes) do
    if type(note[field]) == "number" then total = (total or 0) + note[field] end
  end
  return total
end

--- Decides about a generation.
---@return table parameters
---@return table fields of materials
---@return table record for the ledger
---@return table numbers for timing.jsonl
function Session:decide(step)
  self:open()
  self.generation, self.judge = step.generation, step.judge
  self.notes = {}
  local began = host.clock()
  self.deadline = began + (self.options.budget or self.client.budget
    or defaults.fields.llm.budget.value)
  self:refresh_prompts()

  local recorded = self:recorded(step)
  if recorded then
    self:resume_from(recorded)
    local parameters, fields, record = supervisor.apply(recorded, step.judge)
    return parameters, fields, record, { fallen_back = supervisor.is_fallback(recorded.source) }
  end
  local line = self:decide_now(step)
  line.supervisor, line.asks = "llm", host.json.array(self.notes)
  line.unchanged, line.answer_sha256, line.client = self.unchanged, self.same, self.client:state()
  local parameters, fields, record = supervisor.apply(line, step.judge)
  line.fields, line.seconds = record.entries, host.clock() - began
  self.transcript:outcome(self.run.repetition, step.generation, line)
  -- printed once per cause; causes that differ only in a number are one
  if line.why then
    self.run:say(("before generation %d the model was not used: %s"):format(step.generation,
      line.why), "not used: " .. line.why:gsub("%d+", "#"))
  end
  return parameters, fields, record, { model_seconds = self:sum "seconds" or 0, asks = #self.notes,
    attempts = self:sum "attempts", input_tokens = self:sum "input_tokens",
    output_tokens = self:sum "output_tokens", cost = self:sum "cost",
    fallen_back = supervisor.is_fallback(line.source) }
end

-- The recorded outcome of this generation, if it asked what would be asked now: a run that was
-- stopped after the answer came does not ask again.
function Session:recorded(step)
  local recorded = self.transcript.recorded
  local line = recorded and recorded:outcome(self.run.repetition, step.generation)
  if not line then return nil end
  local first = line.asks[1]
  if not first then return line end
  local request = self.exchange:first(step.history)
  return request and request.messages_sha256 == first.messages_sha256 and line or nil
end

--- Was a generation decided without the model because the model could not?
---@param outcome_source string `source` of an outcome
function supervisor.is_fallback(outcome_source)
  return outcome_source ~= "model" and outcome_source ~= "held"
end

--- Applies an outcome line to a generation.
---@return table parameters
---@return table fields
---@return table record
function supervisor.apply(line, judge)
  return judge(line.proposal, line.reason, { supervisor = line.supervisor, source = line.source })
end

return supervisor
