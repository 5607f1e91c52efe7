--- lineage.lua: the line of a champion: from generation 0 through the better parent of each robot.

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

--- The champion and its better parents, the oldest first; empty where the robots are not kept.
function lineage.of(run)
  local by_id, line, passed = robots_of(run), {}, {}
  local champion = runs.result(run).champion
  local at = champion and by_id[champion.id]
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
  return line
end

return lineage
