--- motion.lua: a robot's motion for pictures: poses at some times, the path, the skin.
--- World points are turned to { along the path, away from the viewer, up }, m; up is against
--- gravity, so that a slope is seen as one.

local block_picture = require "limax.draw.block_picture"
local defaults = require "limax.settings.defaults"
local palette = require "limax.draw.palette"
local polygon = require "limax.draw.picture.polygon"
local skin = require "limax.draw.skin"
local stage = require "limax.draw.picture.stage"
local world = require "limax.draw.picture.world"

local motion = {}

-- A displacement shorter than this share of a body's length has no direction.
local LEAST_DISPLACEMENT = 0.05
-- s: without ground the viewer's height is the mean of the body's over this time before and after a
-- pose, half a period of the default muscles
local CALM = 0.25
-- m: anchors hold what is nearer to their box than this; see engine/physics/effects/anchors.h
local HELD_WITHIN = 1e-6
-- How much lighter a muscle is at an activation of 1, and darker at -1.
local TINT = 0.35
-- Hz: shows a gait; much more is memory for nothing
local ENOUGH = 20

---@class limax.motion.pose
---@field sample integer
---@field time number s
---@field points number[][] of the masses: along, away, up, m
---@field middle number[] their mean
---@field base number m, the height that counts as 0 in a panel
---@field blocks number[][][] the corners of each block
---@field tints number[]|nil of each face, as by motion.tints

---@class limax.motion.film
---@field poses limax.motion.pose[]
---@field path number[][] of the centre of mass, at every sample
---@field faces table[] of the skin
---@field colors table<string, limax.color> by letter
---@field materials table[]
---@field used table<string, boolean> letters of the body
---@field acts table<string, boolean> letters of muscles
---@field held table<integer, boolean> masses that anchors hold
---@field world limax.world
---@field stage limax.picture.stage the same, turned
---@field start number m along the path

-- Directions of along, away and up in the world. Along is level, in the direction of the
-- displacement; x where that is too short.
local function axes_of(displacement, least, up)
  local function level(v)
    local rise = polygon.dot(v, up)
    return { v[1] - rise * up[1], v[2] - rise * up[2], v[3] - rise * up[3] }
  end
  local along = level(displacement)
  if polygon.dot(along, along) < least ^ 2 then along = level { 1, 0, 0 } end
  along = polygon.unit(along)
  return { along, polygon.cross(up, along), up }
end

local function mean_of(points)
  local sum = { 0, 0, 0 }
  for _, point in ipairs(points) do
    for k = 1, 3 do sum[k] = sum[k] + point[k] end
  end
  return { sum[1] / #points, sum[2] / #points, sum[3] / #points }
end

local function turned(points, film)
  local result = {}
  for k, point in ipairs(points) do result[k] = film.stage.turn(point) end
  return result
end

-- The viewer's height for a pose: of the ground below its middle, else about that of the body.
local function base_of(film, pose, rate)
  local ground = stage.ground_height(film.stage, pose.middle[1], pose.middle[2])
  if ground then return ground end
  local around, sum, count = math.floor(CALM * rate + 0.5), 0, 0
  for s = math.max(1, pose.sample - around), math.min(#film.path, pose.sample + around) do
    sum, count = sum + film.path[s][3], count + 1
  end
  return sum / count
end

-- The masses that a scene's anchors hold; `sites` are those of the masses.
local function held_of(robot, sites)
  local anchors, voxel, held = robot.context.scene.anchors, robot.body.voxel, {}
  if not anchors then return held end
  local wide, deep, edge = #voxel + 1, #voxel[1] + 1, robot.context.options.edge
  local places, corner, _, take = {}, polygon.bounds(3)
  for m, site in ipairs(sites) do
    local row = math.floor(site / wide)
    places[m] = { site % wide, row % deep, math.floor(row / deep) }
    take(places[m])
  end
  for m, place in ipairs(places) do
    local within = true
    for c = 1, 3 do
      local start = edge * (place[c] - corner[c])
      within = within and start >= anchors.from[c] - HELD_WITHIN
        and start <= anchors.to[c] + HELD_WITHIN
    end
    held[m] = within or nil
  end
  return held
end

--- The parts of a film that do not change as the robot moves: the faces of its skin (skin.lua), its
--- materials with their colours, the masses that anchors hold, and the world around it.
---@return limax.motion.film without stage, poses and path
function motion.body(robot)
  local context = robot.context
  local sites, mass_at, used = context.simulation:sites(context.index):table(), {}, {}
  for m, site in ipairs(sites) do mass_at[site] = m end
  for letter in robot.body.letters:gmatch "[^%s.]" do used[letter] = true end
  local materials, acts = context.materials:table().materials, {}
  for _, material in ipairs(materials) do
    acts[material.letter] = material.kind == "expanding" or material.kind == "contracting" or nil
  end
  return { materials = materials, colors = palette.of(materials), used = used, acts = acts,
    faces = skin.faces(robot.body.voxel, mass_at), held = held_of(robot, sites),
    world = world.of(context.scene), poses = {}, path = {} }
end

--- The activations of a robot whose positions are drawn; nil without a trace of them at the same
--- rate.
---@return limax.view|nil
function motion.activations(robot)
  local recorded = robot.context.simulation.record
  return recorded.activation and recorded.activation == recorded.position
    and robot:trace "activation" or nil
end

--- A factor on the brightness of each face: muscles are lighter or darker by their activation.
---@param film limax.motion.film
---@param activations limax.view|number[] of each voxel
function motion.tints(film, voxel, activations)
  local tints, wide, deep = {}, #voxel, #voxel[1]
  for f, face in ipairs(film.faces) do
    local x, y, z = unpack(face.voxel)
    tints[f] = film.acts[face.letter]
      and 1 + TINT * activations[x + wide * (y - 1 + deep * (z - 1))] or 1
  end
  return tints
end

--- Makes the film of a robot that motion.simulate has simulated.
---@param times number[] s, of the poses
function motion.of(robot, times)
  local film, trace = motion.body(robot), robot:trace "position"
  local scene, activations = robot.context.scene, motion.activations(robot)
  local places = scene.block and robot:trace "block"
  film.stage = stage.new(film.world, axes_of(robot:displacement(),
    LEAST_DISPLACEMENT * robot:length(), film.world.up))
  -- with equal masses the middle of all is the centre of mass
  for s = 1, trace:size() do film.path[s] = film.stage.turn(mean_of(trace[s]:table())) end
  for k, time in ipairs(times) do
    -- the nearest
    local sample = math.min(trace:size(), math.max(0, math.floor(time * trace.rate + 0.5)) + 1)
    local pose = { sample = sample, time = (sample - 1) / trace.rate,
      points = turned(trace[sample]:table(), film), blocks = {} }
    for b, corners in ipairs(block_picture.all(scene, places, sample)) do
      pose.blocks[b] = turned(corners, film)
    end
    if activations then
      pose.tints = motion.tints(film, robot.body.voxel, activations[sample])
    end
    pose.middle = mean_of(pose.points)
    pose.base = base_of(film, pose, trace.rate)
    film.poses[k] = pose
  end
  film.start = film.poses[1].middle[1]
  return film
end

--- A round length (1, 2 or 5 times a power of ten) of at most `most` metres.
function motion.round_length(most)
  local power = 10 ^ math.floor(math.log10(most))
  for _, factor in ipairs { 5, 2 } do
    if factor * power <= most then return factor * power end
  end
  return power
end

--- A rate for `position` that leaves the time step as it was: one of those that are recorded
--- anyway.
---@return integer Hz
function motion.position_rate(record)
  local best
  for _, kind in ipairs(defaults.traces) do
    local rate = record[kind] or 0
    if rate > 0 and (not best or best < ENOUGH and rate > best
      or rate >= ENOUGH and rate < best) then
      best = rate
    end
  end
  return best or ENOUGH
end

---@class limax.motion.options
---@field title? string
---@field device? string|limax.device
---@field scene? table the robot's own if absent, else flat ground
---@field trial? integer of a robot with several trials; 1 if absent
---@field duration? number s
---@field progress? fun(progress: table)

--- Simulates a robot with its positions recorded. `nil, message` if the simulation fails: there
--- is nothing to draw.
function motion.simulate(robot, options)
  options = options or {}
  local trial = options.trial or robot.description.trials and not options.scene and 1 or nil
  local described = (robot.description.trials or {})[trial or 0] or robot.description
  local own = described.simulation and described.simulation.record or {}
  local record = { position = motion.position_rate(own) }
  for kind, rate in pairs(own) do
    if kind ~= "position" then record[kind] = rate end
  end
  -- the blocks of the scene that is drawn, which may not be the robot's own
  local scene = options.scene or described.scene or {}
  record.block = scene.block and record.position or nil
  record.activation = scene.control and record.position or nil
  local walked = robot:simulate { record = record, device = options.device,
    progress = options.progress, scene = options.scene, trial = trial,
    duration = options.duration }
  if walked.status ~= "done" then
    return nil, ("the robot is %s: there is no film strip of it"):format(walked.status)
  end
  return walked
end

return motion
