--- replay.lua: a robot's motion, small enough for a page: the masses of its skin at 25 samples per
--- second, in steps of 0.2 mm, as differences from sample to sample, compressed by zlib.

local base64 = require "limax.base.base64"
local block_picture = require "limax.draw.block_picture"
local host = require "limax.host"
local motion = require "limax.draw.motion"
local palette = require "limax.draw.palette"
local surroundings = require "limax.tools.report.surroundings"
local world = require "limax.draw.picture.world"

local replay = {}

-- Samples per second that a page keeps; it draws straight lines between them.
local RATE = 25
-- m: half a pixel of a robot that is 5 m wide on a screen
local STEP = 2e-4
-- steps that fit into 16 bits
local MOST_STEPS = 65000

---@class limax.report.replay
---@field name string
---@field about string
---@field rate number Hz
---@field samples integer
---@field masses integer
---@field body integer of them, the body's own; the corners of the scene's block follow
---@field step number m
---@field low number[] m, what a value of 0 means along x, y, z
---@field edge number m
---@field world limax.report.surroundings
---@field corners integer[] masses from 0, four for each face
---@field materials integer[] of each face, from 0 in `names`
---@field names string[]
---@field colors string[] "#rrggbb"
---@field phases number[] of each face, rad; -1 if it is not a muscle
---@field held integer[]|nil masses from 0 that anchors hold
---@field note string|nil what is not shown, and why
---@field data string base64 of zlib of low bytes and then high bytes of the differences, [sample]
--- [mass][3], modulo 2^16; the first sample's are from 0

-- The phase of a muscle's voxel, rad; -1 for others.
local function phase_of(description, material, voxel)
  if not material.phase then return -1 end
  local weight = description.weights.phase
  if type(weight) == "table" then weight = weight[voxel[3]][voxel[2]][voxel[1]] end
  return tonumber(("%.3f"):format(weight * material.phase))
end

-- Samples as lists of three numbers for each mass that is drawn.
local function samples_of(trace, masses, stride)
  local list = {}
  for s = 1, trace:size(), stride do
    local row, values = trace[s], {}
    for k, mass in ipairs(masses) do
      local at = row[mass]
      values[3 * k - 2], values[3 * k - 1], values[3 * k] = at[1], at[2], at[3]
    end
    list[#list + 1] = values
  end
  return list
end

-- Least and most of all samples, along x, y, z.
local function ends_of(samples)
  local low, high = { math.huge, math.huge, math.huge }, { -math.huge, -math.huge, -math.huge }
  for _, values in ipairs(samples) do
    for c, value in ipairs(values) do
      local axis = (c - 1) % 3 + 1
      low[axis], high[axis] = math.min(low[axis], value), math.max(high[axis], value)
    end
  end
  return low, high
end

-- Differences between samples, packed.
local function packed(samples, low, step)
  local lows, highs, before, n = {}, {}, {}, 0
  for _, values in ipairs(samples) do
    for c, value in ipairs(values) do
      local steps = math.floor((value - low[(c - 1) % 3 + 1]) / step + 0.5)
      local difference = (steps - (before[c] or 0)) % 65536
      before[c] = steps
      n = n + 1
      lows[n] = string.char(difference % 256)
      highs[n] = string.char(math.floor(difference / 256))
    end
  end
  return base64.encode(host.deflate(table.concat(lows) .. table.concat(highs)))
end

-- Adds the corners of the scene's block to every sample, and its sides.
local function add_block(result, samples, path, stride, size, own)
  for k, values in ipairs(samples) do
    for _, corner in ipairs(block_picture.corners(path[(k - 1) * stride + 1]:table(), size)) do
      for c = 1, 3 do values[#values + 1] = corner[c] end
    end
  end
  result.names[#result.names + 1] = block_picture.letter
  result.colors[#result.colors + 1] = block_picture.hex
  for _, face in ipairs(block_picture.faces(own)) do
    for _, corner in ipairs(face.corners) do
      result.corners[#result.corners + 1] = corner - 1
    end
    result.materials[#result.materials + 1] = #result.names - 1
    result.phases[#result.phases + 1] = -1
  end
end

-- Adds the faces of the body's skin, with their materials and phases. Returns the masses that are
-- drawn.
local function add_faces(result, walked, description)
  local list = walked.context.materials:table().materials
  local of_letter, colors, masses, drawn = {}, palette.of(list), {}, {}
  for k, material in ipairs(list) do
    of_letter[material.letter] = k
    result.names[k], result.colors[k] = material.name, colors[material.letter].hex
  end
  local faces, sites = motion.faces(walked)
  for f, face in ipairs(faces) do
    for k, mass in ipairs(face.corners) do
      if not drawn[mass] then
        masses[#masses + 1] = mass
        drawn[mass] = #masses - 1
      end
      result.corners[4 * f - 4 + k] = drawn[mass]
    end
    local material = of_letter[face.letter]
    result.materials[f] = material - 1
    result.phases[f] = phase_of(description, list[material], face.voxel)
  end
  local held = motion.held(walked, sites)
  for k, mass in ipairs(masses) do
    if held[mass] then
      result.held = result.held or {}
      table.insert(result.held, k - 1)
    end
  end
  return masses
end

--- The replay of a simulated robot whose "position" was recorded.
---@param walked limax.scored_robot
---@param description limax.robot.description
---@return limax.report.replay
function replay.of(walked, description, name, about)
  local trace, context = walked:trace "position", walked.context
  local result = { name = name, about = about, edge = description.edge, corners = {},
    materials = {}, phases = {}, names = {}, colors = {} }
  local masses = add_faces(result, walked, description)
  local stride = math.max(1, math.floor(trace.rate / RATE))
  -- the last sample is kept
  while (trace:size() - 1) % stride ~= 0 do stride = stride - 1 end
  local samples = samples_of(trace, masses, stride)
  result.world = surroundings.of(world.of(context.scene), ends_of(samples))
  local block = context.scene.block
  if block and (context.options.record.block or 0) == trace.rate then
    add_block(result, samples, walked:trace "block", stride, block.size, #masses)
  elseif block then
    result.note = "the block is not shown: its positions were not recorded"
  end
  local low, high = ends_of(samples)
  local extent = math.max(high[1] - low[1], high[2] - low[2], high[3] - low[3])
  result.low, result.step = low, math.max(STEP, extent / MOST_STEPS)
  result.rate, result.samples = trace.rate / stride, #samples
  result.body, result.masses = #masses, #samples[1] / 3
  result.data = packed(samples, low, result.step)
  return result
end

return replay
