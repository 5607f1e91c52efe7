--- cells.lua: archives that keep the best robot of each cell of the descriptors' space: a grid, or
--- the cells of given centres.

local centres = require "limax.experiment.archives.centres"
local neighbours = require "limax.experiment.archives.neighbours"

local cells = {}

-- Most cells of a grid: a list of them is made for every picture of it.
local MOST = 1e6

-- Candidates that are better than the robot of their cell, one for each cell.
local function choose(rows, place, candidates, cell_of)
  local best, order, entered = {}, {}, {}
  for _, row in ipairs(candidates) do
    local cell = cell_of(row)
    local holder = best[cell] or place[cell] and rows[place[cell]]
    if not holder or row.fitness > holder.fitness then
      if not best[cell] then order[#order + 1] = cell end
      best[cell], row.cell = row, cell
    end
  end
  for k, cell in ipairs(order) do entered[k] = best[cell] end
  return entered
end

-- An archive of `count` cells, or of so many on each island.
local function definition(options, count, cell_of)
  local archive = { descriptors = options.descriptors }
  local function cell_of_row(row)
    return cell_of(row.descriptors) + count * ((row.island or 1) - 1)
  end
  function archive.choose(rows, place, candidates)
    return choose(rows, place, candidates, cell_of_row)
  end
  function archive.measure(rows)
    local all, score = count * (archive.islands or 1), 0
    for _, row in ipairs(rows) do score = score + (row.fitness - options.qd_offset) end
    return { cells = all, coverage = #rows / all, qd_score = score }
  end
  return archive
end

-- A note about a descriptor that has robots in one of its cells only, or in a tenth of many.
local function narrow(rows, range, measure, k, axis)
  local count, filled = 0, {}
  for _, row in ipairs(rows) do
    local at = axis.at(row.descriptors[k])
    if not filled[at] then filled[at], count = true, count + 1 end
  end
  if #rows == 0 or axis.cells < 3 or count > math.max(1, axis.cells / 10) then return nil end
  return ("archive: %s used %d of %d cells: its range is %.4g to %.4g, and robots had %.4g to"
    .. " %.4g"):format(measure.title, count, axis.cells, axis.least, axis.most, unpack(range))
end

--- A grid; the first descriptor varies fastest in the cells' numbers.
---@param options { descriptors: limax.measure[], cells: integer, qd_offset: number }
---@return limax.archive.definition|string
function cells.grid(options)
  local axes, count = {}, 1
  for k, measure in ipairs(options.descriptors) do
    local along = measure.cells or options.cells
    local least, most = measure.range[1], measure.range[2]
    axes[k] = { least = least, most = most, cells = along, stride = count, at = function(value)
      local at = math.floor((value - least) / (most - least) * along)
      return math.max(0, math.min(along - 1, at))
    end }
    count = count * along
  end
  if count > MOST then
    return ("%.6g cells; at most 1e6: fewer cells along a descriptor, or \"cvt\""):format(count)
  end
  local grid = definition(options, count, function(values)
    local cell = 1
    for k = 1, #axes do cell = cell + axes[k].stride * axes[k].at(values[k]) end
    return cell
  end)
  grid.axes = axes
  function grid.notes(rows, ranges)
    local list = {}
    for k, axis in ipairs(axes) do
      list[#list + 1] = narrow(rows, ranges[k], options.descriptors[k], k, axis)
    end
    return list
  end
  return grid
end

--- The cells of centres, each with the points that are nearest to its own.
---@param options { descriptors: limax.measure[], cells: integer, samples?: integer, qd_offset:
--- number }
---@return limax.archive.definition|string
function cells.cvt(options)
  local list, dimensions = options.descriptors, #options.descriptors
  local refusal = centres.refusal(options.cells, dimensions, options.samples)
  if refusal then return refusal end
  local search
  return definition(options, options.cells, function(values)
    search = search
      or neighbours.new(centres.of(options.cells, dimensions, options.samples), dimensions)
    local point = {}
    for d, measure in ipairs(list) do
      local least, most = measure.range[1], measure.range[2]
      point[d] = math.max(0, math.min(1, (values[d] - least) / (most - least)))
    end
    return search:nearest_to(point)
  end)
end

return cells
