--- robot_list.lua: the best robots of the last generations of a run, as `limax list --robots`
--- prints them.

local choice = require "limax.base.choice"
local failure = require "limax.base.failure"
local rows = require "limax.robot.rows"
local sorting = require "limax.base.sorting"
local terminal = require "limax.base.terminal"

local robot_list = {}

-- The column of a measure that the fitness returned by name.
local function measure_column(name)
  return { terminal.word(name), function(each) return (each.row.measures or {})[name] end }
end

local function columns_of(list)
  local columns = { { "id", function(each) return ("%d"):format(each.row.id) end },
    { "repetition", function(each) return each.repetition end },
    { "generation", function(each) return ("%d"):format(each.row.generation) end },
    { "fitness", function(each) return each.row.fitness end },
    { "parents", function(each)
      local ids = {}
      for k, id in ipairs(each.row.parents) do ids[k] = ("%d"):format(id) end
      return ids[1] and table.concat(ids, "+")
    end },
    { "distance", function(each) return each.distance end },
    { "speed", function(each) return each.speed end } }
  local names = {}
  for _, each in ipairs(list) do
    for name in pairs(each.row.measures or {}) do names[name] = true end
  end
  for _, name in ipairs(choice.sorted_keys(names)) do
    columns[#columns + 1] = measure_column(name)
  end
  columns[#columns + 1] = { "body", function(each)
    local body = each.row.body
    return body and ("%dx%dx%d"):format(unpack(body.size))
  end }
  columns[#columns + 1] = { "voxels", function(each)
    return each.row.body and each.row.body.voxels
  end }
  return columns
end

local function finite(value) return value - value == 0 and value or nil end

-- A robot with its distance (m) and speed (m/s) in the first trial; a foreign file may hold any
-- numbers.
local function measured(repetition, row)
  local each, outcome = { repetition = repetition, row = row }, rows.done(row)
  if outcome then
    local first, last = outcome.center_start, outcome.center_end
    local distance = math.sqrt((last[0] - first[0]) ^ 2 + (last[1] - first[1]) ^ 2)
    each.distance, each.speed = finite(distance), finite(distance / outcome.time)
  end
  return each
end

--- A table of the best robots of the last generation of each repetition.
---@param folder limax.report.folder
---@param most integer robots
function robot_list.text(folder, most, style)
  local all, scores, best = {}, {}, {}
  for _, run in ipairs(folder.runs) do
    local seen = {} -- a robot may be on several islands
    for _, row in ipairs(run.folder:rows(run.repetition, run.folder:last(run.repetition))) do
      if row.fitness and not seen[row.id] then
        seen[row.id] = true
        all[#all + 1], scores[#scores + 1] = measured(run.repetition, row), row.fitness
      end
    end
  end
  if #all == 0 then
    failure.raise(1, ("%s: no robot of a last generation has a score"):format(folder.path))
  end
  for place, at in ipairs(sorting.descending(scores)) do
    if place <= most then best[place] = all[at] end
  end
  return terminal.rows(columns_of(best), best, style)
end

return robot_list
