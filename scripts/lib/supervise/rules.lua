--- rules.lua: the supervisor used when none is named: it needs no network and says in words what
--- it saw. In order: too many failures, robots that have become alike, a stall (of a diverse
--- population, whose search is too coarse, or of one that is nearly alike, whose search is too
--- narrow), and else a slow way back to the experiment's own parameters. The rules are ours; that
--- lost diversity asks for exploration is Ursem's, "Diversity-guided evolutionary algorithms"
--- (2002).

local schema = require "limax.engine.schema"

local function best_of(entry) return entry.best_standard or entry.best end

local function failures(entry)
  local failed = entry.failed or {}
  return (failed.invalid or 0) + (failed.diverged or 0) + (failed.fitness or 0)
end

-- Diversity now against that of the first generation; nil where one of them is not known.
local function diversity_left(history)
  local first, now = history[1].diversity.all, history[#history].diversity.all
  if first and now and first.hamming > 0 then return now.hamming / first.hamming end
end

-- Generations since the best rose by `share` of itself for the last time.
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

-- A fifth of the way from each parameter to the one that the run began with.
local function towards_first(now, first)
  local proposal
  for _, name in ipairs { "mutation_rate", "mutation_scale", "crossover_rate", "elite_fraction" } do
    local gap = first[name] - now[name]
    if math.abs(gap) > 0.01 * math.max(math.abs(first[name]), 0.01) then
      proposal = proposal or {}
      proposal[name] = now[name] + 0.2 * gap
    end
  end
  return proposal
end

-- A diverse population that stalls does not lack ideas: its offspring lose what it has found. So
-- the search is refined down to the finest step, and begins coarse again when that has not helped.
local function answer_stall(history, left, options, said)
  local now, first = history[#history].parameters, history[1].parameters
  local rate, scale = now.mutation_rate, now.mutation_scale
  if left and left <= options.diverse then
    return { mutation_rate = 1.2 * rate, mutation_scale = 1.2 * scale },
      said .. " and robots have become alike: larger mutations"
  end
  if scale > options.finest * first.mutation_scale then
    return { mutation_rate = 0.8 * rate, mutation_scale = 0.8 * scale },
      said .. " while robots still differ: smaller mutations"
  end
  return { mutation_rate = 2 * rate, mutation_scale = 2 * scale },
    said .. " by the finest mutations: larger ones again"
end

return {
  options = {
    patience = schema.number { value = 5, unit = "generations", minimum = 1, maximum = 1e6,
      integer = true, reason = "a good gait takes a few generations to be refined" },
    progress = schema.number { value = 0.02, unit = "of the best", minimum = 0, maximum = 10,
      reason = "less than this in all that time is a stall" },
    diverse = schema.number { value = 0.5, unit = "of the first generation's diversity",
      minimum = 0, maximum = 1, reason = "a stall above it is refined, one below it explored" },
    alike = schema.number { value = 0.25, unit = "of the first generation's diversity", minimum = 0,
      maximum = 1, reason = "below it crossover has little left to combine" },
    finest = schema.number { value = 0.25, unit = "of the first mutation scale", minimum = 0.01,
      maximum = 1, reason = "smaller steps hardly change a body within a run" },
  },
  make = function(options)
    return function(history)
      local now = history[#history]
      if not now then return nil, "nothing is scored yet" end
      local p = now.parameters
      local count = #now.population

      local failed = failures(now)
      if #history > 1 and failed > 0.5 * count then
        return { mutation_rate = 0.8 * p.mutation_rate, mutation_scale = 0.8 * p.mutation_scale },
          ("%d of %d robots failed: smaller mutations"):format(failed, count)
      end

      local left = diversity_left(history)
      if left and left < options.alike then
        local said = "diversity fell to %.0f %% of the first: larger mutations, fewer elites"
        return { mutation_rate = 1.25 * p.mutation_rate, mutation_scale = 1.25 * p.mutation_scale,
          elite_fraction = 0.8 * p.elite_fraction }, said:format(100 * left)
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
