--- novelty.lua: an archive without cells, and the novelty of robots: the mean distance of a robot's
--- descriptors to those of its k nearest neighbours in the archive and in its own population.

local ffi = require "ffi"
local neighbours = require "limax.experiment.archives.neighbours"

local novelty = {}

-- Descriptors as distances measure them: a range counts as 1.
local function scaled(values, descriptors)
  local point = {}
  for d, measure in ipairs(descriptors) do
    local range = measure.range
    point[d] = range and (values[d] - range[1]) / (range[2] - range[1]) or values[d]
  end
  return point
end

--- Writes `novelty` into the records of robots with descriptors. A robot that is in the archive is
--- no neighbour of itself.
---@param records table[]
---@param rows limax.archive.row[]
---@param descriptors limax.measure[]
---@param k integer neighbours
function novelty.write(records, rows, descriptors, k)
  local points, ids, record_of = {}, {}, {}
  for _, row in ipairs(rows) do
    points[#points + 1], ids[#ids + 1] = scaled(row.descriptors, descriptors), row.id
  end
  for _, record in ipairs(records) do
    if record.fitness and record.descriptors then
      points[#points + 1], ids[#ids + 1] = scaled(record.descriptors, descriptors), record.id
      record_of[#points] = record
    end
  end
  local search = neighbours.new(points, #descriptors)
  local group = ffi.new("double[?]", #points + 1)
  for place = 1, #points do group[place - 1] = ids[search.order[place]] end
  local one = { most = k, found = ffi.new("double[?]", k), indices = ffi.new("int32_t[?]", k),
    group = group }
  for i = #rows + 1, #points do
    one.query, one.skip = search.data + search.place[i] * search.stride, ids[i]
    search:nearest(one)
    local sum, record = 0, record_of[i]
    for n = 0, one.count - 1 do sum = sum + math.sqrt(one.found[n]) end
    record.novelty = one.count > 0 and sum / one.count or 0
  end
end

-- `count` of the candidates, each with the same chance.
local function drawn(candidates, count, random)
  local left, list = {}, {}
  for k, row in ipairs(candidates) do left[k] = row end
  for k = 1, math.min(count, #left) do
    local at = k - 1 + random:integer(#left - k + 1)
    left[k], left[at] = left[at], left[k]
    list[k] = left[k]
  end
  return list
end

-- The oldest rows leave an archive that is full.
local function leaving(rows, entered, capacity)
  local surplus = #rows + #entered - capacity
  if surplus <= 0 then return nil end
  local ids = {}
  for k = 1, math.min(surplus, #rows) do ids[rows[k].id] = true end
  return ids
end

--- An unstructured archive.
---@param options { descriptors: limax.measure[], k: integer, threshold?: number, add?: integer,
--- capacity: integer }
---@return limax.archive.definition|string
function novelty.archive(options)
  if options.threshold and options.add then
    return "threshold and add: name one of the two rules by which robots enter"
  end
  local function enter(candidates, random)
    if not random then return candidates end -- they entered before
    if not options.threshold then return drawn(candidates, options.add or 6, random) end
    local list = {}
    for _, row in ipairs(candidates) do
      if row.novelty >= options.threshold then list[#list + 1] = row end
    end
    return list
  end
  return {
    descriptors = options.descriptors,
    appraise = function(records, rows)
      novelty.write(records, rows, options.descriptors, options.k)
    end,
    choose = function(rows, _, candidates, random)
      local list = enter(candidates, random)
      for k = #list, options.capacity + 1, -1 do list[k] = nil end
      return list, leaving(rows, list, options.capacity)
    end,
  }
end

return novelty
