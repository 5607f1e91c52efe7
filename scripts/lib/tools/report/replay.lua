--- replay.lua: a robot's motion and the world around it, small enough for a page: the masses of its
--- skin at 25 samples per second, in steps of 0.2 mm, and the world as coloured polygons.

local bit = require "bit"
local ffi = require "ffi"

local base64 = require "limax.base.base64"
local block_picture = require "limax.draw.block_picture"
local host = require "limax.host"
local motion = require "limax.draw.motion"
local polygon = require "limax.draw.picture.polygon"
local stage = require "limax.draw.picture.stage"
local world = require "limax.draw.picture.world"

local replay = {}

-- Samples per second that a page keeps; it draws straight lines between them.
local RATE = 25
-- m: half a pixel of a robot that is 5 m wide on a screen
local STEP = 2e-4
-- m of the world around the positions of the body, and what its ends are rounded to
local BEYOND, ROUND = 1.5, 0.5
-- m: a target farther from the start is not shown
local TARGET_WITHIN = 10
-- most patches of terrain along its longer side, and most lines across a floor in each direction
local PATCHES, MOST_RULES = 32, 200

---@class limax.report.replay
---@field rate number Hz
---@field samples integer
---@field masses integer
---@field body integer of them, the body's own; the corners of the scene's blocks follow
---@field step number m
---@field world limax.report.world
---@field corners integer[] masses from 0, four for each face
---@field materials integer[] of each face, from 0 in `names`
---@field names string[]
---@field colors string[] "#rrggbb"
---@field tints integer[]|nil brightness of each face in percent, [sample][face], by activation
---@field steps integer[] differences from sample to sample, [sample][mass][3]; the first sample's
--- are from 0

---@class limax.report.world
---@field up number[] of length 1
---@field ground boolean
---@field parts { points: number[], edges: (boolean|string)[], fill: string|nil, ink: string,
--- wall: boolean|nil }[]|nil polygons, and lines between two points; walls are transparent
---@field moving { parts: table[], path: number[] }[]|nil boxes and spheres: polygons as they are at
--- first, and how far they have moved at each sample, m, [sample][3]
---@field obstacle string|nil colour of obstacles, if there are any
---@field target string|nil colour of the target, if there is one

-- Samples as lists of three numbers for each mass that is drawn.
local function samples_of(trace, masses, stride)
  local list = {}
  for s = 1, trace:size(), stride do
    local row, values = trace[s], {}
    for _, mass in ipairs(masses) do
      local at = row[mass]
      for c = 1, 3 do values[#values + 1] = at[c] end
    end
    list[#list + 1] = values
  end
  return list
end

local function steps_of(samples)
  local list, before = {}, {}
  for _, values in ipairs(samples) do
    for c, value in ipairs(values) do
      local steps = math.floor(value / STEP + 0.5)
      list[#list + 1], before[c] = steps - (before[c] or 0), steps
    end
  end
  return list
end

-- A polygon, or a line between two points, to a tenth of a millimetre.
local function part_of(points, edges, look)
  local flat = {}
  for _, p in ipairs(points) do
    for c = 1, 3 do flat[#flat + 1] = tonumber(("%.4f"):format(p[c])) end
  end
  return { points = flat, edges = edges, fill = look.fill, ink = look.ink, wall = look.wall }
end

-- Adds lines along x and y to a floor: one every 0.1 m, a darker one every 0.5 m.
local function add_rules(parts, floor, slab)
  for axis = 1, 2 do
    local normal = { 0, 0, 0 }
    normal[axis] = 1
    for k = 1, math.min((slab.high[axis] - slab.low[axis]) * 10, MOST_RULES) do
      local from, to = polygon.crossing(floor, normal, slab.low[axis] + k / 10)
      if from and to then
        parts[#parts + 1] = part_of({ from, to }, { true },
          { ink = k % 5 == 0 and world.rules.strong or world.rules.fine })
      end
    end
  end
end

-- The boxes and spheres of the world that move; one target after the other is a ball that jumps.
local function moving_of(self, samples, rate)
  local list = {}
  local function add(shape, place_at)
    local parts, path = {}, {}
    for _, side in ipairs(stage.sides(self, shape)) do
      parts[#parts + 1] = part_of(side.points, side.edges, side.look)
    end
    for s = 0, samples - 1 do
      for _, moved in ipairs(place_at(s / rate)) do path[#path + 1] = moved end
    end
    list[#list + 1] = { parts = parts, path = path }
  end
  for _, shape in ipairs(self.moving) do
    local still = { center = { 0, 0, 0 }, velocity = shape.velocity, turns = shape.turns }
    add(shape, function(time) return world.moved(still, time).center end)
  end
  if #self.targets > 1 then
    add(world.ball_at { 0, 0, 0 }, function(time)
      return world.target_at(self.targets, time) or self.targets[1].position
    end)
  end
  return #list > 0 and list or nil
end

-- The part of the world that the samples come near to.
local function world_of(around, samples, rate)
  local low, high, take = polygon.bounds(3)
  for _, values in ipairs(samples) do
    for c = 1, #values, 3 do take { values[c], values[c + 1], values[c + 2] } end
  end
  local target, start = around.targets[1], samples[1]
  target = target and target.position
  if target and (target[1] - start[1]) ^ 2 + (target[2] - start[2]) ^ 2
    + (target[3] - start[3]) ^ 2 < TARGET_WITHIN ^ 2 then
    take(target)
  end
  local slab, parts = { low = {}, high = {}, patches = PATCHES }, {}
  for c = 1, 3 do
    slab.low[c] = math.floor((low[c] - BEYOND) / ROUND) * ROUND
    slab.high[c] = math.ceil((high[c] + BEYOND) / ROUND) * ROUND
  end
  local turned = stage.new(around)
  local items, _, patches = stage.pieces(turned, slab)
  items[#items + 1] = { parts = patches }
  if turned.ground then
    items[#items + 1] = { parts = stage.ground_parts(turned, slab) }
    add_rules(parts, stage.ground_in(turned, slab), slab)
  end
  for _, item in ipairs(items) do
    for _, part in ipairs(item.parts) do
      parts[#parts + 1] = part_of(part.points, part.edges, part.look)
      if part.look.ruled then add_rules(parts, part, slab) end
    end
  end
  return { up = around.up, ground = turned.ground ~= nil,
    parts = #parts > 0 and parts or nil, moving = moving_of(turned, #samples, rate),
    obstacle = world.has_solids(around) and world.hex or nil,
    target = target and world.target_hex }
end

-- Adds the corners of the scene's blocks to every sample, and their sides.
local function add_blocks(result, samples, scene, path, stride)
  for k, values in ipairs(samples) do
    for _, corners in ipairs(block_picture.all(scene, path, (k - 1) * stride + 1)) do
      for _, corner in ipairs(corners) do
        for c = 1, 3 do values[#values + 1] = corner[c] end
      end
    end
  end
  table.insert(result.names, block_picture.letter)
  table.insert(result.colors, block_picture.hex)
  for before = result.body, #samples[1] / 3 - 1, 8 do
    for _, face in ipairs(block_picture.faces(before)) do
      for _, corner in ipairs(face.corners) do table.insert(result.corners, corner - 1) end
      table.insert(result.materials, #result.names - 1)
    end
  end
end

-- Adds the faces of the body's skin, with their materials. Returns the masses that are drawn.
local function add_faces(result, body)
  local of_letter, masses, drawn = {}, {}, {}
  for k, material in ipairs(body.materials) do
    of_letter[material.letter] = k
    result.names[k], result.colors[k] = material.name, body.colors[material.letter].hex
  end
  for f, face in ipairs(body.faces) do
    for k, mass in ipairs(face.corners) do
      if not drawn[mass] then
        masses[#masses + 1] = mass
        drawn[mass] = #masses - 1
      end
      result.corners[4 * f - 4 + k] = drawn[mass]
    end
    result.materials[f] = of_letter[face.letter] - 1
  end
  return masses
end

-- The brightness of every face at every sample, in percent.
local function tints_of(result, walked, body, stride)
  local activations, list = motion.activations(walked), {}
  if not activations then return nil end
  for s = 1, activations:size(), stride do
    local tints = motion.tints(body, walked.body.voxel, activations[s])
    -- those of blocks follow
    for f = 1, #result.materials do
      list[#list + 1] = math.floor(100 * (tints[f] or 1) + 0.5)
    end
  end
  return list
end

--- The replay of a robot that motion.simulate has simulated.
function replay.of(walked)
  local trace, body, scene = walked:trace "position", motion.body(walked), walked.context.scene
  local result = { step = STEP, corners = {}, materials = {}, names = {}, colors = {} }
  local masses = add_faces(result, body)
  local stride = math.max(1, math.floor(trace.rate / RATE))
  -- the last sample is kept
  while (trace:size() - 1) % stride ~= 0 do stride = stride - 1 end
  local samples = samples_of(trace, masses, stride)
  result.rate, result.samples, result.body = trace.rate / stride, #samples, #masses
  result.world = world_of(body.world, samples, result.rate)
  if scene.block then add_blocks(result, samples, scene, walked:trace "block", stride) end
  result.tints = tints_of(result, walked, body, stride)
  result.masses, result.steps = #samples[1] / 3, steps_of(samples)
  return result
end

-- Whole numbers of 32 bits as bytes, all lowest ones first: the others take almost no room in zlib.
-- 0, -1, 1, -2 become 0, 1, 2, 3.
local function planes_of(list)
  local count = #list
  local bytes = ffi.new("uint8_t[?]", 4 * count)
  for k = 0, count - 1 do
    local value = list[k + 1]
    value = bit.bxor(bit.lshift(value, 1), bit.arshift(value, 31))
    for plane = 0, 3 do bytes[plane * count + k] = bit.band(bit.rshift(value, 8 * plane), 255) end
  end
  return ffi.string(bytes, 4 * count)
end

--- A replay as text for the page, base64 of zlib: the length of a JSON text in 8 digits, that
--- text, in which `steps` and `tints` are how many there are, the planes of the steps, the tints.
function replay.packed(walked)
  local result = replay.of(walked)
  local steps, tints = planes_of(result.steps), result.tints
  result.steps, result.tints = #result.steps, tints and #tints
  local text = host.json.encode(result)
  tints = tints and ffi.string(ffi.new("uint8_t[?]", #tints, tints), #tints) or ""
  return base64.encode(host.deflate(("%08d"):format(#text) .. text .. steps .. tints))
end

return replay
