--- proposals.lua: judges the proposals of supervisors. A range and a largest change per generation
--- limit each field. Its outcome is accepted, clamped, rate-limited, kept or rejected, with a
--- reason, or "set" by a script's own loop; ledger.jsonl records it. No value in a proposal raises
--- an error.

local choice = require "limax.base.choice"
local schema = require "limax.engine.schema"
local source = require "limax.base.source"
local suggest = require "limax.engine.suggest"

local proposals = {}

--- The limit of one field of a proposal.
---@class limax.limit
---@field field string mutation_rate, ..., stiffness
---@field minimum number
---@field maximum number
---@field factor? number largest ratio between two generations
---@field step? number largest difference between two generations
---@field unit string
---@field material? boolean a field of materials; for stiffness the range is in first values
---@field allowed boolean may a supervisor set it in this experiment?

-- The fields of a proposal, with their ranges and largest changes per generation.
local proposable = {
  { field = "mutation_rate", minimum = 0.001, maximum = 0.5, factor = 2, unit = "per gene" },
  { field = "mutation_scale", minimum = 0.001, maximum = 1, factor = 2, unit = "1" },
  { field = "crossover_rate", minimum = 0, maximum = 1, step = 0.2, unit = "per gene" },
  { field = "elite_fraction", minimum = 0, maximum = 0.5, step = 0.1, unit = "of the population" },
  { field = "control_mutation_rate", minimum = 0.001, maximum = 0.5, factor = 2,
    unit = "per gene" },
  { field = "control_mutation_scale", minimum = 0.001, maximum = 1, factor = 2, unit = "1" },
  { field = "stiffness", minimum = 0.2, maximum = 5, factor = 1.25, unit = "first value (N/m)",
    material = true },
  { field = "amplitude", minimum = 0, maximum = 0.3, step = 0.05, unit = "1", material = true },
  { field = "phase", minimum = 0, maximum = math.pi, step = 0.5, unit = "rad", material = true },
}

--- Names of the parameters; the last two only exist with genes of control.
proposals.parameters = { "mutation_rate", "mutation_scale", "crossover_rate", "elite_fraction",
  "control_mutation_rate", "control_mutation_scale" }

-- Fields of an experiment that a proposal never reaches.
local fixed = { "population", "generations", "repetitions", "seed", "scene", "lattice", "genome",
  "simulation", "accuracy", "fitness", "selection", "supervisor", "record", "mass_per_site",
  "damping_ratio", "stiffness_floor", "friction", "name", "letter", "kind" }
local is_fixed = {}
for _, name in ipairs(fixed) do is_fixed[name] = true end

--- The limits that bind proposals in a population of this size, narrowed by an experiment's ranges.
---@param ranges? table<string, number[]> field -> { least, most }
---@param allowed? { hyperparameters: boolean, materials: boolean } everything if left out
---@param breeding? table<string, number> the parameters that exist; all if left out
function proposals.limits(population, ranges, allowed, breeding)
  local list = {}
  for _, general in ipairs(proposable) do
    local limit = source.copy(general)
    limit.allowed = not allowed or allowed[limit.material and "materials" or "hyperparameters"]
    -- at least one robot is kept
    if limit.field == "elite_fraction" then limit.minimum = 1 / population end
    local range = ranges and ranges[limit.field]
    if range then
      limit.minimum = math.max(limit.minimum, range[1])
      limit.maximum = math.min(limit.maximum, range[2])
    end
    if limit.material or not breeding or breeding[limit.field] then list[#list + 1] = limit end
  end
  return list
end

--- Names of the fields of a material that may be proposed: amplitude and phase belong to muscles.
---@param material table an entry of engine materials: kind, stiffness, ...
function proposals.material_fields(material)
  if material.kind == "empty" then return {} end
  if material.kind == "passive" then return { "stiffness" } end
  return { "amplitude", "phase", "stiffness" }
end

--- The values that the largest change per generation allows, regardless of the range.
---@param unit number of the limit's range: the first value of a stiffness, else 1
---@return number least
---@return number most
function proposals.reach(limit, before, unit)
  if not limit.factor then return before - limit.step, before + limit.step end
  -- a value of 0 could never grow by a factor: the change counts from the range's minimum
  local from = math.max(before, limit.minimum * unit)
  return from / limit.factor, from * limit.factor
end

-- One value within its range and its largest change from `before`: value, outcome, reason.
local function bound(limit, before, proposed, unit)
  local low, high = limit.minimum * unit, limit.maximum * unit
  local least, most = proposals.reach(limit, before, unit)
  local change = ("at most %s%.6g per generation"):format(limit.factor and "x" or "",
    limit.factor or limit.step)
  local in_range = math.min(math.max(proposed, low), high)
  local reason = in_range ~= proposed and ("the range is %.6g to %.6g"):format(low, high) or nil
  local value = math.min(math.max(in_range, least), most)
  if value ~= in_range then
    return value, "rate-limited", reason and reason .. ", and " .. change or change
  end
  return value, reason and "clamped" or "accepted", reason
end

local function is_number(value)
  return type(value) == "number" and value == value and math.abs(value) < math.huge
end

-- A proposed value as the ledger shows it, in a form that JSON can hold.
local function shown(value)
  if is_number(value) then return value end
  if type(value) == "string" or type(value) == "boolean" then return schema.show(value) end
  return type(value) == "number" and tostring(value) or "a " .. type(value)
end

-- A proposal with texts for keys, as `choice.sorted_keys` and messages need them; nil for anything
-- but a table.
local function named(value, depth)
  if type(value) ~= "table" then return nil end
  local copy = {}
  for key, entry in pairs(value) do
    if type(key) ~= "string" then key = ("[%s]"):format(tostring(key)) end
    copy[key] = depth > 1 and named(entry, depth - 1) or entry
  end
  return copy
end

-- Why a field with this name is rejected.
local function unknown(name, names)
  if is_fixed[name] then return "is not for a supervisor to change" end
  return "unknown field" .. suggest.ending(name, names)
end

-- The proposed table of each material, by name or letter. Adds entries for names that match none.
local function match_materials(proposed, list, entries)
  local by_material, names = {}, {}
  for i, material in ipairs(list) do names[i] = material.name end
  for _, key in ipairs(choice.sorted_keys(proposed)) do
    local value, found = proposed[key], nil
    for _, material in ipairs(list) do
      if key == material.name or key == material.letter then found = material end
    end
    if not found or type(value) ~= "table" then
      entries[#entries + 1] = { field = "materials." .. key, outcome = "rejected",
        proposed = shown(value), reason = found and "expected a table of fields"
          or "materials are neither added nor renamed" .. suggest.ending(key, names) }
    else
      by_material[found.name] = value
    end
  end
  return by_material
end

-- Judges one field of parameters or of a material and writes its entry.
local function judge_field(request)
  local entry = { field = request.path, before = request.before, applied = request.before,
    outcome = "kept", reason = nil }
  local proposed = request.proposed
  if proposed ~= nil then
    entry.proposed = shown(proposed)
    if not request.allowed then
      entry.outcome, entry.reason = "rejected", request.refusal
    elseif not is_number(proposed) then
      entry.outcome, entry.reason = "rejected", "expected a finite number, got " .. entry.proposed
    else
      entry.applied, entry.outcome, entry.reason =
        bound(request.limit, request.before, proposed, request.unit or 1)
    end
  end
  request.entries[#request.entries + 1] = entry
  return entry
end

-- Reduces raised stiffnesses until a full body's `auto` step is at least half of its first value:
-- stiffer materials would make every later generation slower. `cost(fields)` is that step, s.
local function limit_cost(fields, raised, cost, first_step)
  local least = first_step / 2
  local wanted = cost(fields)
  if wanted >= least or #raised == 0 then return end
  local function set(share)
    for _, change in ipairs(raised) do
      local before, target = change.entry.before, change.target
      fields[change.material].stiffness = before * (target / before) ^ share
    end
    return cost(fields)
  end
  -- 20 halvings: a millionth of the proposed change
  local low, high = 0, 1
  for _ = 1, 20 do
    local middle = (low + high) / 2
    if set(middle) >= least then low = middle else high = middle end
  end
  set(low)
  for _, change in ipairs(raised) do
    change.entry.applied = fields[change.material].stiffness
    change.entry.outcome = "clamped"
    change.entry.reason = ("cost: the step of a full body would fall from %.3g s to %.3g s")
      :format(first_step, wanted)
  end
end

-- Judges the parameters. Returns their values and the names that a proposal may have.
local function judge_parameters(request, proposal, entries)
  local parameters, names = {}, { "materials" }
  for _, limit in ipairs(request.limits) do
    if not limit.material then
      names[#names + 1] = limit.field
      local entry = judge_field { entries = entries, path = limit.field, limit = limit,
        before = request.parameters[limit.field], proposed = proposal[limit.field],
        allowed = request.allowed.hyperparameters,
        refusal = "supervision.hyperparameters is false in this experiment" }
      parameters[limit.field] = entry.applied
    end
  end
  return parameters, names
end

-- Adds entries for the fields of `proposed` whose names are not in `names`.
local function reject_unknown(proposed, names, path, rejected)
  local is_name = {}
  for _, name in ipairs(names) do is_name[name] = true end
  for _, key in ipairs(choice.sorted_keys(proposed)) do
    if not is_name[key] then
      rejected[#rejected + 1] = { field = path .. key, proposed = shown(proposed[key]),
        outcome = "rejected", reason = unknown(key, names) }
    end
  end
end

-- Judges the fields of all materials. Returns their values.
local function judge_materials(request, proposed, entries, rejected)
  if proposed ~= nil and type(proposed) ~= "table" then
    rejected[1] = { field = "materials", proposed = shown(proposed), outcome = "rejected",
      reason = "expected a table of materials" }
    proposed = nil
  end
  local by_material = match_materials(proposed or {}, request.materials, rejected)
  local fields, raised, limit_of = {}, {}, {}
  for _, limit in ipairs(request.limits) do limit_of[limit.field] = limit end
  for _, material in ipairs(request.materials) do
    local mine = by_material[material.name] or {}
    local names = proposals.material_fields(material)
    if #names > 0 then fields[material.name] = {} end
    for _, name in ipairs(names) do
      local unit = name == "stiffness" and request.first[material.name].stiffness or 1
      local entry = judge_field { entries = entries, limit = limit_of[name], unit = unit,
        path = ("materials.%s.%s"):format(material.name, name),
        before = material[name], proposed = mine[name], allowed = request.allowed.materials,
        refusal = "supervision.materials is false in this experiment" }
      fields[material.name][name] = entry.applied
      if name == "stiffness" and entry.applied > entry.before then
        raised[#raised + 1] = { material = material.name, entry = entry, target = entry.applied }
      end
    end
    reject_unknown(mine, names, ("materials.%s."):format(material.name), rejected)
  end
  if #raised > 0 then limit_cost(fields, raised, request.cost, request.first_step) end
  return fields
end

---@class limax.proposal.request
---@field proposal table|nil what the supervisor returned
---@field reason? any its second result
---@field supervisor string its name
---@field source? string who made the proposal, if not the supervisor: "model", "rules", "keep"
---@field limits limax.limit[]
---@field parameters table<string, number> of the generation just scored
---@field materials table[] all materials now, as `engine.materials` gives them, in index order
---@field first table<string, table<string, number>> first values: material name -> field -> value
---@field allowed { hyperparameters: boolean, materials: boolean }
---@field cost fun(fields: table): number least `auto` step of a full body, s
---@field first_step number the same under the first materials

--- Judges a proposal. Returns the next parameters, the next material fields (name -> field ->
--- value) and the ledger record: supervisor, reason and one entry per field, in a fixed order.
function proposals.judge(request)
  local entries, rejected = {}, {}
  -- parameters; materials; fields of a material
  local proposal = named(request.proposal, 3) or {}
  local parameters, names = judge_parameters(request, proposal, entries)
  local fields = judge_materials(request, proposal.materials, entries, rejected)
  reject_unknown(proposal, names, "", rejected)
  for _, entry in ipairs(rejected) do entries[#entries + 1] = entry end
  return parameters, fields, { supervisor = request.supervisor, source = request.source,
    reason = type(request.reason) == "string" and request.reason or nil, entries = entries }
end

--- The number of proposed fields, and the share of each outcome.
---@param record { entries: table[] }
function proposals.shares(record)
  local counts = { accepted = 0, clamped = 0, ["rate-limited"] = 0, rejected = 0 }
  local proposed = 0
  for _, entry in ipairs(record.entries) do
    if counts[entry.outcome] then
      counts[entry.outcome] = counts[entry.outcome] + 1
      proposed = proposed + 1
    end
  end
  local function share(outcome) return proposed > 0 and counts[outcome] / proposed or nil end
  return { proposed = proposed, accepted = share "accepted", clamped = share "clamped",
    rate_limited = share "rate-limited", rejected = share "rejected" }
end

--- Records that a script's own loop sets a parameter.
---@param record { entries: table[] } of `proposals.judge`
function proposals.set(record, field, value)
  for _, entry in ipairs(record.entries) do
    if entry.field == field then
      entry.applied, entry.outcome, entry.reason = value, "set", "by the script's own loop"
    end
  end
end

return proposals
