--- motion.lua: what pictures need of a robot's motion: poses at given times, the path, the skin.
--- World points are turned to { along the way, away from the eye, up }, m; up is against gravity,
--- so that a slope is seen as one.

local block_picture = require "limax.draw.block_picture"
local defaults = require "limax.settings.defaults"
local palette = require "limax.draw.palette"
local skin = require "limax.draw.skin"
local stage = require "limax.draw.picture.stage"
local world = require "limax.draw.picture.world"

local motion = {}

-- A way shorter than this share of a body's length has no direction.
local LEAST_WAY = 0.05

-- Directions of along, away and up in the world. Along is level, in the direction `way`; x where
-- that has hardly any.
local function axes_of(way, least, up)
  local function level(v)
    local rise = v[1] * up[1] + v[2] * up[2] + v[3] * up[3]
    return { v[1] - rise * up[1], v[2] - rise * up[2], v[3] - rise * up[3] }
  end
  local along = level(way)
  local length = math.sqrt(along[1] ^ 2 + along[2] ^ 2 + along[3] ^ 2)
  if length < least then
    along = level { 1, 0, 0 }
    length = math.sqrt(along[1] ^ 2 + along[2] ^ 2 + along[3] ^ 2)
  end
  for k = 1, 3 do along[k] = along[k] / length end
  return { along, { up[2] * along[3] - up[3] * along[2], up[3] * along[1] - up[1] * along[3],
    up[1] * along[2] - up[2] * along[1] }, up }
end

local function mean_of(points)
  local sum = { 0, 0, 0 }
  for _, point in ipairs(points) do
    for k = 1, 3 do sum[k] = sum[k] + point[k] end
  end
  return { sum[1] / #points, sum[2] / #points, sum[3] / #points }
end

-- The way of the scene's block; nil where there is no block or it was not recorded.
local function block_trace(robot)
  local block = robot.context.scene.block
  if not block or (robot.context.options.record.block or 0) == 0 then return nil end
  return robot:trace "block", block.size
end

-- The corners of the scene's block at a moment, along, away, up; none where none was recorded.
local function block_at(robot, time, turn)
  local path, size = block_trace(robot)
  if not path then return {} end
  local sample = math.min(path:size(), math.floor(time * path.rate + 0.5) + 1)
  local corners = block_picture.corners(path[sample]:table(), size)
  for k, corner in ipairs(corners) do corners[k] = turn(corner) end
  return corners
end

-- The moments nearest to these times: all masses, their middle, and the block's corners.
local function poses_of(robot, trace, turn, times)
  local poses, samples = {}, trace:size()
  for k, wanted in ipairs(times) do
    local sample = math.min(samples, math.max(0, math.floor(wanted * trace.rate + 0.5)) + 1)
    local points = {}
    for m, point in ipairs(trace[sample]:table()) do points[m] = turn(point) end
    local time = (sample - 1) / trace.rate
    poses[k] = { sample = sample, time = time, points = points, middle = mean_of(points),
      block = block_at(robot, time, turn) }
  end
  return poses
end

-- The middle of all masses at each sample: along, away, up. (Equal masses make it the centre of
-- mass; a trace of it is used where there is one.)
local function path_of(robot, trace, turn)
  local path = {}
  local recorded = robot.context.options.record.center_of_mass or 0
  if recorded == trace.rate then
    local centers = robot:trace "center_of_mass"
    for s = 1, centers:size() do path[s] = turn(centers[s]) end
    return path
  end
  for s = 1, trace:size() do path[s] = turn(mean_of(trace[s]:table())) end
  return path
end

-- s before and after a moment over which the eye's height is the mean of the body's, where there is
-- no ground to keep to: half a period of the default muscles.
local CALM = 0.25

-- The height that a pose is seen from: of the ground below its middle, else about that of the body.
local function base_of(film, pose, rate)
  local ground = stage.ground_height(film.stage, pose.middle[1], pose.middle[2])
  if ground then return ground end
  local around, sum, count = math.floor(CALM * rate + 0.5), 0, 0
  for s = math.max(1, pose.sample - around), math.min(#film.path, pose.sample + around) do
    sum, count = sum + film.path[s][3], count + 1
  end
  return sum / count
end

---@class limax.motion.pose
---@field sample integer
---@field time number s
---@field points number[][] of the masses: along, away, up, m
---@field middle number[] their mean
---@field base number m, the height that counts as 0 in a panel
---@field block number[][] the block's corners, if any

---@class limax.motion.film
---@field poses limax.motion.pose[]
---@field path number[][] of the centre of mass, at every sample
---@field faces table[] of the skin
---@field colors table<string, limax.color> by letter
---@field materials table[]
---@field used table<string, boolean> letters of the body
---@field held table<integer, boolean> masses that anchors hold
---@field world limax.world
---@field stage limax.picture.stage the same, turned
---@field note string|nil what is not drawn, and why
---@field start number m along the way

-- m: anchors hold what is nearer to their box than this; see engine/physics/effects/anchors.h
local HELD_WITHIN = 1e-6

--- The masses that a scene's anchors hold.
---@param robot limax.scored_robot
---@param sites integer[] of the masses, as the engine counts them
---@return table<integer, boolean> by mass
function motion.held(robot, sites)
  local anchors, voxel, held = robot.context.scene.anchors, robot.body.voxel, {}
  if not anchors then return held end
  local wide, deep = #voxel + 1, #voxel[1] + 1
  local places, corner = {}, { math.huge, math.huge, math.huge }
  for m, site in ipairs(sites) do
    local row = math.floor(site / wide)
    places[m] = { site % wide, row % deep, math.floor(row / deep) }
    for c = 1, 3 do corner[c] = math.min(corner[c], places[m][c]) end
  end
  local edge = robot.context.options.edge
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

-- What a film shows whatever moves: the body's skin and colours, and the world along this way.
local function film_of(robot, way, least)
  local context = robot.context
  local around = world.of(context.scene)
  local sites, mass_at = context.simulation:sites(context.index):table(), {}
  for m, site in ipairs(sites) do mass_at[site] = m end
  local materials, used = context.materials:table().materials, {}
  for letter in robot.body.letters:gmatch "[^%s.]" do used[letter] = true end
  return { materials = materials, colors = palette.of(materials), used = used, world = around,
    held = motion.held(robot, sites),
    faces = skin.faces(robot.body.voxel, mass_at),
    stage = stage.new(around, axes_of(way, least, around.up)) }
end

--- Everything that pictures draw of a robot whose "position" was recorded.
---@param robot limax.scored_robot
---@param times number[] s, of the poses
---@return limax.motion.film
function motion.of(robot, times)
  local trace = robot:trace "position"
  local film = film_of(robot, robot:displacement(), LEAST_WAY * robot:length())
  film.path = path_of(robot, trace, film.stage.turn)
  film.poses = poses_of(robot, trace, film.stage.turn, times)
  for _, pose in ipairs(film.poses) do pose.base = base_of(film, pose, trace.rate) end
  if robot.context.scene.block and not block_trace(robot) then
    film.note = "the block is not drawn: its way was not recorded"
  end
  film.start = film.poses[1].middle[1]
  return film
end

--- A film of one pose, seen along y: a simulation as it is now.
---@param robot limax.scored_robot of what has been simulated so far
---@param positions number[][] of its masses now, m
---@param time number s
---@return limax.motion.film
function motion.now(robot, positions, time)
  local film, context = film_of(robot, { 1, 0, 0 }, 0), robot.context
  local turn, pose = film.stage.turn, { sample = 1, time = time, points = {}, block = {} }
  for m, point in ipairs(positions) do pose.points[m] = turn(point) end
  pose.middle = mean_of(pose.points)
  if context.scene.block then
    local block = context.simulation:block(context.index)
    local p, q = block.position, block.orientation
    local corners = block_picture.corners({ p[1], p[2], p[3], q[1], q[2], q[3], q[4] },
      context.scene.block.size)
    for k, corner in ipairs(corners) do pose.block[k] = turn(corner) end
  end
  film.poses, film.path, film.start = { pose }, { pose.middle }, pose.middle[1]
  pose.base = base_of(film, pose, 1)
  return film
end

--- A round length (1, 2 or 5 times a power of ten) of at most `most` metres.
---@param most number m
---@return number m
function motion.round_length(most)
  local power = 10 ^ math.floor(math.log10(most))
  for _, factor in ipairs { 5, 2 } do
    if factor * power <= most then return factor * power end
  end
  return power
end

--- A rate for `position` that leaves the time step as it was: one of those that are recorded
--- anyway.
---@param record table<string, integer>
---@return integer Hz
function motion.position_rate(record)
  local best
  for _, kind in ipairs(defaults.traces) do
    local rate = record[kind] or 0
    -- 20 Hz show a gait; much more is memory for nothing
    if rate > 0 and (not best or best < 20 and rate > best or rate >= 20 and rate < best) then
      best = rate
    end
  end
  return best or 20
end

---@class limax.motion.options
---@field title? string
---@field device? string|limax.device
---@field scene? table the robot's own if absent, else flat ground
---@field duration? number s
---@field progress? fun(progress: table)

--- Simulates a robot with its positions recorded. `nil, message` where it comes to no good end:
--- there is nothing to draw.
---@param robot limax.robot
---@param options? limax.motion.options
---@return limax.scored_robot|nil
---@return string|nil message
function motion.simulate(robot, options)
  options = options or {}
  local own = robot.description.simulation and robot.description.simulation.record or {}
  local record = { position = motion.position_rate(own) }
  for kind, rate in pairs(own) do
    if kind ~= "position" then record[kind] = rate end
  end
  -- the block of the scene that is drawn, which need not be the robot's own
  local scene = options.scene or robot.description.scene or {}
  record.block = scene.block and record.position or nil
  local walked = robot:simulate { record = record, device = options.device,
    progress = options.progress, scene = options.scene, duration = options.duration }
  if walked.status ~= "done" then
    return nil, ("the robot is %s: there is no film strip of it"):format(walked.status)
  end
  return walked
end

return motion
