--- proposals.lua: proposals and their outcomes: ranges, largest changes, supervisors that fail, and
--- parameters set by a script's own loop.

local limax = require "limax"
local engine = require "limax.engine"
local evolution = require "support.evolution"
local proposals = require "limax.supervise.proposals"

local suite = require("limax.test").suite "proposals"
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
  t:equal({ rate.outcome, rate.before, rate.proposed, rate.applied }, { "set", 0.1, 0.12, 0.9 })
  t:equal({ entries.elite_fraction.outcome, entries.elite_fraction.applied }, { "set", 1 / 6 })
  t:equal(entries.mutation_scale.outcome, "accepted")
  for name, value in pairs(entry.parameters) do t:same_bits(value, entries[name].applied) end
end)

suite:test("a range of the experiment narrows a proposal, and is shown to the supervisor",
  function(t)
    local history = finished { generations = 2,
      supervision = { ranges = { mutation_rate = { 0.08, 0.12 } } },
      supervisor = function(_, _, limits)
        t:equal({ limits[1].minimum, limits[1].maximum }, { 0.08, 0.12 })
        return { mutation_rate = 0.2, materials = { bone = { stiffness = 1 } } }, "because"
      end }
    t:equal(history[2].parameters.mutation_rate, 0.12)
    local record = history[2].ledger
    t:equal(record.reason, "because")
    for _, entry in ipairs(record.entries) do
      if entry.field == "materials.bone.stiffness" then t:equal(entry.outcome, "rejected") end
    end
  end)

local FIRST = require("support.histories").FIRST

-- Proposal, field, its outcome, the value that is applied, text of the reason, changes of the
-- request.
local BONE, MUSCLE = "materials.bone.", "materials.expanding muscle."
local RULES = {
  { { mutation_rate = 0.12 }, "mutation_rate", "accepted", 0.12 },
  { { mutation_rate = 0.4 }, "mutation_rate", "rate-limited", 0.2, "at most x2 per generation" },
  { { mutation_rate = 0.0001 }, "mutation_rate", "rate-limited", 0.05 },
  { { elite_fraction = 0.6 }, "elite_fraction", "rate-limited", 0.4, "the range is 0.0333333 to" },
  { { crossover_rate = -1 }, "crossover_rate", "rate-limited", 0.2 },
  { { crossover_rate = 1.1 }, "crossover_rate", "clamped", 1, "the range is 0 to 1",
    { parameters = evolution.with(FIRST, { crossover_rate = 0.9 }) } },
  { { mutation_rate = 0 / 0 }, "mutation_rate", "rejected", 0.1, "expected a finite number" },
  { { mutation_scale = math.huge }, "mutation_scale", "rejected", 0.1 },
  { { mutation_scale = "big" }, "mutation_scale", "rejected", 0.1 },
  { { population = 9 }, "population", "rejected", nil, "is not for a supervisor to change" },
  { { mutation_raet = 0.1 }, "mutation_raet", "rejected", nil, 'did you mean "mutation_rate"' },
  { { materials = { b = { stiffness = 1.1e4 } } }, BONE .. "stiffness", "accepted", 1.1e4 },
  { { materials = { b = { mass_per_site = 2 } } }, BONE .. "mass_per_site", "rejected" },
  { { materials = { b = { amplitude = 0.1 } } }, BONE .. "amplitude", "rejected" },
  { { materials = { wood = {} } }, "materials.wood", "rejected", nil, "neither added nor renamed" },
  { { materials = { e = { amplitude = 0.4 } } }, MUSCLE .. "amplitude", "clamped", 0.3 },
  { { materials = { e = { phase = 0 } } }, MUSCLE .. "phase", "rate-limited", math.pi - 0.5 },
  -- a set that would more than halve the step of a full body is clamped to one that halves it
  { { materials = { b = { stiffness = 1.2e4 } } }, BONE .. "stiffness", "clamped", 1e4 / 0.9,
    "cost: the step of a full body", { first_step = 1.8,
      cost = function(fields) return 1e4 / fields.bone.stiffness end } },
}

suite:test("each rule of the ledger", function(t)
  local list, first = engine.materials("paper"):table().materials, {}
  for _, material in ipairs(list) do first[material.name] = material end
  for _, row in ipairs(RULES) do
    local proposal, field, outcome, applied, text, changes = unpack(row, 1, 6)
    local parameters, fields, record = proposals.judge(evolution.with({ proposal = proposal,
      supervisor = "test", limits = proposals.limits(30), materials = list, first = first,
      parameters = FIRST, allowed = { hyperparameters = true, materials = true },
      cost = function() return 1 end, first_step = 1 }, changes))
    local found
    for _, entry in ipairs(record.entries) do
      if entry.field == field then found = entry end
    end
    t:equal({ field, found.outcome }, { field, outcome })
    t:ok(not text or found.reason:find(text, 1, true), found.reason)
    t:near({ found.applied }, { applied }, { rtol = 1e-4 })
    local material, name = field:match "^materials%.(.*)%.(.*)$"
    local value = parameters[field] or material and fields[material][name]
    t:equal({ field, value }, { field, found.applied })
  end
end)
