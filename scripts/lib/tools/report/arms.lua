--- arms.lua: groups runs into arms, by configuration without seed and repetition. Arms differ in
--- their methods of search; their question and budget must be the same, else they cannot be
--- compared.

local changes = require "limax.run.changes"
local choice = require "limax.base.choice"
local failure = require "limax.base.failure"
local flat = require "limax.base.flat"
local schema = require "limax.engine.schema"
local search = require "limax.tools.report.search"
local source = require "limax.base.source"

local arms = {}

-- Fields in which the runs of an arm may differ.
local ASIDE = { seed = true, repetitions = true, run = true, name = true, schema = true,
  not_in_paper = true, record = true, evaluations = true }

-- Fields that must be equal in all runs: the question (fitness, world, body, time) and the budget.
local QUESTION = { fitness = true, lattice = true, materials = true, scene = true,
  population = true, generations = true }
-- of `simulation` everything except what a tier sets: the outcome is simulated again at one tier
local OF_TIER = { accuracy = true, integrator = true, precision = true, time_step = true,
  bound = true, bound_fraction = true, time_step_most = true }

-- of `scene` everything except what moves the muscles, which is part of the answer
local DRIVES = { actuation = true, control = true }

--- Supervisors that repeat another run, which differs between repetitions of one arm.
arms.REPEATS = { yoked = true, shuffled = true, constant_median = true, replay = true }

-- Digits of a function's hash in names and messages.
local HASH_SHOWN = 16

-- The longest list of differing fields that a message shows.
local MOST_SHOWN = 12

-- Functions are compared by their text, not by their file.
local function shown(value)
  if type(value) == "table" and value.sha256 and value.first_line then
    return schema.show(value.sha256:sub(1, HASH_SHOWN))
  end
  return flat.text(value)
end

-- The fields that identify an arm, and those that all runs share, by path.
local function fields_of(run)
  local own, shared = {}, {}
  local config = source.copy(run.config)
  local supervisor = config.supervisor
  if type(supervisor) == "table" and arms.REPEATS[supervisor.name] then
    supervisor.run, supervisor.repetition, supervisor.donor = nil, nil, run.donor
  end
  for name, value in pairs(config) do
    if name == "simulation" then
      for field, entry in pairs(value) do
        flat.add(entry, "simulation." .. field, OF_TIER[field] and own or shared, shown)
      end
    elseif name == "scene" then
      for effect, entry in pairs(value) do
        flat.add(entry, "scene." .. effect, DRIVES[effect] and own or shared, shown)
      end
    elseif not ASIDE[name] then
      flat.add(value, name, QUESTION[name] and shared or own, shown)
    end
  end
  -- tuning counts for the budget
  if config.evaluations then
    shared.evaluations = schema.show(config.evaluations + run.before)
  end
  return own, shared
end

--- A field of two configurations whose runs cannot be compared; nil if they can.
---@return string|nil path
function arms.other_question(one, other)
  local _, first = fields_of { config = one, before = 0 }
  local _, second = fields_of { config = other, before = 0 }
  local differs = flat.differences(first, second)[1]
  return differs and differs.path
end

-- Refuses runs with another question or another budget.
local function check_question(first, shared, run, its)
  local list, texts = flat.differences(shared, its), {}
  if #list == 0 then return end
  for k = 1, math.min(#list, MOST_SHOWN) do
    texts[k] = ("  %s: %s, %s"):format(list[k].path, list[k].before, list[k].now)
  end
  local more = #list - MOST_SHOWN
  if more > 0 then texts[#texts + 1] = ("  ... and %d more"):format(more) end
  failure.raise(2, ("%s and %s cannot be compared: another question or budget:\n%s"):format(
    first.path, run.path, table.concat(texts, "\n")))
end

-- Refuses a run whose scores mean two things.
local function check_changes(run)
  if not run.changes or not run.changes[1] then return end
  failure.raise(2, ("%s: repetition %d was continued by --changed with another %s; scores before"
    .. " and after cannot be compared: start a new run instead"):format(run.path, run.repetition,
    changes.text(run.changes)))
end

-- A supervisor's name; that of a function is its file, because lines move when it is edited.
local function supervisor_name(arm)
  local supervisor = arm.runs[1].config.supervisor
  if type(supervisor) ~= "table" then return tostring(supervisor) end
  local own = supervisor["function"]
  return own and own.file or supervisor.name or tostring(supervisor[1])
end

local function experiment_name(arm) return arm.runs[1].config.name end

-- Names of arms that differ only in how they search; nil for others.
local function search_names(groups)
  local configs = {}
  for k, arm in ipairs(groups) do
    configs[k] = arm.runs[1].config
    for _, each in ipairs(flat.differences(groups[1].fields, arm.fields)) do
      if not search.has(each.path, configs[1], configs[k]) then return nil end
    end
  end
  return #groups > 1 and search.names(configs) or nil
end

-- Has only this arm this name?
local function is_only(groups, arm, name_of)
  for _, other in ipairs(groups) do
    if other ~= arm and name_of(other) == name_of(arm) then return false end
  end
  return true
end

-- Names arms: by what differs in how they search, if nothing else does; by the supervisor; if
-- another arm has it, by the experiment; if another arm has that too, by the supervisor and the
-- fields that differ from its first arm. A study names its own.
local function name_arms(groups)
  local names, first_of = search_names(groups) or {}, {}
  for k, arm in ipairs(groups) do
    local supervisor = supervisor_name(arm)
    local first = first_of[supervisor]
    if arm.name or names[k] then
      arm.name = arm.name or names[k]
    elseif is_only(groups, arm, supervisor_name) then
      arm.name = supervisor
    elseif experiment_name(arm) and is_only(groups, arm, experiment_name) then
      arm.name = experiment_name(arm)
    elseif first then
      local texts = {}
      for i, each in ipairs(flat.differences(first.fields, arm.fields)) do
        texts[i] = ("%s=%s"):format(each.path, each.now)
      end
      arm.name = ("%s (%s)"):format(supervisor, table.concat(texts, ", "))
    else
      arm.name, first_of[supervisor] = supervisor, arm
    end
  end
end

---@class limax.compare.arm
---@field name string
---@field runs limax.report.run[] by seed and repetition
---@field by_pair table<string, limax.report.run> by "seed/repetition"
---@field donor string|nil

--- The key of a run's pair: runs with equal keys are compared.
function arms.pair(run) return ("%s/%d"):format(run.seed, run.repetition) end

-- Sorts runs by their pairs, and refuses duplicates.
local function order(arm)
  table.sort(arm.runs, function(a, b)
    if a.seed ~= b.seed then return #a.seed < #b.seed or #a.seed == #b.seed and a.seed < b.seed end
    return a.repetition < b.repetition
  end)
  for _, run in ipairs(arm.runs) do
    local pair = arms.pair(run)
    local other = arm.by_pair[pair]
    if other then
      failure.raise(2, ("%s and %s are the same: arm %s, seed %s, repetition %d"):format(other.path,
        run.path, arm.name, run.seed, run.repetition))
    end
    arm.by_pair[pair] = run
  end
end

--- The arms of these runs, in the order in which they first come. A study's runs have the arms that
--- it gave them; all others are grouped by their configuration.
function arms.group(list)
  local groups, by_key, shared = {}, {}, nil
  for _, run in ipairs(list) do
    check_changes(run)
    local own, its = fields_of(run)
    if shared then check_question(list[1], shared, run, its) end
    shared = shared or its
    local key = run.arm and "study " .. run.arm
    if not key then
      local parts = {}
      for _, path in ipairs(choice.sorted_keys(own)) do
        parts[#parts + 1] = path .. "=" .. own[path]
      end
      key = table.concat(parts, "\n")
    end
    if not by_key[key] then
      by_key[key] = { runs = {}, fields = own, by_pair = {}, name = run.arm, donor = run.donor }
      groups[#groups + 1] = by_key[key]
    end
    table.insert(by_key[key].runs, run)
  end
  name_arms(groups)
  for _, arm in ipairs(groups) do order(arm) end
  return groups
end

return arms
