--- supervision.lua: the step between two generations of a run: it asks the experiment's supervisor,
--- and judges its proposal (proposals.lua). A supervisor that fails costs a generation's change,
--- never the run.

local engine = require "limax.engine"
local failure = require "limax.base.failure"
local proposals = require "limax.supervise.proposals"
local schema = require "limax.engine.schema"
local shown = require "limax.supervise.shown"

local supervision = {}

---@class limax.supervision.step what a supervisor with state between generations gets
---@field generation integer that is to be bred
---@field history limax.generation[]
---@field random table
---@field limits limax.limit[]
---@field judge fun(proposal: any, reason: any, about: { supervisor: string, source?: string }):
--- table, table, table as `proposals.judge`

-- Judges a proposal for the generation after `robots`.
local function judge(run, robots, proposal, reason, about)
  local materials = {}
  for i = 1, robots.materials.count do materials[i] = robots.materials:get(i) end
  local cost = function(fields)
    local candidate = run.world:materials_with(fields)
    local bound = run.world:bound(candidate)
    candidate:free()
    return bound
  end
  return proposals.judge { proposal = proposal, reason = reason, supervisor = about.supervisor,
    source = about.source, limits = run.world.limits, parameters = robots.parameters,
    materials = materials, first = run.world.first_fields, allowed = run.world.config.supervision,
    cost = cost, first_step = run.world.first_step }
end

-- Asks a supervisor that is a function of history.
local function ask(run, robots, generation, random)
  local supervisor = run.world.experiment.supervisor
  local attempt, history = failure.attempt, run.history
  -- a rank that runs ahead has no history yet
  if supervisor.by_generation then history = { { generation = robots.generation } } end
  if supervisor.own then
    run.shown = run.shown or {}
    attempt, history = failure.attempt_user, shown.of(run.history, run.shown)
  end
  local ok, proposal, reason = attempt(supervisor.call, history, random, run.world.limits,
    rawget(robots, "state"))
  local message
  if not ok then
    if failure.of_machine(proposal) then error(proposal, 0) end
    message = "the supervisor failed: " .. failure.bare(proposal)
  elseif proposal ~= nil and type(proposal) ~= "table" then
    message = ("the supervisor returned %s, expected a table"):format(schema.show(proposal))
  end
  if message then
    run.world.say(("before generation %d %s; parameters stay"):format(generation, message), message)
    proposal, reason = nil, message
  end
  local parameters, fields, record =
    judge(run, robots, proposal, reason, { supervisor = supervisor.name })
  return parameters, fields, record, message ~= nil
end

-- Warns once a field about values of a user's own supervisor that are beyond the range.
local function warn_of_range(world, entry)
  for _, limit in ipairs(world.limits) do
    local value = limit.field == entry.field and entry.proposed
    if type(value) == "number" and (value < limit.minimum or value > limit.maximum) then
      world.say(("the supervisor's %s = %.6g is beyond the range of %.6g to %.6g; it became %.6g")
        :format(entry.field, value, limit.minimum, limit.maximum, entry.applied), entry.field)
    end
  end
end

---@class limax.supervision.decided
---@field parameters table<string, number>
---@field fields limax.material_fields
---@field ledger table
---@field numbers table for timing.jsonl
---@field failed boolean|nil did the supervisor fail, so that its fallback decided or nothing
--- changed?
---@field state table|nil as the supervisor left it

--- Decides about the generation after `robots`.
function supervision.decide(run, robots)
  local generation, world = robots.generation + 1, run.world
  local random = engine.random(world.config.seed, world.repetition, "supervision", generation, 0)
  local parameters, fields, record, numbers, failed
  if run.session then
    parameters, fields, record, numbers = run.session:decide { generation = generation,
      history = run.history, random = random, limits = world.limits,
      judge = function(...) return judge(run, robots, ...) end }
    failed = numbers.fallen_back
  else
    parameters, fields, record, failed = ask(run, robots, generation, random)
  end
  -- otherwise a misspelt field would show only in the ledger
  for _, entry in ipairs(record.entries) do
    if entry.outcome == "rejected" then
      local message = ("the supervisor's %s was rejected: %s"):format(entry.field, entry.reason)
      world.say(("before generation %d %s"):format(generation, message), message)
    elseif world.experiment.supervisor.own then
      warn_of_range(world, entry)
    end
  end
  local shares = proposals.shares(record)
  for name, value in pairs(numbers or {}) do shares[name] = value end
  return { parameters = parameters, fields = fields, ledger = record, numbers = shares,
    failed = failed, state = rawget(robots, "state") }
end

--- Counts the generations whose supervisor failed: how many of how many that it was asked for.
---@param lines table[] of a repetition in metrics.jsonl, or entries of its history
---@param source_of fun(k: integer): string|nil the source in line k of its ledger
function supervision.failures(lines, source_of)
  local failed, asked = 0, #lines - 1 -- generation 0 needs no supervisor
  for k, line in ipairs(lines) do
    failed = failed + (line.supervisor_failed and 1 or 0)
    asked = asked - (source_of(k) == "held" and 1 or 0)
  end
  return failed, asked
end

--- Explains these counts; nil if none failed.
function supervision.failure_text(failed, asked)
  if failed == 0 then return nil end
  if failed < asked then
    return ("the supervisor failed in %d of %d generations, which its fallback decided or which"
      .. " kept their parameters; ledger.jsonl has the reasons"):format(failed, asked)
  end
  return ("THE SUPERVISOR FAILED IN EVERY GENERATION (%d of %d): its fallback decided, or without"
    .. ' one no parameter was changed, as by supervisor = "fixed"; ledger.jsonl has the reasons')
    :format(failed, asked)
end

-- A warning about a user's supervisor that proposed nothing in any generation and gave no reason;
-- nil for others.
local function idle_text(supervisor, history)
  if not supervisor.own or #history < 2 then return nil end
  for k = #history, 2, -1 do -- generation 0 needs no supervisor
    local record = history[k].ledger
    if record.reason then return nil end
    for _, entry in ipairs(record.entries) do
      if entry.outcome ~= "kept" then return nil end
    end
  end
  return ("the supervisor proposed nothing in all %d generations that it was asked about, as by"
    .. ' supervisor = "fixed": is a `return` missing? To mean it, return nil and a reason')
    :format(#history - 1)
end

--- A warning at the end of a run that the supervisor failed, or proposed nothing; nil if neither.
function supervision.end_text(supervisor, history)
  for _, entry in ipairs(history) do
    -- ledgers of old entries are on disk: they are read only where a supervisor failed
    if entry.supervisor_failed then
      return supervision.failure_text(supervision.failures(history,
        function(k) return history[k].ledger.source end))
    end
  end
  return idle_text(supervisor, history)
end

return supervision
