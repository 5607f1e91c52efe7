--- supervise.lua: the proposals of supervisors for histories made by hand.

local histories = require "support.histories"
local limax = require "limax"
local ledger = require "limax.supervise.ledger"

local suite = require("limax.test").suite "supervise"

local PARAMETERS = { "mutation_rate", "mutation_scale", "crossover_rate", "elite_fraction" }
local FIRST, copy, entry = histories.FIRST, histories.copy, histories.entry
local history_of, stream, ask = histories.history_of, histories.stream, histories.ask

suite:test("no supervisor proposes before a generation is scored", function(t)
  for _, name in ipairs { "fixed", "schedule", "random", "one_fifth", "rules", "self_adaptive",
    "bandit" } do
    t:equal(ask(t, name, {}), nil)
  end
end)

suite:test("fixed proposes nothing", function(t)
  t:equal(ask(t, "fixed", history_of { 1, 1, 1, 1, 1, 1, 1, 1 }), nil)
end)

suite:test("schedule follows its lines", function(t)
  local function scale_after(generation, shape, points)
    local history = { entry(generation, 1) }
    return ask(t, { "schedule", mutation_scale = points, shape = shape }, history).mutation_scale
  end
  local points = { { 2, 0.4 }, { 6, 0.1 } }
  t:equal(scale_after(0, nil, points), 0.4)
  t:near(scale_after(3, nil, points), 0.25)
  t:near(scale_after(3, "geometric", points), 0.2)
  t:equal(scale_after(3, "step", points), 0.4)
  t:equal(scale_after(5, "step", points), 0.1)
  t:equal(scale_after(5, nil, points), 0.1)
  t:equal(scale_after(90, nil, points), 0.1)
  t:raises("does not come after", function()
    limax.supervise.get { "schedule", mutation_scale = { { 5, 1 }, { 5, 2 } } }
  end)
  t:raises('did you mean "mutation_rate"?', function()
    limax.supervise.get { "schedule", mutation_rates = { { 5, 1 } } }
  end)
end)

suite:test("random stays in the ranges, makes allowed steps, and covers the ranges", function(t)
  local list, limits = ledger.limits(10, nil, { hyperparameters = true, materials = false }), {}
  for _, limit in ipairs(list) do limits[limit.field] = limit end
  local supervisor, random = limax.supervise.get "random", stream()
  local now, low, high = entry(0, 1), {}, {}
  for _, name in ipairs(PARAMETERS) do low[name], high[name] = math.huge, -math.huge end
  for _ = 1, 3000 do
    local before = now.parameters
    now.parameters = supervisor.call({ now }, random, list)
    for _, name in ipairs(PARAMETERS) do
      local limit, value = limits[name], now.parameters[name]
      t:ok(value >= limit.minimum and value <= limit.maximum, name)
      if limit.factor then
        local ratio = value / before[name]
        t:ok(ratio < limit.factor * (1 + 1e-12) and ratio > (1 - 1e-12) / limit.factor, name)
      else
        t:ok(math.abs(value - before[name]) < limit.step * (1 + 1e-9), name)
      end
      low[name], high[name] = math.min(low[name], value), math.max(high[name], value)
    end
  end
  for _, name in ipairs(PARAMETERS) do
    local limit = limits[name]
    t:ok(low[name] < limit.minimum + 0.05 * (limit.maximum - limit.minimum), name)
    t:ok(high[name] > limit.maximum - 0.2 * (limit.maximum - limit.minimum), name)
  end
end)

suite:test("random keeps to the narrowed ranges of an experiment", function(t)
  local run = limax.start(limax.experiment { fitness = "distance", lattice = { 2, 2, 2 },
    population = 4, generations = 12, repetitions = 1, supervisor = "random",
    simulation = { duration = 0.1, settle = 0, accuracy = "preview" },
    supervision = { ranges = { mutation_rate = { 0.09, 0.11 }, crossover_rate = { 0.4, 0.41 } } } },
    { say = function() end })
  local moved = false
  for k, generation in ipairs(run:finish()) do
    local parameters = generation.parameters
    t:ok(parameters.mutation_rate >= 0.09 and parameters.mutation_rate <= 0.11)
    t:ok(parameters.crossover_rate >= 0.4 and parameters.crossover_rate <= 0.41)
    moved = moved or k > 1 and parameters.mutation_rate ~= 0.1
    for _, one in ipairs(generation.ledger.entries) do
      t:ok(one.outcome ~= "clamped", ("%s: %s"):format(one.field, tostring(one.reason)))
    end
  end
  t:ok(moved)
end)

-- Two generations: parents that score 1 to 10, and offspring of parents 3 and 5 with these scores.
local function family(scores)
  local before, now = entry(0, 10), entry(1, 10)
  for i = 1, 10 do
    before.population[i].fitness, before.population[i].origin = i, "initial"
    local parents = { before.population[3].id, before.population[5].id }
    now.population[i] = { id = 100 + i, origin = scores[i] == nil and "elite" or "bred",
      parents = parents, fitness = scores[i] or nil }
  end
  return { before, now }
end

suite:test("one_fifth counts offspring that beat both parents", function(t)
  local scale = FIRST.mutation_scale
  local proposal, reason = ask(t, { "one_fifth", factor = 1.5 },
    family { 6, 6, 6, 4, 4, 4, 4, 4, 4, 5 })
  t:near(proposal.mutation_scale, 1.5 * scale)
  t:ok(reason:find("3 of 10 offspring", 1, true))
  proposal = ask(t, { "one_fifth", factor = 1.5 }, family { 6, 4, 4, 4, 4, 4, 4, 4, 4, 4 })
  t:near(proposal.mutation_scale, scale * 1.5 ^ -0.25)
  -- exactly a fifth, and failed offspring count as tried
  t:equal(ask(t, "one_fifth", family { 6, 6, 4, 4, 4, false, false, 4, 4, 4 }), nil)
  -- elites are not offspring
  proposal, reason = ask(t, "one_fifth", family { 6, 4, 4 })
  t:ok(proposal.mutation_scale > scale and reason:find("1 of 3", 1, true))
  t:equal(ask(t, "one_fifth", { entry(0, 1) }), nil)
end)

suite:test("one_fifth looks back over its window", function(t)
  local history = family { 6, 6, 6, 6, 6, 6, 6, 6, 6, 6 }
  local later = entry(2, 10)
  for i = 1, 10 do
    later.population[i] = { id = 200 + i, origin = "bred", parents = { 101 }, fitness = 1 }
  end
  history[3] = later
  local _, wide = ask(t, { "one_fifth", window = 2 }, history)
  t:ok(wide:find("10 of 20", 1, true))
  local _, narrow = ask(t, { "one_fifth", window = 1 }, history)
  t:ok(narrow:find("0 of 10", 1, true))
end)

suite:test("rules changes nothing in a run that improves", function(t)
  t:equal(ask(t, "rules", history_of { 1, 2, 3 }), nil)
end)

suite:test("rules answers a stall with smaller mutations, larger if robots are alike", function(t)
  local stalled = history_of { 1, 2, 3, 3, 3.01, 3.02, 3.02, 3.03 }
  local proposal, reason = ask(t, "rules", stalled)
  t:ok(proposal.mutation_scale < 0.1 and proposal.mutation_rate < 0.1)
  t:ok(reason:find("less than 2 % in 5 generations while robots still differ", 1, true), reason)
  local alike = history_of({ 1, 2, 3, 3, 3.01, 3.02, 3.02, 3.03 },
    { diversity = { all = { hamming = 0.3 } } })
  proposal, reason = ask(t, "rules", alike)
  t:ok(proposal.mutation_scale > 0.1 and proposal.mutation_rate > 0.1)
  t:ok(reason:find("robots have become alike: larger mutations", 1, true), reason)
  -- after the finest mutations
  stalled[8].parameters = copy(FIRST)
  stalled[8].parameters.mutation_scale = 0.02
  proposal, reason = ask(t, "rules", stalled)
  t:near(proposal.mutation_scale, 0.04)
  t:ok(reason:find("larger ones again", 1, true), reason)
  stalled[8].parameters = copy(FIRST)
  -- patience is an option; a negative best
  t:equal(ask(t, { "rules", patience = 9 }, stalled), nil)
  local negative = history_of { -5, -3, -3, -3, -3, -3, -3 }
  t:ok(ask(t, "rules", negative).mutation_scale < 0.1)
  -- the score under the first materials counts, where there is one
  for k, generation in ipairs(stalled) do generation.best_standard = k end
  t:equal(ask(t, "rules", stalled), nil)
end)

suite:test("rules answers falling diversity", function(t)
  local alike = history_of({ 1, 2, 3 }, { diversity = { all = { hamming = 0.08 } } })
  local proposal, reason = ask(t, "rules", alike)
  t:ok(proposal.mutation_scale > 0.1 and proposal.elite_fraction < 0.3)
  t:ok(reason:find("diversity fell to 10 %", 1, true), reason)
  t:equal(ask(t, { "rules", alike = 0.05 }, alike), nil)
end)

suite:test("rules answers many failures first", function(t)
  local failing = history_of({ 3, 3, 3, 3, 3, 3, 3 },
    { failed = { invalid = 4, diverged = 2, fitness = 0 },
      diversity = { all = { hamming = 0.1 } } })
  local proposal, reason = ask(t, "rules", failing)
  t:ok(proposal.mutation_scale < 0.1)
  t:ok(reason:find("6 of 10 robots failed", 1, true), reason)
end)

suite:test("rules returns to the first parameters when the run improves again", function(t)
  local wide = copy(FIRST)
  wide.mutation_scale = 0.2
  local proposal = ask(t, "rules", history_of({ 1, 2, 3 }, { parameters = wide }))
  t:equal(copy(proposal), { mutation_scale = proposal.mutation_scale })
  t:near(proposal.mutation_scale, 0.18)
end)

-- ---- self_adaptive and bandit -------------------------------------------------------------------

suite:test("self_adaptive inherits the scales of the generations that bred the best", function(t)
  local history = { entry(0, 1), entry(1, 2), entry(2, 3) }
  for k, generation in ipairs(history) do generation.parameters.mutation_scale = 0.1 * k end
  -- the three best of ten were bred in generation 1, with a scale of 0.2
  for i, robot in ipairs(history[3].population) do
    robot.generation, robot.fitness = i <= 3 and 1 or 2, i <= 3 and 10 + i or i / 10
  end
  local supervisor, low, high, sum = limax.supervise.get "self_adaptive", math.huge, 0, 0
  for k = 1, 2000 do
    local scale = supervisor.call(history, stream(k)).mutation_scale
    low, high, sum = math.min(low, scale), math.max(high, scale), sum + math.log(scale / 0.2)
  end
  t:ok(low >= 0.1 and low < 0.101 and high <= 0.4 and high > 0.398, low .. " " .. high)
  -- log-uniform: a mean of 0 within five standard errors, (2 log 2) / sqrt(12 n)
  t:ok(math.abs(sum / 2000) < 5 * 2 * math.log(2) / math.sqrt(12 * 2000))
  local proposal, reason = ask(t, { "self_adaptive", span = 1.5 }, history)
  t:ok(proposal.mutation_scale > 0.2 / 1.5 and proposal.mutation_scale < 0.3)
  t:ok(reason:find("was bred with scale 0.2", 1, true), reason)
  -- parents = 1: the others' scale as well
  local seen = {}
  for k = 1, 50 do
    local all = limax.supervise.get { "self_adaptive", parents = 1 }
    local _, text = all.call(history, stream(k))
    seen[text:match "scale ([%d.]+)"] = true
  end
  t:equal(seen, { ["0.2"] = true, ["0.3"] = true })
end)

-- A history in which generation k had these factors on the first rate and scale, and this best.
local function played(list)
  local history = { entry(0, 1) }
  for k, row in ipairs(list) do
    local parameters = copy(FIRST)
    parameters.mutation_rate = row[1] * FIRST.mutation_rate
    parameters.mutation_scale = row[2] * FIRST.mutation_scale
    history[k + 1] = entry(k, row[3], { parameters = parameters })
  end
  return history
end

suite:test("bandit tries every setting, the nearest first, then the one with the best bound",
  function(t)
  local history, supervisor, seen = { entry(0, 1) }, limax.supervise.get "bandit", {}
  for k = 1, 9 do
    local proposal = supervisor.call(history)
    local parameters = copy(FIRST)
    for name, value in pairs(proposal) do parameters[name] = value end
    seen[("%g %g"):format(parameters.mutation_rate, parameters.mutation_scale)] = true
    history[k + 1] = entry(k, 1, { parameters = parameters })
  end
  for _, rate in ipairs { 0.05, 0.1, 0.2 } do
    for _, scale in ipairs { 0.05, 0.1, 0.2 } do
      t:ok(seen[("%g %g"):format(rate, scale)], ("%g %g"):format(rate, scale))
    end
  end
  -- all settings once; only (2, 0.5) found a new best
  local all = {}
  for _, rate in ipairs { 0.5, 1, 2 } do
    for _, scale in ipairs { 0.5, 1, 2 } do
      all[#all + 1] = { rate, scale, rate == 2 and scale == 0.5 and 5 or 1 }
    end
  end
  local proposal, reason = ask(t, "bandit", played(all))
  t:near({ proposal.mutation_rate, proposal.mutation_scale }, { 0.2, 0.05 })
  t:ok(reason:find("1 of 1 generations found a new best", 1, true), reason)
  t:near(tonumber(reason:match "bound ([%d.]+)"), 1 + 0.5 * math.sqrt(2 * math.log(9)),
    { rtol = 1e-2 })
  -- a failure each time: (2, 0.5) falls behind those that were tried less
  for _ = 1, 40 do all[#all + 1] = { 2, 0.5, 1 } end
  proposal = ask(t, "bandit", played(all))
  t:ok(proposal.mutation_rate ~= 0.2 or proposal.mutation_scale ~= 0.05)
end)

suite:test("bandit credits the setting nearest to what was applied", function(t)
  -- on the way from (1, 1) to (2, 2): nearer to the second
  local _, reason = ask(t, { "bandit", exploration = 0 }, played { { 1.8, 1.6, 9 }, { 1, 1, 1 },
    { 0.5, 0.5, 1 }, { 0.5, 1, 1 }, { 0.5, 2, 1 }, { 1, 0.5, 1 }, { 1, 2, 1 }, { 2, 0.5, 1 },
    { 2, 1, 1 } })
  t:equal(reason, "setting 9 of 9: 1 of 1 generations found a new best, bound 1")
end)

suite:test("a function is used as it is, a wrong name gets a suggestion", function(t)
  local own = function() return nil, "mine" end
  t:ok(limax.supervise.get(own).call == own)
  t:raises('did you mean "one_fifth"?', function() limax.supervise.get "one_fith" end)
end)
