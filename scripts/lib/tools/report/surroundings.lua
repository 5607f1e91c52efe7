--- surroundings.lua: the world around a replay for the page's viewer: the part that the robot comes
--- near to, with rounded numbers. World coordinates, m.

local polygon = require "limax.draw.picture.polygon"
local stage = require "limax.draw.picture.stage"
local world = require "limax.draw.picture.world"

local surroundings = {}

-- m around the positions of the body, and what the ends are rounded to
local BEYOND, ROUND = 1.5, 0.5
-- most heights along a side of the terrain, and m between them where its own are farther apart
local MOST_HEIGHTS, STEP = 96, 0.1

-- lines across a floor in each direction
local MOST_LINES = 200

local AXES = { { 1, 0, 0 }, { 0, 1, 0 }, { 0, 0, 1 } }

---@class limax.report.surroundings
---@field up number[] of length 1
---@field low number[] m, the part of the world that is shown
---@field high number[]
---@field ground number|nil m
---@field sheets { points: number[][], floor: boolean, lines: number[][]|nil }[]|nil planes; lines
--- by pairs of points
---@field boxes { from: number[], to: number[] }[]|nil
---@field spheres { center: number[], radius: number }[]|nil
---@field terrain { spacing: number, origin: number[], heights: number[][] }|nil
---@field flows { name: string, label: string, velocity: number[], hex: string }[]|nil m/s
---@field hex string of obstacles

-- To a tenth of a millimetre: a twentieth of a pixel where a robot is as wide as a view.
local function short(value) return tonumber(("%.4f"):format(value)) end

local function shorts(point) return { short(point[1]), short(point[2]), short(point[3]) } end

-- The terrain near the robot, at steps that a view can show.
local function terrain_of(terrain, low, high)
  local longest = math.max(high[1] - low[1], high[2] - low[2])
  local step = terrain.spacing
  if step > STEP then
    step = step / math.ceil(step / STEP)
  end
  step = step * math.max(1, math.ceil(longest / (MOST_HEIGHTS - 2) / step))
  local first, counts = {}, {}
  for c = 1, 2 do
    first[c] = math.floor((low[c] - terrain.origin[c]) / step)
    counts[c] = math.ceil((high[c] - terrain.origin[c]) / step) - first[c] + 1
  end
  local heights = {}
  for i = 1, counts[1] do
    heights[i] = {}
    for j = 1, counts[2] do
      heights[i][j] = short(world.height(terrain, terrain.origin[1] + (first[1] + i - 1) * step,
        terrain.origin[2] + (first[2] + j - 1) * step))
    end
  end
  return { spacing = step, heights = heights, origin = {
    terrain.origin[1] + first[1] * step, terrain.origin[2] + first[2] * step, 0 } }
end

-- Lines across a floor along x and y, every 0.1 m, as on the ground, at most as many as a view
-- needs.
local function lines_of(sheet, low, high)
  local lines = {}
  for axis = 1, 2 do
    local normal, count = { 0, 0, 0 }, math.min((high[axis] - low[axis]) * 10, MOST_LINES)
    normal[axis] = 1
    for k = 1, count do
      local one, other = polygon.crossing(sheet, normal, low[axis] + k / 10)
      if one and other then
        lines[#lines + 1] = shorts(one)
        lines[#lines + 1] = shorts(other)
      end
    end
  end
  return lines
end

--- What is around points that lie between `low` and `high`.
---@param low number[] m
---@param high number[] m
---@return limax.report.surroundings
function surroundings.of(around, low, high)
  local from, to = {}, {}
  for c = 1, 3 do
    from[c] = math.floor((low[c] - BEYOND) / ROUND) * ROUND
    to[c] = math.ceil((high[c] + BEYOND) / ROUND) * ROUND
  end
  local result = { up = around.up, low = from, high = to, ground = around.ground, hex = world.hex,
    sheets = {}, boxes = {}, spheres = {}, flows = {} }
  for _, item in ipairs(stage.sheets(stage.new(around, AXES), { low = from, high = to })) do
    local sheet, points = item.parts[1], {}
    for k, p in ipairs(sheet.points) do points[k] = shorts(p) end
    table.insert(result.sheets, { points = points, floor = sheet.look.ruled,
      lines = sheet.look.ruled and lines_of(sheet, from, to) or nil })
  end
  -- what a box in the world has in common with the part that is shown; nil for nothing
  local function cut(box_low, box_high)
    local part = { from = {}, to = {} }
    for c = 1, 3 do
      part.from[c], part.to[c] = math.max(box_low[c], from[c]), math.min(box_high[c], to[c])
      if part.from[c] >= part.to[c] then return nil end
    end
    return part
  end
  for _, box in ipairs(around.boxes) do table.insert(result.boxes, cut(box.from, box.to)) end
  for _, sphere in ipairs(around.spheres) do
    local c, r = sphere.center, sphere.radius
    if cut({ c[1] - r, c[2] - r, c[3] - r }, { c[1] + r, c[2] + r, c[3] + r }) then
      table.insert(result.spheres, { center = c, radius = r })
    end
  end
  for k, flow in ipairs(around.flows) do
    result.flows[k] = { name = flow.kind, label = world.flow_label(flow),
      velocity = shorts(flow.velocity), hex = world.flow_ink[flow.kind] }
  end
  for _, name in ipairs { "sheets", "boxes", "spheres", "flows" } do
    if #result[name] == 0 then result[name] = nil end
  end
  if around.terrain then result.terrain = terrain_of(around.terrain, from, to) end
  return result
end

return surroundings
