--- measures.lua: numbers of an arm's runs: the share of generations that a language model set, the
--- outcomes of proposals, and without a claim the evaluations until the runs reached a target.

local proposals = require "limax.supervise.proposals"
local sample = require "limax.base.statistics.sample"

local measures = {}

--- Share of the generations that a model must have set for a claim about it.
measures.WHOLE = 0.95

-- Supervisors that ask a model, or repeat what one proposed.
local ASKS = { llm = true, replay = true }

--- The share of an arm's bred generations that a model set; nil for an arm that asks none.
--- Generations for which the model was not to be asked ("held") do not count.
---@return { share: number, generations: integer }|nil
function measures.model(list)
  local supervisor = list[1].config.supervisor
  local name = type(supervisor) == "table" and (supervisor.name or supervisor[1]) or supervisor
  if not ASKS[name] then return nil end
  local all, own = 0, 0
  for _, run in ipairs(list) do
    for _, line in ipairs(run.ledger) do
      -- generation 0 is not set by a supervisor
      if line.generation > 0 and line.source ~= "held" then
        all, own = all + 1, own + (line.source == "model" and 1 or 0)
      end
    end
  end
  return { share = all > 0 and own / all or 0, generations = all }
end

--- The number of proposed fields over all generations of all runs, and the share of each outcome.
function measures.proposals(list)
  local all = {}
  for _, run in ipairs(list) do
    for _, line in ipairs(run.ledger) do
      for _, entry in ipairs(line.entries or {}) do all[#all + 1] = entry end
    end
  end
  return proposals.shares { entries = all }
end

--- The best by evaluations: points { evaluations, value }, generation by generation. A generation
--- without a value repeats the one before. An evaluation is one simulation of a robot for its
--- score; elites that keep their score need none, those of a tuning come first.
function measures.points(run)
  local points, spent, before = {}, run.before, nil
  for _, line in ipairs(run.lines) do
    spent = spent + line.evaluations
    before = line.best_standard or before
    if before then points[#points + 1] = { spent, before } end
  end
  return points
end

--- The best of the last generation, under the first materials, as it was evolved.
function measures.last(run)
  local points = measures.points(run)
  return points[#points] and points[#points][2] or 0
end

-- Mean of the best so far between the first generation and the last, by evaluations.
local function area(points)
  local sum, best = 0, -math.huge
  for k, point in ipairs(points) do
    best = math.max(best, point[2])
    if points[k + 1] then sum = sum + best * (points[k + 1][1] - point[1]) end
  end
  local span = #points > 0 and points[#points][1] - points[1][1] or 0
  return span > 0 and sum / span or best
end

--- How many runs reached the target, the median of the evaluations that this took (runs that missed
--- it count as longer than all; nil if the median is one of them), and the centre of the area
--- under the curve, as a mean over evaluations.
---@return { reached: integer, evaluations: number|nil, area: number, areas: number[],
--- to_target: table<integer, number> }
function measures.exploratory(list, target)
  local hits, spent, areas, to_target = 0, {}, {}, {}
  for i, run in ipairs(list) do
    local points = measures.points(run)
    areas[i], spent[i] = area(points), math.huge
    for _, point in ipairs(points) do
      if point[2] >= target then
        hits, spent[i], to_target[i] = hits + 1, point[1], point[1]
        break
      end
    end
  end
  local median = sample.median(spent)
  return { reached = hits, evaluations = median < math.huge and median or nil,
    area = sample.centre(areas), areas = areas, to_target = to_target }
end

return measures
