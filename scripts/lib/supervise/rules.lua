--- rules.lua: the default supervisor, without a network. It reacts, in this order, to too many
--- failures, to low diversity and to a stall (a diverse population needs smaller mutations, one
--- that is not diverse larger ones), and otherwise slowly returns to the experiment's parameters.
--- The rules are ours; exploration after a loss of diversity is from Ursem, "Diversity-guided
--- evolutionary algorithms" (2002).

local proposals = require "limax.supervise.proposals"
local schema = require "limax.engine.schema"

local function best_of(entry) return entry.best_standard or entry.best end

local function failures(entry)
  local failed = entry.failed or {}
  return (failed.invalid or 0) + (failed.diverged or 0) + (failed.fitness or 0)
end

-- Diversity now relative to the first generation; nil if one of them is unknown.
local function diversity_left(history)
  local first, now = history[1].diversity.all, history[#history].diversity.all
  if first and now and first.hamming > 0 then return now.hamming / first.hamming end
end

-- Generations since the best last rose by `share` of itself.
local function stalled_for(history, share)
  local now = best_of(history[#history])
  if not now then return 0 end
  local generations = 0
  for k = #history - 1, 1, -1 do
    local before = best_of(history[k])
    if not before or now - before > share * math.abs(now) then break end
    generations = generations + 1
  end
  return generations
end

local MUTATIONS = { "mutation_rate", "mutation_scale", "control_mutation_rate",
  "control_mutation_scale" }

-- A proposal of mutations, of genes of control too, that are larger by a factor.
local function mutations(parameters, factor)
  local proposal = {}
  for _, name in ipairs(MUTATIONS) do
    proposal[name] = parameters[name] and factor * parameters[name]
  end
  return proposal
end

-- A fifth of the way from each parameter to its first value.
local function towards_first(now, first)
  local proposal
  for _, name in ipairs(proposals.parameters) do
    local gap = first[name] and first[name] - now[name] or 0
    if gap ~= 0 and math.abs(gap) > 0.01 * math.max(math.abs(first[name]), 0.01) then
      proposal = proposal or {}
      proposal[name] = now[name] + 0.2 * gap
    end
  end
  return proposal
end

-- The offspring of a diverse population that stalls lose what it has found: mutations become
-- smaller down to the finest, and then large again.
local function answer_stall(history, left, options, reason)
  local now, first = history[#history].parameters, history[1].parameters
  if left and left <= options.diverse then
    return mutations(now, 1.2), reason .. " and robots have become alike: larger mutations"
  end
  if now.mutation_scale > options.finest * first.mutation_scale then
    return mutations(now, 0.8), reason .. " while robots still differ: smaller mutations"
  end
  return mutations(now, 2), reason .. " by the finest mutations: larger ones again"
end

return {
  options = {
    patience = schema.number { value = 5, unit = "generations", minimum = 1, maximum = 1e6,
      integer = true, reason = "a good gait takes a few generations to be refined" },
    progress = schema.number { value = 0.02, unit = "of the best", minimum = 0, maximum = 10,
      reason = "less than this in all that time is a stall" },
    diverse = schema.number { value = 0.5, unit = "of the first generation's diversity",
      minimum = 0, maximum = 1, reason = "a stall makes mutations smaller above it, else larger" },
    alike = schema.number { value = 0.25, unit = "of the first generation's diversity", minimum = 0,
      maximum = 1, reason = "below it crossover has little left to combine" },
    finest = schema.number { value = 0.25, unit = "of the first mutation scale", minimum = 0.01,
      maximum = 1, reason = "smaller steps change a body too little within a run" },
  },
  changes = function() return { "elite_fraction", unpack(MUTATIONS) } end,
  make = function(options)
    return function(history)
      local now = history[#history]
      local p = now.parameters
      -- a rank of mpirun may have only its own robots in the list
      local count = now.population.count or #now.population

      local failed = failures(now)
      if #history > 1 and failed > 0.5 * count then
        return mutations(p, 0.8),
          ("%d of %d robots failed: smaller mutations"):format(failed, count)
      end

      local left = diversity_left(history)
      if left and left < options.alike then
        local reason = "diversity fell to %.0f %% of the first: larger mutations, fewer elites"
        local proposal = mutations(p, 1.25)
        proposal.elite_fraction = 0.8 * p.elite_fraction
        return proposal, reason:format(100 * left)
      end

      local stalled = stalled_for(history, options.progress)
      if stalled >= options.patience then
        return answer_stall(history, left, options, ("the best rose by less than %.3g %% in %d "
          .. "generations"):format(100 * options.progress, stalled))
      end

      local proposal = towards_first(p, history[1].parameters)
      if proposal then return proposal, "improving: back towards the first parameters" end
      return nil, "improving: nothing to change"
    end
  end,
}
