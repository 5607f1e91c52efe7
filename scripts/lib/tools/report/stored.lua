--- stored.lua: reads archives and objectives of a run folder: the rows of an archive, the last
--- Pareto front, and bodies.

local archive = require "limax.archive"
local archived = require "limax.evolution.archived"
local failure = require "limax.base.failure"
local front = require "limax.experiment.front"
local sorting = require "limax.base.sorting"
local survival = require "limax.survival"

local stored = {}

-- Letters of the bodies of one map: half a megabyte of a page.
local MOST_LETTERS = 5e5

--- A part of a configuration as an experiment names it. Functions of a script are not called here.
---@param value any of config.json
function stored.spec_of(value)
  if type(value) ~= "table" then return value end
  local spec = {}
  for key, entry in pairs(value) do
    if key ~= "function" and key ~= "name" then spec[key] = stored.spec_of(entry) end
  end
  if value["function"] then
    spec[1], spec.name = function() return 0 end, value.name
  else
    spec[1] = value.name or spec[1]
  end
  return spec
end

-- The archive or the survival of a run; nil if it has none, or one without a list of measures.
local function definition_of(run, field, library)
  local value = run.config[field]
  if type(value) ~= "table" or value["function"] then return nil end
  return failure.about(run.path .. "/config.json", library.get,
    stored.spec_of(value))
end

-- The robots of a generation; none where they are not kept.
local function robots_of(run, generation)
  if not run.folder:has_robots(run.repetition, generation) then return {} end
  return run.folder:rows(run.repetition, generation)
end

-- The rows of an archive at the end.
local function replay(run, definition)
  local kept
  for _, line in ipairs(run.lines) do
    kept = archived.replay(kept, definition, line.generation, robots_of(run, line.generation))
  end
  return kept.rows
end

--- Adds to rows the letters of their bodies, of the best first, while there is room.
function stored.add_letters(run, rows)
  local scores, files, count = {}, {}, 0
  for k, row in ipairs(rows) do scores[k] = row.fitness end
  for _, at in ipairs(sorting.descending(scores)) do
    local row = rows[at]
    if count > MOST_LETTERS then return end
    files[row.generation] = files[row.generation] or robots_of(run, row.generation)
    local robot = files[row.generation][row.index]
    row.letters = robot and robot.id == row.id and robot.letters or nil
    count = count + #(row.letters or "")
  end
end

--- The archive of a run that has one with descriptors, and its rows at the end.
function stored.archive(run)
  local definition = definition_of(run, "archive", archive)
  if not definition or not definition.descriptors then return nil end
  return definition, replay(run, definition)
end

-- Rows that no other row dominates, by the first objective.
local function best_of(rows, objectives)
  local list, sorted, firsts = {}, {}, {}
  for k, at in ipairs(front.of(front.points(rows, objectives))) do list[k] = rows[at] end
  for k, row in ipairs(list) do firsts[k] = row.objectives[1] end
  for k, at in ipairs(sorting.ascending(firsts)) do sorted[k] = list[at] end
  return sorted
end

--- The last front of a run with objectives: of its Pareto archive, else of its population.
function stored.front(run)
  local definition = definition_of(run, "archive", archive)
  if definition and definition.objectives then
    return definition.objectives, best_of(replay(run, definition), definition.objectives)
  end
  local scheme = definition_of(run, "survival", survival)
  if not scheme or not scheme.objectives then return nil, {} end
  local generation, rows = run.lines[#run.lines].generation, {}
  for k, robot in ipairs(robots_of(run, generation)) do
    if robot.objectives and robot.fitness then
      rows[#rows + 1] = { id = robot.id, generation = generation, index = k,
        fitness = robot.fitness, objectives = robot.objectives }
    end
  end
  return scheme.objectives, best_of(rows, scheme.objectives)
end

return stored
