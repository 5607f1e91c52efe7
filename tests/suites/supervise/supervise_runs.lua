--- supervise_runs.lua: supervisors over whole runs: those that use another run's parameters,
--- resumes, and a budget of evaluations.

local process = require "support.process"
local histories = require "support.histories"
local evolution = require "support.evolution"
local limax = require "limax"
local proposals = require "limax.supervise.proposals"

local suite = require("limax.test").suite "supervise_runs"

local entry, stream, ask = histories.entry, histories.stream, histories.ask

local SHORT = { duration = 0.1, settle = 0, accuracy = "preview" }

-- A small experiment whose supervisor may set everything.
local function free(supervisor, fields)
  return evolution.small(evolution.with({ simulation = SHORT, generations = 8,
    supervisor = supervisor, supervision = { materials = true } }, fields))
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

suite:test("no scheme of the library proposes before a generation is scored", function(t)
  local folder, tested = donor(t), 0
  for name, entry_of in pairs(limax.supervise.entries) do
    t:ok(entry_of.options and (entry_of.make or entry_of.start), name)
    if entry_of.make then
      local spec = entry_of.options.run and { name, run = folder } or name
      t:equal({ name, (ask(t, spec, {})) }, { name, nil })
      tested = tested + 1
    end
  end
  t:ok(tested >= 10, "all but the language model and its replay")
end)

suite:test("yoked repeats the bits of another run's parameters and materials", function(t)
  local folder, other = donor(t)
  local history = run_to(t:folder() .. "/own", free({ "yoked", run = folder }, { seed = 5 }))
  t:same_bits(settings(history), settings(other))
  t:ok(other[8].parameters.mutation_scale ~= other[1].parameters.mutation_scale)
  t:ok(history[8].ledger.reason:find(("generation 7 of repetition 1 of %s (random)"):format(folder),
    1, true), history[8].ledger.reason)
  for _, one in ipairs(history[8].ledger.entries) do t:equal(one.outcome, "accepted") end
  -- where materials may not change only the parameters follow
  history = run_to(t:folder() .. "/plain", free({ "yoked", run = folder },
    { supervision = { materials = false } }))
  t:same_bits(history[8].parameters, other[8].parameters)
  t:equal(history[8].materials, history[1].materials)
end)

suite:test("shuffled uses every setting of the other run once, in another order", function(t)
  local folder, other = donor(t)
  local supervisor = limax.supervise.get { "shuffled", run = folder }
  local limits, seen, moved = proposals.limits(6), {}, 0
  for generation = 0, 6 do
    local proposal, reason = supervisor.call({ entry(generation, 1) }, stream(), limits)
    local from = tonumber(reason:match "^generation (%d+) of ")
    t:ok(not seen[from])
    seen[from] = true
    moved = moved + (from ~= generation + 1 and 1 or 0)
    t:equal(proposal.mutation_rate, other[from + 1].parameters.mutation_rate)
    t:equal(proposal.materials.bone.stiffness, other[from + 1].materials.materials[5].stiffness)
  end
  t:equal(#seen, 7)
  t:ok(moved > 0)
  t:equal(supervisor.call({ entry(7, 1) }, stream(), limits), nil)
end)

suite:test("constant_median proposes each field's median over the bred generations", function(t)
  local folder, other = donor(t)
  local scales = {}
  for k = 2, 8 do scales[k - 1] = other[k].parameters.mutation_scale end
  table.sort(scales)
  local proposal = ask(t, { "constant_median", run = folder }, { entry(3, 1) })
  t:equal(proposal.mutation_scale, scales[4])
  t:ok(proposal.materials.bone.stiffness > 0)
end)

suite:test("an unsuitable run is refused before the experiment begins", function(t)
  local folder = donor(t)
  local function refused(text, options, fields)
    t:raises(text, function()
      free(evolution.with({ "yoked", run = folder }, options), fields)
    end)
  end
  refused("has 8 generations, this experiment 9", {}, { generations = 9 })
  refused("began with another population", {}, { population = 8 })
  refused("began with another breeding", {}, { breeding = { mutation_rate = 0.2 } })
  refused("had other limits: supervision.ranges", {},
    { supervision = { materials = true, ranges = { mutation_rate = { 0.01, 0.2 } } } })
  refused("has no repetition 2", { repetition = 2 })
  refused("is not a run folder", { run = folder .. "/r01" })
  local text = process.read(folder .. "/journal.jsonl")
  process.write(folder .. "/journal.jsonl", (text:gsub("[^\n]*\n$", "")))
  refused("is not done (stopped)", {})
end)

-- ---- a resume -----------------------------------------------------------------------------------

suite:test("supervisors keep no state outside of the history: a resume gives the same bytes",
  { limit = 60 }, function(t)
    local other = donor(t)
    for _, spec in ipairs { "random", "self_adaptive", "bandit", { "shuffled", run = other } } do
      evolution.resumes(t, { simulation = SHORT, supervisor = spec,
        supervision = { materials = true } })
    end
  end)

-- ---- a budget of evaluations --------------------------------------------------------------------

suite:test("a budget of evaluations ends a run before a population that may exceed it", function(t)
  local function spent(evaluations, fields)
    local history, sum = evolution.finished(evolution.with({ evaluations = evaluations,
      generations = 50, population = 10, simulation = SHORT }, fields)), 0
    for _, generation in ipairs(history) do sum = sum + generation.evaluations end
    return sum, #history
  end
  -- 10, then 7 per generation, since 3 elites keep their scores; after 31 of 40, 10 do not fit
  t:equal({ spent(40) }, { 31, 4 })
  t:equal({ spent(41) }, { 38, 5 })
  t:equal({ spent(10) }, { 10, 1 })
  t:equal({ spent(40, { generations = 2 }) }, { 17, 2 })
  -- with other materials elites are simulated again and count
  t:equal({ spent(40, { supervision = { materials = true }, supervisor = function(history)
    return { materials = { bone = { stiffness = 1e4 * (1 + 0.01 * #history) } } }
  end }) }, { 40, 4 })
  t:raises("evaluations: expected at least one population, 10 robots, got 9",
    function() spent(9) end)
end)
