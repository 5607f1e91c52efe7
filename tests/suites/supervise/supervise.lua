--- supervise.lua: the proposals of supervisors for histories made by hand.

local evolution = require "support.evolution"
local histories = require "support.histories"
local limax = require "limax"
local proposals = require "limax.supervise.proposals"

local suite = require("limax.test").suite "supervise"

local PARAMETERS = limax.supervise.parameters
local FIRST, entry = histories.FIRST, histories.entry
local history_of, stream, ask = histories.history_of, histories.stream, histories.ask

local function changed(fields) return evolution.with(FIRST, fields) end

-- A stall after three generations, with fields of the last one.
local function stalled(last) return history_of({ 1, 2, 3, 3, 3.01, 3.02, 3.02, 3.03 }, last) end

local function standard_scores()
  local history = stalled()
  for k, generation in ipairs(history) do generation.best_standard = k end
  return history
end

-- Two generations: parents that score 1 to 10, and offspring of parents 3 and 5 with these scores;
-- false for one that failed, nil for elites.
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

-- A family of which all offspring win, and a generation of theirs that all lose.
local function three_generations()
  local history, later = family { 6, 6, 6, 6, 6, 6, 6, 6, 6, 6 }, entry(2, 10)
  for i = 1, 10 do
    later.population[i] = { id = 200 + i, origin = "bred", parents = { 101 }, fitness = 1 }
  end
  history[3] = later
  return history
end

local function scheduled(shape)
  return { "schedule", shape = shape, mutation_scale = { { 2, 0.4 }, { 6, 0.1 } } }
end

-- Supervisor, history, proposal, text of the reason.
local PROPOSALS = {
  { "fixed", history_of { 1, 1, 1, 1, 1, 1, 1, 1 }, nil, "fixed parameters" },

  { scheduled(), { entry(0, 1) }, { mutation_scale = 0.4 }, "schedule for generation 1" },
  { scheduled(), { entry(3, 1) }, { mutation_scale = 0.25 } },
  { scheduled "geometric", { entry(3, 1) }, { mutation_scale = 0.2 } },
  { scheduled "step", { entry(3, 1) }, { mutation_scale = 0.4 } },
  { scheduled "step", { entry(5, 1) }, { mutation_scale = 0.1 } },
  { scheduled(), { entry(90, 1) }, { mutation_scale = 0.1 } },

  { { "one_fifth", factor = 1.5 }, family { 6, 6, 6, 4, 4, 4, 4, 4, 4, 5 },
    { mutation_scale = 0.15 }, "3 of 10 offspring" },
  { { "one_fifth", factor = 1.5 }, family { 6, 4, 4, 4, 4, 4, 4, 4, 4, 4 },
    { mutation_scale = 0.1 * 1.5 ^ -0.25 } },
  -- exactly a fifth, and failed offspring count as tried
  { "one_fifth", family { 6, 6, 4, 4, 4, false, false, 4, 4, 4 }, nil, "exactly a fifth" },
  -- elites are not offspring
  { "one_fifth", family { 6, 4, 4 }, { mutation_scale = 0.15 }, "1 of 3" },
  { "one_fifth", { entry(0, 1) }, nil, "no offspring" },
  { { "one_fifth", window = 2 }, three_generations(), { mutation_scale = 0.15 }, "10 of 20" },
  { { "one_fifth", window = 1 }, three_generations(), { mutation_scale = 0.1 * 1.5 ^ -0.25 },
    "0 of 10" },

  { "rules", history_of { 1, 2, 3 }, nil, "improving: nothing to change" },
  { "rules", stalled(), { mutation_rate = 0.08, mutation_scale = 0.08 },
    "less than 2 % in 5 generations while robots still differ" },
  { "rules", stalled { diversity = { all = { hamming = 0.3 } } },
    { mutation_rate = 0.12, mutation_scale = 0.12 }, "robots have become alike: larger mutations" },
  { "rules", stalled { parameters = changed { control_mutation_scale = 0.5 } },
    { mutation_rate = 0.08, mutation_scale = 0.08, control_mutation_scale = 0.4 } },
  -- after the finest mutations
  { "rules", stalled { parameters = changed { mutation_scale = 0.02 } },
    { mutation_rate = 0.2, mutation_scale = 0.04 }, "larger ones again" },
  { { "rules", patience = 9 }, stalled(), nil, "improving" },
  { "rules", history_of { -5, -3, -3, -3, -3, -3, -3 },
    { mutation_rate = 0.08, mutation_scale = 0.08 }, "rose by less than" },
  -- the score under the first materials counts, where there is one
  { "rules", standard_scores(), nil, "improving" },
  { "rules", history_of({ 1, 2, 3 }, { diversity = { all = { hamming = 0.08 } } }),
    { mutation_rate = 0.125, mutation_scale = 0.125, elite_fraction = 0.24 },
    "diversity fell to 10 %" },
  { { "rules", alike = 0.05 },
    history_of({ 1, 2, 3 }, { diversity = { all = { hamming = 0.08 } } }), nil, "improving" },
  -- failures come first
  { "rules", history_of({ 3, 3, 3, 3, 3, 3, 3 }, { diversity = { all = { hamming = 0.1 } },
    failed = { invalid = 4, diverged = 2, fitness = 0 } }),
    { mutation_rate = 0.08, mutation_scale = 0.08 }, "6 of 10 robots failed" },
  { "rules", history_of({ 1, 2, 3 }, { parameters = changed { mutation_scale = 0.2 } }),
    { mutation_scale = 0.18 }, "back towards the first parameters" },
}

suite:test("each scheme's proposal for a history", function(t)
  for k, row in ipairs(PROPOSALS) do
    local spec, history, expected, text = unpack(row, 1, 4)
    local proposal, reason = ask(t, spec, history)
    local name = ("row %d, %s: %s"):format(k, type(spec) == "table" and spec[1] or spec, reason)
    t:ok((proposal == nil) == (expected == nil), name)
    t:near({ k, proposal or {} }, { k, expected or {} })
    t:ok(not text or reason:find(text, 1, true), name)
  end
end)

suite:test("a schedule whose generations do not rise is refused", function(t)
  t:raises("does not come after", function()
    limax.supervise.get { "schedule", mutation_scale = { { 5, 1 }, { 5, 2 } } }
  end)
end)

suite:test("random stays in the ranges, makes allowed steps, and covers the ranges", function(t)
  local list = proposals.limits(10, { crossover_rate = { 0.4, 0.41 } },
    { hyperparameters = true, materials = false })
  local limits = {}
  for _, limit in ipairs(list) do limits[limit.field] = limit end
  local supervisor, random = limax.supervise.get "random", stream()
  local now, low, high = entry(0, 1), {}, {}
  now.parameters.control_mutation_rate, now.parameters.control_mutation_scale = 0.1, 0.1
  for _, name in ipairs(PARAMETERS) do low[name], high[name] = math.huge, -math.huge end
  for _ = 1, 3000 do
    local before = now.parameters
    now.parameters = supervisor.call({ now }, random, list)
    for _, name in ipairs(PARAMETERS) do
      local limit, value = limits[name], now.parameters[name]
      t:ok(value >= limit.minimum and value <= limit.maximum, name)
      local ratio, step = value / before[name], math.abs(value - before[name])
      t:ok(limit.factor and math.max(ratio, 1 / ratio) < limit.factor * (1 + 1e-12)
        or limit.step and step < limit.step * (1 + 1e-9), name)
      low[name], high[name] = math.min(low[name], value), math.max(high[name], value)
    end
  end
  for _, name in ipairs(PARAMETERS) do
    local limit = limits[name]
    local range = limit.maximum - limit.minimum
    t:ok(low[name] < limit.minimum + 0.05 * range, name)
    t:ok(high[name] > limit.maximum - 0.2 * range, name)
  end
end)

-- ---- self_adaptive and bandit -------------------------------------------------------------------

suite:test("self_adaptive inherits the scales of the generations that bred the best", function(t)
  local history = { entry(0, 1), entry(1, 2), entry(2, 3) }
  for k, generation in ipairs(history) do generation.parameters.mutation_scale = 0.1 * k end
  -- the three best of ten were bred in generation 1, with a scale of 0.2
  for i, robot in ipairs(history[3].population) do
    robot.generation, robot.fitness = i <= 3 and 1 or 2, i <= 3 and 10 + i or i / 10
  end
  history[3].population.ranked = { 3, 2, 1, 10, 9, 8, 7, 6, 5, 4 }
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
end)

-- A history in which generation k had these factors on the first rate and scale, and this best.
local function played(list)
  local history = { entry(0, 1) }
  for k, row in ipairs(list) do
    history[k + 1] = entry(k, row[3], { parameters = changed { mutation_rate = 0.1 * row[1],
      mutation_scale = 0.1 * row[2] } })
  end
  return history
end

suite:test("bandit tries every setting, then the one with the best bound", function(t)
  local history, supervisor, seen = { entry(0, 1) }, limax.supervise.get "bandit", {}
  for k = 1, 9 do
    local parameters = changed(supervisor.call(history))
    seen[("%g %g"):format(parameters.mutation_rate, parameters.mutation_scale)] = true
    history[k + 1] = entry(k, 1, { parameters = parameters })
  end
  -- all settings once; only (2, 0.5) found a new best
  local all = {}
  for _, rate in ipairs { 0.5, 1, 2 } do
    for _, scale in ipairs { 0.5, 1, 2 } do
      t:ok(seen[("%g %g"):format(0.1 * rate, 0.1 * scale)], rate .. " " .. scale)
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
