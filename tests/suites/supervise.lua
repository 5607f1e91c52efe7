--- supervise.lua: what the supervisors propose for histories made by hand. Each is asked twice: the
--- same history gives the same proposal.

local evolution = require "support.evolution"
local generations_kept = require("limax.history").genomes_kept
local host = require "limax.host"
local limax = require "limax"
local ledger = require "limax.ledger"
local run_folder = require "limax.run_folder"
local source = require "limax.source"
local suite = require("limax.test").suite "supervise"

local PARAMETERS = { "mutation_rate", "mutation_scale", "crossover_rate", "elite_fraction" }
local FIRST = { mutation_rate = 0.1, mutation_scale = 0.1, crossover_rate = 0.4,
  elite_fraction = 0.3 }

local function copy(given)
  local made = {}
  for key, value in pairs(given) do made[key] = value end
  return made
end

-- One generation: best score, and what else differs from a quiet one of ten robots.
local function entry(generation, best, given)
  local made = { generation = generation, best = best, mean = best / 2, parameters = copy(FIRST),
    population = {}, failed = { invalid = 0, diverged = 0, fitness = 0 },
    diversity = { all = { hamming = 0.8 } } }
  for i = 1, 10 do
    made.population[i] = { id = 10 * generation + i, origin = "bred", parents = {}, fitness = 0 }
  end
  for key, value in pairs(given or {}) do made[key] = value end
  return made
end

-- Best scores of a history, generation by generation.
local function history_of(scores, last)
  local history = {}
  for k, score in ipairs(scores) do
    history[k] = entry(k - 1, score, k == #scores and last or nil)
  end
  return history
end

local function stream(individual)
  return limax.engine.random(7, 1, "supervision", 3, individual or 0)
end

-- What a supervisor says, asked twice.
local function ask(t, spec, history)
  local supervisor = limax.supervise.get(spec)
  local proposal, reason = supervisor.call(history, stream(), ledger.limits(10))
  local again, same = supervisor.call(history, stream(), ledger.limits(10))
  t:equal(proposal, again)
  t:equal(reason, same)
  t:equal(type(reason), "string")
  return proposal, reason
end

suite:test("nobody proposes anything before a generation is scored", function(t)
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

suite:test("random walks inside the ranges, by allowed steps, and covers them", function(t)
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

suite:test("random keeps to the ranges that an experiment narrows", function(t)
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
    -- proposed inside the ranges: nothing is left for the ledger to clamp
    for _, fate in ipairs(generation.ledger.entries) do
      t:ok(fate.outcome ~= "clamped", ("%s: %s"):format(fate.field, tostring(fate.reason)))
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
  -- elites are no offspring
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

suite:test("rules leaves a run that improves alone", function(t)
  t:equal(ask(t, "rules", history_of { 1, 2, 3 }), nil)
end)

suite:test("rules answers a stall by refining, or by exploring if robots are alike", function(t)
  local stalled = history_of { 1, 2, 3, 3, 3.01, 3.02, 3.02, 3.03 }
  local proposal, reason = ask(t, "rules", stalled)
  t:ok(proposal.mutation_scale < 0.1 and proposal.mutation_rate < 0.1)
  t:ok(reason:find("less than 2 % in 5 generations while robots still differ", 1, true), reason)
  local alike = history_of({ 1, 2, 3, 3, 3.01, 3.02, 3.02, 3.03 },
    { diversity = { all = { hamming = 0.3 } } })
  proposal, reason = ask(t, "rules", alike)
  t:ok(proposal.mutation_scale > 0.1 and proposal.mutation_rate > 0.1)
  t:ok(reason:find("robots have become alike: larger mutations", 1, true), reason)
  -- the finest mutations have had their time
  stalled[8].parameters = copy(FIRST)
  stalled[8].parameters.mutation_scale = 0.02
  proposal, reason = ask(t, "rules", stalled)
  t:near(proposal.mutation_scale, 0.04)
  t:ok(reason:find("larger ones again", 1, true), reason)
  stalled[8].parameters = copy(FIRST)
  -- patience is an option, and a negative best is no special case
  t:equal(ask(t, { "rules", patience = 9 }, stalled), nil)
  local negative = history_of { -5, -3, -3, -3, -3, -3, -3 }
  t:ok(ask(t, "rules", negative).mutation_scale < 0.1)
  -- what counts is the score under the first materials, where there is one
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

suite:test("rules goes back when the run improves again", function(t)
  local wide = copy(FIRST)
  wide.mutation_scale = 0.2
  local proposal = ask(t, "rules", history_of({ 1, 2, 3 }, { parameters = wide }))
  t:equal(copy(proposal), { mutation_scale = proposal.mutation_scale })
  t:near(proposal.mutation_scale, 0.18)
end)

-- ---- self_adaptive and bandit -------------------------------------------------------------------

suite:test("self_adaptive: the scales of the generations that bred the best live on", function(t)
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
    local _, said = limax.supervise.get({ "self_adaptive", parents = 1 }).call(history, stream(k))
    seen[said:match "scale ([%d.]+)"] = true
  end
  t:equal(seen, { ["0.2"] = true, ["0.3"] = true })
end)

-- A history in which generation k had these factors on the first rate and scale, and this best.
local function played(list)
  local history = { entry(0, 1) }
  for k, given in ipairs(list) do
    local parameters = copy(FIRST)
    parameters.mutation_rate = given[1] * FIRST.mutation_rate
    parameters.mutation_scale = given[2] * FIRST.mutation_scale
    history[k + 1] = entry(k, given[3], { parameters = parameters })
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

-- ---- another run's parameters -------------------------------------------------------------------

local SHORT = { duration = 0.1, settle = 0, accuracy = "preview" }

-- A small experiment whose supervisor may set everything.
local function free(supervisor, fields)
  local given = { simulation = SHORT, generations = 8, supervisor = supervisor,
    supervision = { materials = true } }
  for name, value in pairs(fields or {}) do given[name] = value end
  return evolution.small(given)
end

local function run_to(folder, experiment)
  return limax.start(experiment, { out = folder, say = evolution.silent }):finish()
end

-- A finished run of random steps to read from.
local function donor(t, fields)
  local folder = t:folder() .. "/donor"
  return folder, run_to(folder, free("random", fields))
end

-- Parameters and materials by generation.
local function settings(history)
  local list = {}
  for k, generation in ipairs(history) do
    list[k] = { generation.parameters, generation.materials }
  end
  return list
end

suite:test("yoked repeats another run's parameters and materials to the bit", function(t)
  local folder, given = donor(t)
  local history = run_to(t:folder() .. "/own", free({ "yoked", run = folder }, { seed = 5 }))
  t:same_bits(settings(history), settings(given))
  t:ok(given[8].parameters.mutation_scale ~= given[1].parameters.mutation_scale)
  t:ok(history[8].ledger.reason:find(("generation 7 of repetition 1 of %s (random)"):format(folder),
    1, true), history[8].ledger.reason)
  for _, fate in ipairs(history[8].ledger.entries) do t:equal(fate.outcome, "accepted") end
  -- without leave for materials only the parameters follow
  history = run_to(t:folder() .. "/plain", free({ "yoked", run = folder },
    { supervision = { materials = false } }))
  t:same_bits(history[8].parameters, given[8].parameters)
  t:equal(history[8].materials, history[1].materials)
end)

suite:test("shuffled asks for every setting of the other run once, in another order", function(t)
  local folder, given = donor(t)
  local supervisor = limax.supervise.get { "shuffled", run = folder }
  local limits, seen, moved = ledger.limits(6), {}, 0
  for generation = 0, 6 do
    local proposal, reason = supervisor.call({ entry(generation, 1) }, stream(), limits)
    local from = tonumber(reason:match "^generation (%d+) of ")
    t:ok(not seen[from])
    seen[from] = true
    moved = moved + (from ~= generation + 1 and 1 or 0)
    t:equal(proposal.mutation_rate, given[from + 1].parameters.mutation_rate)
    t:equal(proposal.materials.bone.stiffness, given[from + 1].materials.materials[5].stiffness)
  end
  t:equal(#seen, 7)
  t:ok(moved > 0)
  t:equal(supervisor.call({ entry(7, 1) }, stream(), limits), nil)
  local other = limax.supervise.get { "shuffled", run = folder, seed = 2 }
  local differs = false
  for generation = 0, 6 do
    local _, a = supervisor.call({ entry(generation, 1) }, stream(), limits)
    local _, b = other.call({ entry(generation, 1) }, stream(), limits)
    differs = differs or a ~= b
  end
  t:ok(differs, "another seed, another order")
end)

suite:test("constant_median proposes each field's median over the bred generations", function(t)
  local folder, given = donor(t)
  local scales = {}
  for k = 2, 8 do scales[k - 1] = given[k].parameters.mutation_scale end
  table.sort(scales)
  local proposal = ask(t, { "constant_median", run = folder }, { entry(3, 1) })
  t:equal(proposal.mutation_scale, scales[4])
  t:ok(proposal.materials.bone.stiffness > 0)
end)

suite:test("a run that cannot lend its parameters is refused before anything runs", function(t)
  local folder = donor(t)
  local function refused(text, options, fields)
    local spec = { "yoked", run = folder }
    for name, value in pairs(options) do spec[name] = value end
    t:raises(text, function() free(spec, fields) end)
  end
  refused("has 8 generations, this experiment 9", {}, { generations = 9 })
  refused("began with another population", {}, { population = 8 })
  refused("began with another breeding", {}, { breeding = { mutation_rate = 0.2 } })
  refused("had other limits: supervision.ranges", {},
    { supervision = { materials = true, ranges = { mutation_rate = { 0.01, 0.2 } } } })
  refused("has no repetition 2", { repetition = 2 })
  refused("is no run folder", { run = folder .. "/r01" })
  t:raises('expected the folder of another run, got nil', function() free "yoked" end)
  assert(host.file.write_atomic(folder .. "/STATUS", '{"state":"running"}'))
  refused("is not done (running)", {})
end)

-- ---- a resume -----------------------------------------------------------------------------------

suite:test("no supervisor keeps anything outside of history: a resume gives the same bytes",
  { limit = 60 }, function(t)
  local short, lender = { generations = 6 }, donor(t)
  for _, spec in ipairs { "random", "one_fifth", "rules", "self_adaptive", "bandit",
    { "yoked", run = lender }, { "shuffled", run = lender }, { "constant_median", run = lender } }
  do
    local name = type(spec) == "table" and spec[1] or spec
    local whole, parts = t:folder() .. "/whole-" .. name, t:folder() .. "/parts-" .. name
    run_to(whole, free(spec, short))
    local begun = limax.start(free(spec, short), { out = parts, say = evolution.silent })
    for robots in begun:generations() do
      if robots.generation == 3 then break end
      robots:simulate():score():breed()
    end
    begun.folder:close()
    local folder = run_folder.open(parts)
    local run = limax.start(free(spec, short), { folder = folder, say = evolution.silent })
    run:restore(folder:generations(1, generations_kept), true)
    run:finish()
    folder:close()
    for _, file in ipairs { "metrics.jsonl", "ledger.jsonl", "r01/population/g0005.jsonl" } do
      t:ok(source.read(parts .. "/" .. file) == source.read(whole .. "/" .. file),
        name .. ": " .. file)
    end
  end
end)

-- ---- a budget of evaluations --------------------------------------------------------------------

suite:test("evaluations end a run while a whole population may not fit any more", function(t)
  local function spent(evaluations, fields)
    local given = { evaluations = evaluations, generations = 50, population = 10,
      simulation = SHORT }
    for name, value in pairs(fields or {}) do given[name] = value end
    local history, sum = evolution.finished(given), 0
    for _, generation in ipairs(history) do sum = sum + generation.evaluations end
    return sum, #history
  end
  -- 10, then 7 a generation, for 3 elites keep their scores: 31 leaves no room for 10 of 40
  t:equal({ spent(40) }, { 31, 4 })
  t:equal({ spent(41) }, { 38, 5 })
  t:equal({ spent(10) }, { 10, 1 })
  t:equal({ spent(40, { generations = 2 }) }, { 17, 2 })
  -- other materials: elites are simulated again, and count
  t:equal({ spent(40, { supervision = { materials = true }, supervisor = function(history)
    return { materials = { bone = { stiffness = 1e4 * (1 + 0.01 * #history) } } }
  end }) }, { 40, 4 })
  t:raises("evaluations: expected at least one population, 10 robots, got 9",
    function() spent(9) end)
end)

suite:test("a function is taken as it is, a wrong name says what was meant", function(t)
  local own = function() return nil, "mine" end
  t:ok(limax.supervise.get(own).call == own)
  t:raises('did you mean "one_fifth"?', function() limax.supervise.get "one_fith" end)
end)
