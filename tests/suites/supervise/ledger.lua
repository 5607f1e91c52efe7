--- ledger.lua: proposals and their outcomes: ranges, largest changes, supervisors that fail, and
--- parameters set by a script's own loop.

local limax = require "limax"
local engine = require "limax.engine"
local ledger = require "limax.supervise.ledger"
local evolution = require "support.evolution"

local suite = require("limax.test").suite "ledger"
local small, finished, silent = evolution.small, evolution.finished, evolution.silent

suite:test("the ledger records parameters that an own loop sets", function(t)
  local run = limax.start(small { supervisor = function()
    return { mutation_rate = 0.12, mutation_scale = 0.12 }
  end }, { say = silent })
  for population in run:generations() do
    population:score():breed { mutation_rate = 0.9, elites = { population.ranked[1] } }
  end
  local entry, entries = run.history[2], {}
  for _, one in ipairs(entry.ledger.entries) do entries[one.field] = one end
  local rate = entries.mutation_rate
  t:equal({ rate.outcome, rate.before, rate.applied },
    { "set", 0.1, 0.9 })
  t:equal(entries.mutation_rate.proposed, 0.12)
  t:equal({ entries.elite_fraction.outcome, entries.elite_fraction.applied }, { "set", 1 / 6 })
  t:equal(entries.mutation_scale.outcome, "accepted")
  for _, name in ipairs { "mutation_rate", "mutation_scale", "crossover_rate",
    "elite_fraction" } do
    t:same_bits(entry.parameters[name], entries[name].applied)
  end
end)

suite:test("a proposal is limited by ranges and largest changes", function(t)
  local history = finished { generations = 2, supervisor = function(history)
    t:equal(#history, 1)
    return { mutation_rate = 0.4, crossover_rate = 0.5, elite_fraction = 2, population = 9,
      mutation_scale = "big", materials = { bone = { stiffness = 1 } } }, "because"
  end }
  local record, entries = history[2].ledger, {}
  t:equal(record.reason, "because")
  for _, entry in ipairs(record.entries) do entries[entry.field] = entry end
  t:equal({ entries.mutation_rate.outcome, entries.mutation_rate.applied }, { "rate-limited", 0.2 })
  t:equal({ entries.crossover_rate.outcome, entries.crossover_rate.applied }, { "accepted", 0.5 })
  t:equal(entries.elite_fraction.outcome, "rate-limited")
  t:near(entries.elite_fraction.applied, 0.4)
  t:equal(entries.population.outcome, "rejected")
  t:equal(entries.mutation_scale.outcome, "rejected")
  t:equal(entries["materials.bone.stiffness"].outcome, "rejected")
  t:equal(history[2].parameters.mutation_rate, 0.2)
end)

suite:test("a supervisor that fails costs its change, never the run", function(t)
  local output = {}
  local history = finished({ supervisor = function() error("no idea", 0) end },
    { say = function(text) output[#output + 1] = text end })
  t:equal(#history, 3)
  t:ok(history[2].ledger.reason:find "the supervisor failed: no idea")
  for _, value in ipairs { 3, "x", true } do
    history = finished { supervisor = function() return value end }
    t:ok(history[2].ledger.reason:find "the supervisor returned")
    t:equal(history[2].parameters, history[1].parameters)
  end
  -- proposals with metamethods that raise errors
  local function broken() error "never called" end
  local trap = setmetatable({}, { __index = broken, __tostring = broken, __len = broken })
  for _, proposal in ipairs { trap, { materials = trap }, { materials = { bone = trap } },
    { mutation_rate = trap, [trap] = 1, [7] = 2 } } do
    history = finished { supervision = { materials = true },
      supervisor = function() return proposal end }
    t:equal(#history, 3)
    t:equal(history[2].parameters, history[1].parameters)
  end
  local fields = {}
  for _, entry in ipairs(history[2].ledger.entries) do
    if entry.outcome == "rejected" then fields[#fields + 1] = entry.field end
  end
  t:equal(fields, { "mutation_rate", "[7]", "[a table]" })
end)

suite:test("a range of the experiment narrows a proposal", function(t)
  local history = finished { generations = 2,
    supervision = { ranges = { mutation_rate = { 0.08, 0.12 } } },
    supervisor = function() return { mutation_rate = 0.2 } end }
  t:equal(history[2].parameters.mutation_rate, 0.12)
end)

suite:test("each rule of the ledger", function(t)
  local limits = ledger.limits(30)
  local materials = engine.materials "paper"
  local list, first = {}, {}
  for i = 1, materials.count do
    list[i] = materials:get(i)
    first[list[i].name] = list[i]
  end
  local function judge(proposal, changes)
    local request = { proposal = proposal, supervisor = "test", limits = limits, materials = list,
      first = first, parameters = { mutation_rate = 0.1, mutation_scale = 0.1, crossover_rate = 0.4,
        elite_fraction = 0.3 }, allowed = { hyperparameters = true, materials = true },
      cost = function() return 1 end, first_step = 1 }
    for name, value in pairs(changes or {}) do request[name] = value end
    local parameters, fields, record = ledger.judge(request)
    local entries = {}
    for _, entry in ipairs(record.entries) do entries[entry.field] = entry end
    return entries, parameters, fields
  end
  local entries, parameters = judge { mutation_rate = 0.0001 }
  t:equal({ entries.mutation_rate.outcome, parameters.mutation_rate }, { "rate-limited", 0.05 })
  entries = judge { elite_fraction = 0.6, crossover_rate = -1 }
  t:near(entries.elite_fraction.applied, 0.4)
  t:near(entries.crossover_rate.applied, 0.2)
  entries = judge({ crossover_rate = 1.1 }, { parameters = { mutation_rate = 0.1,
    mutation_scale = 0.1, crossover_rate = 0.9, elite_fraction = 0.3 } })
  t:equal({ entries.crossover_rate.outcome, entries.crossover_rate.applied }, { "clamped", 1 })
  entries = judge { mutation_rate = 0 / 0, mutation_scale = math.huge }
  t:equal({ entries.mutation_rate.outcome, entries.mutation_scale.outcome },
    { "rejected", "rejected" })
  entries = judge { mutation_raet = 0.1 }
  t:ok(entries.mutation_raet.reason:find 'did you mean "mutation_rate"')
  entries = judge { materials = { b = { stiffness = 1.1e4, mass_per_site = 2, amplitude = 0.1 },
    wood = {} } }
  t:equal(entries["materials.bone.stiffness"].applied, 1.1e4)
  t:equal(entries["materials.bone.mass_per_site"].outcome, "rejected")
  t:equal(entries["materials.bone.amplitude"].outcome, "rejected")
  t:equal(entries["materials.wood"].outcome, "rejected")
  entries = judge { materials = { e = { amplitude = 0.4, phase = 0 } } }
  t:near(entries["materials.expanding muscle.amplitude"].applied, 0.3)
  t:near(entries["materials.expanding muscle.phase"].applied, math.pi - 0.5)
  -- a set that would more than halve the step of a full body is clamped to one that halves it
  local cost = function(fields) return 1e4 / fields.bone.stiffness end
  entries = judge({ materials = { b = { stiffness = 1.2e4 } } }, { cost = cost, first_step = 1.8 })
  t:equal(entries["materials.bone.stiffness"].outcome, "clamped")
  t:ok(entries["materials.bone.stiffness"].reason:find "cost")
  t:near(entries["materials.bone.stiffness"].applied, 1e4 / 0.9, { rtol = 1e-4 })
end)

return suite
