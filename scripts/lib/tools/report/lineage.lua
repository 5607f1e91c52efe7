--- lineage.lua: the ancestors of a champion, from the parents of all robots, and the line
--- from generation 0 through the better parent of each.

local rows = require "limax.robot.rows"
local runs = require "limax.tools.report.runs"

local lineage = {}

---@class limax.report.ancestor
---@field id integer
---@field generation integer in which it first appeared
---@field fitness number|nil
---@field parents integer[]
---@field body { hash: string, voxels: integer }

-- Every robot of a repetition by id, as it first appeared. Not all generations may be kept.
local function robots_of(run)
  local by_id = {}
  for _, line in ipairs(run.lines) do
    local there = run.folder:has_robots(run.repetition, line.generation)
    for _, row in ipairs(there and run.folder:rows(run.repetition, line.generation) or {}) do
      by_id[row.id] = by_id[row.id] or rows.record(row)
    end
  end
  return by_id
end

--- The ancestors of the champion, itself included, the oldest first; and the line of its
--- better parents, the oldest first.
---@return limax.report.ancestor[] ancestors
---@return limax.report.ancestor[] line
function lineage.of(run)
  local by_id = robots_of(run)
  local champion = runs.result(run).champion
  local first = champion and by_id[champion.id]
  if not first then return {}, {} end
  local waiting, seen, ancestors = { first }, { [first.id] = true }, {}
  while #waiting > 0 do
    local robot = table.remove(waiting)
    ancestors[#ancestors + 1] = robot
    for _, id in ipairs(robot.parents) do
      if by_id[id] and not seen[id] then
        seen[id] = true
        waiting[#waiting + 1] = by_id[id]
      end
    end
  end
  -- from the champion back
  local line, at, passed = {}, first, {}
  while at do
    table.insert(line, 1, at)
    passed[at.id] = true
    local better
    for _, id in ipairs(at.parents) do
      local parent = by_id[id]
      if parent and parent.fitness and not passed[id]
        and (not better or parent.fitness > better.fitness) then
        better = parent
      end
    end
    at = better
  end
  table.sort(ancestors, function(a, b)
    if a.generation ~= b.generation then return a.generation < b.generation end
    return a.id < b.id
  end)
  return ancestors, line
end

--- The ancestors as a panel.
---@param title string
---@param label string of the fitness
---@return limax.chart.panel
function lineage.panel(ancestors, line, title, label)
  local function points(robots)
    local list = {}
    for _, robot in ipairs(robots) do
      if robot.fitness then list[#list + 1] = { robot.generation, robot.fitness } end
    end
    return list
  end
  return { title = title,
    x = { label = "generation in which it first appeared", linear = true, whole = true },
    y = { label = label, linear = true }, curves = {
      { title = "ancestors", points = points(ancestors), color = "#8c9198", dash = "none",
        marker = "ring" },
      { name = "better parents", points = points(line), color = "#d55e00", width = 2,
        marker = "dot" },
    } }
end

return lineage
