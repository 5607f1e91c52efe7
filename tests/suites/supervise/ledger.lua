--- ledger.lua: what becomes of proposals: ranges, largest changes, supervisors that fail, and what
--- an own loop sets itself.

local limax = require "limax"
local engine = require "limax.engine"
local ledger = require "limax.supervise.ledger"
local evolution = require "support.evolution"

local suite = require("limax.test").suite "ledger"
local small, finished, silent = evolution.small, evolution.finished, evolution.silent

suite:test("the ledger says what an own loop sets, and the parameters agree", function(t)
  local run = limax.start(small { supervisor = function()
    return { mutation_rate = 0.12, mutation_scale = 0.12 }
  end }, { say = silent })
  for population in run:generations() do
    population:score():breed { mutation_rate = 0.9, elites = { population.ranked[1] } }
  end
  local entry, fate = run.history[2], {}
  for _, one in ipairs(entry.ledger.entries) do fate[one.field] = one end
  t:equal({ fate.mutation_rate.outcome, fate.mutation_rate.before, fate.mutation_rate.applied },
    { "set", 0.1, 0.9 })
  t:equal(fate.mutation_rate.proposed, 0.12)
  t:equal({ fate.elite_fraction.outcome, fate.elite_fraction.applied }, { "set", 1 / 6 })
  t:equal(fate.mutation_scale.outcome, "accepted")
  for _, name in ipairs { "mutation_rate", "mutation_scale", "crossover_rate",
    "elite_fraction" } do
    t:same_bits(entry.parameters[name], fate[name].applied)
  end
end)

suite:test("a supervisor's proposal is bound by ranges and largest changes", function(t)
  local history = finished { generations = 2, supervisor = function(history)
    t:equal(#history, 1)
    return { mutation_rate = 0.4, crossover_rate = 0.5, elite_fraction = 2, population = 9,
      mutation_scale = "big", materials = { bone = { stiffness = 1 } } }, "because"
  end }
  local record, fate = history[2].ledger, {}
  t:equal(record.reason, "because")
  for _, entry in ipairs(record.entries) do fate[entry.field] = entry end
  t:equal({ fate.mutation_rate.outcome, fate.mutation_rate.applied }, { "rate-limited", 0.2 })
  t:equal({ fate.crossover_rate.outcome, fate.crossover_rate.applied }, { "accepted", 0.5 })
  t:equal(fate.elite_fraction.outcome, "rate-limited")
  t:near(fate.elite_fraction.applied, 0.4)
  t:equal(fate.population.outcome, "rejected")
  t:equal(fate.mutation_scale.outcome, "rejected")
  t:equal(fate["materials.bone.stiffness"].outcome, "rejected")
  t:equal(history[2].parameters.mutation_rate, 0.2)
end)

suite:test("a supervisor that fails costs its change, never the run", function(t)
  local said = {}
  local history = finished({ supervisor = function() error("no idea", 0) end },
    { say = function(text) said[#said + 1] = text end })
  t:equal(#history, 3)
  t:ok(history[2].ledger.reason:find "the supervisor failed: no idea")
  for _, value in ipairs { 3, "x", true } do
    history = finished { supervisor = function() return value end }
    t:ok(history[2].ledger.reason:find "the supervisor returned")
    t:equal(history[2].parameters, history[1].parameters)
  end
  -- a proposal that calls back when it is read, and keys and values that raise when they are shown
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

suite:test("a range of the experiment narrows what a proposal reaches", function(t)
  local history = finished { generations = 2,
    supervision = { ranges = { mutation_rate = { 0.08, 0.12 } } },
    supervisor = function() return { mutation_rate = 0.2 } end }
  t:equal(history[2].parameters.mutation_rate, 0.12)
end)

suite:test("ledger: each rule on its own", function(t)
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
    local fate = {}
    for _, entry in ipairs(record.entries) do fate[entry.field] = entry end
    return fate, parameters, fields
  end
  local fate, parameters = judge { mutation_rate = 0.0001 }
  t:equal({ fate.mutation_rate.outcome, parameters.mutation_rate }, { "rate-limited", 0.05 })
  fate = judge { elite_fraction = 0.6, crossover_rate = -1 }
  t:near(fate.elite_fraction.applied, 0.4)
  t:near(fate.crossover_rate.applied, 0.2)
  fate = judge({ crossover_rate = 1.1 }, { parameters = { mutation_rate = 0.1, mutation_scale = 0.1,
    crossover_rate = 0.9, elite_fraction = 0.3 } })
  t:equal({ fate.crossover_rate.outcome, fate.crossover_rate.applied }, { "clamped", 1 })
  fate = judge { mutation_rate = 0 / 0, mutation_scale = math.huge }
  t:equal({ fate.mutation_rate.outcome, fate.mutation_scale.outcome }, { "rejected", "rejected" })
  fate = judge { mutation_raet = 0.1 }
  t:ok(fate.mutation_raet.reason:find 'did you mean "mutation_rate"')
  fate = judge { materials = { b = { stiffness = 1.1e4, mass_per_site = 2, amplitude = 0.1 },
    wood = {} } }
  t:equal(fate["materials.bone.stiffness"].applied, 1.1e4)
  t:equal(fate["materials.bone.mass_per_site"].outcome, "rejected")
  t:equal(fate["materials.bone.amplitude"].outcome, "rejected")
  t:equal(fate["materials.wood"].outcome, "rejected")
  fate = judge { materials = { e = { amplitude = 0.4, phase = 0 } } }
  t:near(fate["materials.expanding muscle.amplitude"].applied, 0.3)
  t:near(fate["materials.expanding muscle.phase"].applied, math.pi - 0.5)
  -- a set that would more than halve the step of a full body is clamped to one that halves it
  local cost = function(fields) return 1e4 / fields.bone.stiffness end
  fate = judge({ materials = { b = { stiffness = 1.2e4 } } }, { cost = cost, first_step = 1.8 })
  t:equal(fate["materials.bone.stiffness"].outcome, "clamped")
  t:ok(fate["materials.bone.stiffness"].reason:find "cost")
  t:near(fate["materials.bone.stiffness"].applied, 1e4 / 0.9, { rtol = 1e-4 })
end)

return suite
