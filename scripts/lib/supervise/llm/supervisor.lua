--- supervisor.lua: a repetition that a language model supervises. Before each generation: the
--- model, once more with what was wrong, the fallback, and else nothing changes. No way through
--- here ends the run, and every way ends with a line in the transcript from which it can be gone
--- again.

local defaults = require "limax.settings.defaults"
local exchange = require "limax.supervise.llm.exchange"
local failure = require "limax.base.failure"
local host = require "limax.host"
local parse = require "limax.supervise.llm.parse"
local progress = require "limax.tools.console.progress"
local source = require "limax.base.source"
local transcript = require "limax.supervise.llm.transcript"
local user_call = require "limax.base.user_call"

local supervisor = {}

---@class limax.llm.session
---@field client table client.lua, or what takes its place
---@field name string
local Session = { name = "llm" }
Session.__index = Session

-- Equal answers in a row after which a user is told, once.
local UNCHANGED = 5

--- Begins the supervision of a repetition. Raises on what can be known to be wrong before it runs:
--- no endpoint, no prompt, a parser that cannot stand alone.
---@param run limax.run
---@param options table checked options of the supervisor
---@return limax.llm.session
function supervisor.start(run, options)
  local self = setmetatable({ run = run, options = options, unchanged = 0 }, Session)
  local folder = run.experiment.origin and source.folder_of(run.experiment.origin)
  local parser, message = parse.from(options.parse, folder)
  if not parser then failure.raise(2, "supervisor \"llm\": " .. message) end
  self.parser = parser
  self.exchange = exchange.new(options, run)
  self.limits_text = host.json.encode(run.limits)
  -- asked for here: a supervisor may be the fallback of another
  local fallback = options.fallback or "keep"
  if fallback ~= "keep" then
    self.fallback = require("limax.supervise").get(fallback)
    local unfit = self.fallback.unfit and self.fallback.unfit(run.config)
    if unfit then failure.raise(2, ('supervisor "llm".fallback: %s'):format(unfit)) end
  end
  -- an endpoint that holds a model to limax's form never lets it answer in another
  local asked = {}
  for name, value in pairs(options) do asked[name] = value end
  asked.format = options.format or (options.parse and "plain" or nil)
  local make = options.client or require("limax.supervise.llm.client").new
  -- a dead endpoint costs its budgets once, not in each repetition again
  local experiment = run.experiment
  experiment.endpoints = experiment.endpoints or {}
  self.client, message = make(asked, { known = experiment.endpoints,
    record = function(attempt) self:record(attempt) end })
  if not self.client then failure.raise(2, "supervisor \"llm\": " .. tostring(message)) end
  return self
end

-- ---- the transcript -----------------------------------------------------------------------------

-- The folder is there when the first generation ends.
function Session:open()
  if self.transcript then return end
  self.transcript = transcript.open(self.run.folder)
  local recorded = self.transcript.recorded
  if not recorded then return end
  -- where the breaker and the totals stood after the newest generation that is on disk
  for generation = #self.run.history - 1, 1, -1 do
    local outcome = recorded:outcome(self.run.repetition, generation)
    if outcome then
      self:resume_from(outcome)
      self:compare_prompts(outcome)
      return
    end
  end
end

function Session:resume_from(outcome)
  if outcome.client then self.client:restore(outcome.client) end
  self.unchanged, self.answered = outcome.unchanged or 0, true
  self.same = outcome.answer_sha256
end

-- Says so where a resumed run goes on with another prompt.
function Session:compare_prompts(outcome)
  local ask, now = outcome.asks[1], self.exchange.prompt.template
  if ask and ask.template_sha256 ~= now.sha256 then
    self.run:say(("%s has changed since generation %d; going on with it as it is now")
      :format(now.name, outcome.generation))
  end
end

-- Bytes above 127 of a body that is no UTF-8 become question marks.
local function as_text(body)
  if body == nil or pcall(host.json.encode, body) then return body end
  return (body:gsub("[\128-\255]", "?"))
end

-- Hears each attempt of the client before its answer is looked at.
function Session:record(attempt)
  local line, now = {}, self.asking
  for key, value in pairs(attempt) do line[key] = value end
  line.raw_body = as_text(line.raw_body)
  line.endpoint = self.client:describe().endpoint
  line.ask, line.template_sha256 = now.purpose, now.request.template_sha256
  line.messages_sha256, line.parser_sha256 = now.request.messages_sha256, self.parser.sha256
  self.transcript:attempt(self.run.repetition, self.generation, line)
end

-- ---- asking -------------------------------------------------------------------------------------

-- Asks the client once. Returns its answer, or nil and why; `note` is what the outcome line tells.
function Session:ask(purpose, request)
  local note = { purpose = purpose, messages_sha256 = request.messages_sha256,
    template_sha256 = request.template_sha256, estimated_tokens = request.tokens,
    detail = request.detail }
  self.notes[#self.notes + 1] = note
  self.asking = { purpose = purpose, request = request }
  local began = host.clock()
  local answer, problem = self.client:ask(request.messages, { schema = request.schema,
    name = "proposal", budget = self.deadline - began, generation = self.generation,
    max_tokens = self.options.max_tokens })
  note.seconds = host.clock() - began
  self.model_seconds = self.model_seconds + note.seconds
  if not answer then
    note.attempts, note.http_status = problem.attempts, problem.http_status
    note.failure, note.message = problem.class, parse.clean(problem.message, 300)
    return nil, note
  end
  note.attempts, note.finish_reason = answer.attempts, answer.finish_reason
  note.truncation = answer.truncation
  local usage = answer.usage or {}
  note.input_tokens, note.output_tokens = usage.input_tokens, usage.output_tokens
  note.cost = answer.cost
  return answer, note
end

-- What is wrong with the fields of a proposal, and whether anything of it can be used.
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

-- Makes a proposal of an answer: what it is, or nil, and its problems.
function Session:read(answer, note)
  local content = answer.content or ""
  local thought = not content:find "%S" and answer.reasoning
  local parsed, message = self.parser:read(thought or content, self.limits_text)
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

-- The model's proposal: nil and why where there is none that can be used, and what there is.
function Session:consult(history)
  local request, message = self.exchange:first(history)
  if not request then return nil, message end
  local answer, note = self:ask("first", request)
  -- too long for the model, or cut by its server without a word: shorter, once
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

-- A proposal that JSON can hold, so that a replay judges the same.
local function recordable(value, depth)
  if type(value) == "number" and (value ~= value or math.abs(value) == math.huge) then
    return tostring(value)
  end
  if type(value) == "string" then return parse.clean(value, 300) end
  if type(value) == "number" or type(value) == "boolean" then return value end
  if type(value) ~= "table" or depth == 0 then return "a " .. type(value) end
  local copy = {}
  for key, entry in next, value do
    copy[type(key) == "string" and parse.clean(key, 60) or ("[%s]"):format(type(key))] =
      recordable(entry, depth - 1)
  end
  return copy
end

-- Another supervisor in the model's place, which may fail too. Where there is none, the ledger
-- shows how the model's fields were rejected.
function Session:fall_back(given, why, rejected)
  if not self.fallback then
    return { source = "keep", why = why, reason = "kept: " .. why,
      proposal = rejected and rejected.proposal }
  end
  local name = self.fallback.name
  local ok, proposal, reason =
    user_call.attempt(self.fallback.call, given.history, given.random, given.limits)
  if not ok then
    if failure.of_machine(proposal) then error(proposal, 0) end
    why = ("%s; the fallback %s failed: %s"):format(why, name,
      parse.clean(failure.bare(proposal), 200))
    return { source = "keep", why = why, reason = "kept: " .. why }
  end
  local said = type(reason) == "string" and "; " .. parse.clean(reason, 200) or ""
  return { source = name, why = why, proposal = type(proposal) == "table"
    and recordable(proposal, 3) or nil, reason = ("%s instead: %s%s"):format(name, why, said) }
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

-- The waiting that is to come, told once in an experiment.
function Session:project()
  local experiment = self.run.experiment
  if self.answered or experiment.told_of_waiting then return end
  experiment.told_of_waiting = true
  local config = self.run.config
  local answers = math.ceil((config.generations - 1) / self.options.ask_every)
  local each, repetitions = self.model_seconds * answers, config.repetitions
  local all = repetitions > 1
    and (", %s for %d repetitions"):format(progress.duration(each * repetitions), repetitions) or ""
  self.run:say(("the model answered in %.1f s: about %s for the %d answers of a repetition%s")
    :format(self.model_seconds, progress.duration(each), answers, all))
end

function Session:decide_now(given)
  local every = self.options.ask_every
  if (given.generation - 1) % every ~= 0 then
    -- what was decided before holds on
    return { source = "held", reason = ("the model is asked every %d generations"):format(every) }
  end
  if not self.transcript:flush() then
    return self:fall_back(given, "the transcript cannot be written: " .. self.transcript.problem)
  end
  local ok, parsed, why, rejected = failure.attempt(self.consult, self, given.history)
  if not ok then
    if failure.of_machine(parsed) then error(parsed, 0) end
    -- a client of the experiment's own, most likely
    why, rejected = "asking failed: " .. parse.clean(failure.bare(parsed), 200), nil
    parsed = nil
  end
  if self.transcript.problem then
    return self:fall_back(given, "the transcript cannot be written: " .. self.transcript.problem)
  end
  if not parsed then return self:fall_back(given, why, rejected) end
  self:compare(parsed.proposal)
  self:project()
  return { source = "model", proposal = parsed.proposal,
    reason = parsed.reason and "model: " .. parsed.reason or "model" }
end

-- Prompts as they are now, each version kept.
function Session:refresh_prompts()
  for _, file in ipairs { self.exchange.prompt, self.exchange.again_prompt } do
    local message
    if self.run.live_prompts then message = file:refresh() end
    if message then self.run:say("the prompt before stays in use: " .. message) end
    message = file:keep(self.run.folder)
    if message then self.run:say("a prompt could not be kept: " .. message) end
  end
end

local function sum(notes, field)
  local total
  for _, note in ipairs(notes) do
    if type(note[field]) == "number" then total = (total or 0) + note[field] end
  end
  return total
end

--- Decides about a generation. Returns what the ledger says (parameters, material fields, record)
--- and numbers for timing.jsonl.
---@param given limax.supervision.given
---@return table parameters
---@return table fields
---@return table record
---@return table numbers
function Session:decide(given)
  self:open()
  self.generation, self.judge = given.generation, given.judge
  self.notes, self.model_seconds = {}, 0
  local began = host.clock()
  self.deadline = began + (self.options.budget or self.client.budget
    or defaults.fields.llm.budget.value)
  self:refresh_prompts()

  local before = self:recorded(given)
  if before then
    self:resume_from(before)
    local parameters, fields, record = supervisor.apply(before, given.judge)
    return parameters, fields, record, {}
  end

  local outcome = self:decide_now(given)
  local line = { supervisor = "llm", asks = host.json.array(self.notes), source = outcome.source,
    why = outcome.why, proposal = outcome.proposal, reason = outcome.reason,
    unchanged = self.unchanged, answer_sha256 = self.same, client = self.client:state() }
  local parameters, fields, record = supervisor.apply(line, given.judge)
  line.fields = record.entries
  line.seconds = host.clock() - began
  local run = self.run
  if not self.transcript:outcome(run.repetition, given.generation, line) then
    local why = "the transcript cannot be written: " .. self.transcript.problem
    run:say(("before generation %d %s; the model's answers are not used until it can")
      :format(given.generation, why), why)
    if outcome.source == "model" then
      -- what is not recorded is not used: this line takes the other's place
      line.source, line.why, line.proposal, line.reason = "keep", why, nil, "kept: " .. why
      parameters, fields, record = supervisor.apply(line, given.judge)
      line.fields = record.entries
      self.transcript:replace_waiting(line)
    end
  end
  -- once for each cause: those that differ in a number, of generations left or seconds, are one
  if line.why then run:say(("before generation %d the model was not used: %s")
    :format(given.generation, line.why), "not used: " .. line.why:gsub("%d+", "#")) end
  return parameters, fields, record, { model_seconds = self.model_seconds,
    asks = #self.notes, attempts = sum(self.notes, "attempts"),
    input_tokens = sum(self.notes, "input_tokens"),
    output_tokens = sum(self.notes, "output_tokens"), cost = sum(self.notes, "cost"),
    fallen_back = supervisor.is_fallback(line.source) }
end

--- Was a generation set by somebody else, or nobody, because the model could not?
---@param who string `source` of an outcome
---@return boolean
function supervisor.is_fallback(who) return who ~= "model" and who ~= "held" end

--- What an outcome line does to a generation.
---@param line table
---@param judge function
---@return table parameters
---@return table fields
---@return table record
function supervisor.apply(line, judge)
  return judge(line.proposal, line.reason, { supervisor = line.supervisor, source = line.source })
end

-- What the transcript holds of this generation, if it began as it would begin now: a run that was
-- stopped after the answer came does not ask again.
function Session:recorded(given)
  local recorded = self.transcript.recorded
  local line = recorded and recorded:outcome(self.run.repetition, given.generation)
  if not line then return nil end
  local first = line.asks[1]
  if not first then return line end
  local request = self.exchange:first(given.history)
  return request and request.messages_sha256 == first.messages_sha256 and line or nil
end

return supervisor
