--- obstacle_picture.lua: the fixed things of a scene as a figure needs them: boxes, spheres, planes
--- and terrain near a body, as squares of at most a tenth of a metre, which a painter can sort by
--- depth. World coordinates, m; corners counter-clockwise seen from outside.

local obstacle_picture = {}

--- What obstacles are drawn with.
obstacle_picture.letter, obstacle_picture.hex = "obstacle", "#b7b0a3"

-- Edge of a square, m: that of the lines on the ground.
local CELL = 0.1
-- Squares around a sphere and from pole to pole.
local AROUND, POLES = 24, 12
-- What lies this far within another box cannot be seen, m.
local WITHIN = 1e-6

---@class limax.obstacle_picture.region a box of the world, m
---@field low number[]
---@field high number[]

-- From `low` to `high` with every whole multiple of CELL in between, so that squares stay where
-- they are when the region moves, and these further places.
local function cuts(low, high, further)
  local places, list = { low, high }, {}
  for k = math.ceil(low / CELL), math.floor(high / CELL) do places[#places + 1] = k * CELL end
  for _, place in ipairs(further or {}) do places[#places + 1] = place end
  table.sort(places)
  for _, place in ipairs(places) do
    local last = list[#list]
    if place >= low and place <= high and not (last and place - last < WITHIN) then
      list[#list + 1] = place
    end
  end
  return list
end

local function middle_of(quad)
  local middle = { 0, 0, 0 }
  for _, corner in ipairs(quad) do
    for k = 1, 3 do middle[k] = middle[k] + corner[k] / 4 end
  end
  return middle
end

local function inside(point, low, high, margin)
  for k = 1, 3 do
    if point[k] < low[k] + margin or point[k] > high[k] - margin then return false end
  end
  return true
end

-- Squares of one side of a box, from `low` to `high` along the two other axes, cut where any box
-- begins or ends.
local function add_side(quads, axis, at, outward, low, high, bounds)
  local u, v = axis % 3 + 1, (axis + 1) % 3 + 1
  local across = cuts(low[u], high[u], bounds[u])
  local along = cuts(low[v], high[v], bounds[v])
  for i = 1, #across - 1 do
    for j = 1, #along - 1 do
      local quad = {}
      for k, corner in ipairs { { i, j }, { i + 1, j }, { i + 1, j + 1 }, { i, j + 1 } } do
        quad[outward > 0 and k or 5 - k] =
          { [axis] = at, [u] = across[corner[1]], [v] = along[corner[2]] }
      end
      quads[#quads + 1] = quad
    end
  end
end

local function add_boxes(quads, boxes, region)
  local bounds = { {}, {}, {} }
  for _, box in ipairs(boxes) do
    for k = 1, 3 do
      table.insert(bounds[k], box.from[k])
      table.insert(bounds[k], box.to[k])
    end
  end
  for _, box in ipairs(boxes) do
    local low, high, sides, there = {}, {}, {}, true
    for k = 1, 3 do
      low[k] = math.max(box.from[k], region.low[k])
      high[k] = math.min(box.to[k], region.high[k])
      there = there and low[k] < high[k]
    end
    for axis = 1, there and 3 or 0 do
      add_side(sides, axis, low[axis], -1, low, high, bounds)
      add_side(sides, axis, high[axis], 1, low, high, bounds)
    end
    for _, quad in ipairs(sides) do
      local hidden, middle = false, middle_of(quad)
      for _, other in ipairs(boxes) do
        hidden = hidden or other ~= box and inside(middle, other.from, other.to, -WITHIN)
          -- where two touch, the higher one's side is the one that is seen
          and (other.to[3] > middle[3] + WITHIN)
      end
      if not hidden then quads[#quads + 1] = quad end
    end
  end
end

local function add_near(quads, region, quad)
  if inside(middle_of(quad), region.low, region.high, 0) then quads[#quads + 1] = quad end
end

local function add_spheres(quads, spheres, region)
  for _, sphere in ipairs(spheres) do
    local function at(i, j)
      local around, down = 2 * math.pi * i / AROUND, math.pi * j / POLES
      return { sphere.center[1] + sphere.radius * math.sin(down) * math.cos(around),
        sphere.center[2] + sphere.radius * math.sin(down) * math.sin(around),
        sphere.center[3] + sphere.radius * math.cos(down) }
    end
    for i = 0, AROUND - 1 do
      for j = 0, POLES - 1 do
        add_near(quads, region, { at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j) })
      end
    end
  end
end

-- Height of a terrain: bilinear, and beyond its border the border's.
local function height_of(terrain, x, y)
  local heights, spacing, origin = terrain.heights, terrain.spacing, terrain.origin
  local function cell(along, count)
    local held = math.min(math.max(along, 0), count - 1)
    local below = math.min(math.floor(held), count - 2)
    return below + 1, held - below
  end
  local i, p = cell((x - origin[1]) / spacing, #heights)
  local j, q = cell((y - origin[2]) / spacing, #heights[1])
  return origin[3] + (1 - p) * ((1 - q) * heights[i][j] + q * heights[i][j + 1])
    + p * ((1 - q) * heights[i + 1][j] + q * heights[i + 1][j + 1])
end

local function add_terrain(quads, terrain, region)
  local xs, ys = cuts(region.low[1], region.high[1]), cuts(region.low[2], region.high[2])
  local function at(i, j) return { xs[i], ys[j], height_of(terrain, xs[i], ys[j]) } end
  for i = 1, #xs - 1 do
    for j = 1, #ys - 1 do
      quads[#quads + 1] = { at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1) }
    end
  end
end

local function add_planes(quads, planes, region)
  local centre, reach = {}, 0
  for k = 1, 3 do
    centre[k] = (region.low[k] + region.high[k]) / 2
    reach = reach + (region.high[k] - centre[k]) ^ 2
  end
  reach = math.sqrt(reach)
  for _, plane in ipairs(planes) do
    local n, length = {}, 0
    for k = 1, 3 do length = length + plane.normal[k] ^ 2 end
    for k = 1, 3 do n[k] = plane.normal[k] / math.sqrt(length) end
    -- two directions in it: across the axis that it faces least, and across both
    local least = 1
    for k = 2, 3 do
      if math.abs(n[k]) < math.abs(n[least]) then least = k end
    end
    local u = { -n[least] * n[1], -n[least] * n[2], -n[least] * n[3] }
    u[least] = u[least] + 1
    length = math.sqrt(u[1] ^ 2 + u[2] ^ 2 + u[3] ^ 2)
    for k = 1, 3 do u[k] = u[k] / length end
    local v = { n[2] * u[3] - n[3] * u[2], n[3] * u[1] - n[1] * u[3], n[1] * u[2] - n[2] * u[1] }
    -- the region's middle, in the plane's own directions
    local p, q, away = 0, 0, -plane.offset
    for k = 1, 3 do
      p, q, away = p + u[k] * centre[k], q + v[k] * centre[k], away + n[k] * centre[k]
    end
    local function at(s, r)
      local point = {}
      for k = 1, 3 do point[k] = plane.offset * n[k] + s * u[k] + r * v[k] end
      return point
    end
    if math.abs(away) < reach then
      local ss, rs = cuts(p - reach, p + reach), cuts(q - reach, q + reach)
      for i = 1, #ss - 1 do
        for j = 1, #rs - 1 do
          add_near(quads, region, { at(ss[i], rs[j]), at(ss[i + 1], rs[j]),
            at(ss[i + 1], rs[j + 1]), at(ss[i], rs[j + 1]) })
        end
      end
    end
  end
end

--- The squares of a scene's obstacles in a region.
---@param scene table as scene:table() has it
---@param region limax.obstacle_picture.region
---@return number[][][] quads four corners each
function obstacle_picture.quads(scene, region)
  local quads = {}
  add_boxes(quads, scene.boxes or {}, region)
  add_spheres(quads, scene.spheres or {}, region)
  add_planes(quads, scene.planes or {}, region)
  if scene.terrain then add_terrain(quads, scene.terrain, region) end
  return quads
end

return obstacle_picture
