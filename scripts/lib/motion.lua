--- motion.lua: what pictures need of a robot's motion: poses at given times, the path, the skin.
--- World points are turned to { along the way, away from the eye, up }, m.

local block_picture = require "limax.block_picture"
local defaults = require "limax.defaults"
local obstacle_picture = require "limax.obstacle_picture"
local palette = require "limax.palette"
local skin = require "limax.skin"

local motion = {}

-- Direction of the way: of the whole displacement, or x where there is hardly any.
local function heading_of(robot)
  local moved = robot:displacement()
  local length = math.sqrt(moved[1] ^ 2 + moved[2] ^ 2)
  if length < 0.05 * robot:length() then return { 1, 0 } end
  return { moved[1] / length, moved[2] / length }
end

-- A point of the world along the way, away from the eye, and up.
local function turned(point, heading)
  return { point[1] * heading[1] + point[2] * heading[2],
    point[2] * heading[1] - point[1] * heading[2], point[3] }
end

local function mean_of(points)
  local sum = { 0, 0, 0 }
  for _, point in ipairs(points) do
    for k = 1, 3 do sum[k] = sum[k] + point[k] end
  end
  return { sum[1] / #points, sum[2] / #points, sum[3] / #points }
end

-- The items of two lists in one.
local function joined(...)
  local all = {}
  for _, list in ipairs { ... } do
    for _, item in ipairs(list) do all[#all + 1] = item end
  end
  return all
end

-- The corners of the scene's block at a moment, along, away, up; none where no block was recorded.
local function block_at(robot, time, heading)
  local block = robot.context.scene.block
  if not block or (robot.context.options.record.block or 0) == 0 then return {} end
  local path = robot:trace "block"
  local sample = math.min(path:size(), math.floor(time * path.rate + 0.5) + 1)
  local corners = block_picture.corners(path[sample]:table(), block.size)
  for k, corner in ipairs(corners) do corners[k] = turned(corner, heading) end
  return corners
end

-- The moments nearest to these times: all masses, their middle, and the block's corners.
local function poses_of(robot, trace, heading, times)
  local poses, samples = {}, trace:size()
  for k, wanted in ipairs(times) do
    local sample = math.min(samples, math.max(0, math.floor(wanted * trace.rate + 0.5)) + 1)
    local points = {}
    for m, point in ipairs(trace[sample]:table()) do points[m] = turned(point, heading) end
    local time = (sample - 1) / trace.rate
    poses[k] = { sample = sample, time = time, points = points, middle = mean_of(points),
      block = block_at(robot, time, heading) }
  end
  return poses
end

-- The middle of all masses at each sample: along, away, up. (Equal masses make it the centre of
-- mass; a trace of it is used where there is one.)
local function path_of(robot, trace, heading)
  local path = {}
  local recorded = robot.context.options.record.center_of_mass or 0
  if recorded == trace.rate then
    local centers = robot:trace "center_of_mass"
    for s = 1, centers:size() do path[s] = turned(centers[s], heading) end
    return path
  end
  for s = 1, trace:size() do path[s] = turned(mean_of(trace[s]:table()), heading) end
  return path
end

-- Room of the world that is shown around a body, beyond what it reaches in any pose, m.
local ROOM = 0.1

-- Puts the obstacles around each pose into it: as far as the body reaches from its middle in any
-- pose, and a little beyond.
local function add_obstacles(poses, scene, heading)
  local reach, low, high = 0, math.huge, -math.huge
  for _, pose in ipairs(poses) do
    for _, point in ipairs(joined(pose.points, pose.block)) do
      for axis = 1, 2 do reach = math.max(reach, math.abs(point[axis] - pose.middle[axis])) end
      low, high = math.min(low, point[3]), math.max(high, point[3])
    end
  end
  for _, pose in ipairs(poses) do
    -- turned back: where the middle is in the world
    local x, y = unpack(turned(pose.middle, { heading[1], -heading[2] }))
    local region = { low = { x - reach - ROOM, y - reach - ROOM, low - ROOM },
      high = { x + reach + ROOM, y + reach + ROOM, high + ROOM } }
    pose.obstacles, pose.obstacle_faces = {}, {}
    for i, quad in ipairs(obstacle_picture.quads(scene, region)) do
      local corners = {}
      for k, point in ipairs(quad) do
        pose.obstacles[4 * (i - 1) + k], corners[k] = turned(point, heading), 4 * (i - 1) + k
      end
      pose.obstacle_faces[i] = corners
    end
  end
end

---@class limax.motion.pose
---@field sample integer
---@field time number s
---@field points number[][] of the masses: along, away, up, m
---@field middle number[] their mean
---@field block number[][] the block's corners, if any
---@field obstacles number[][] corners of the obstacles' squares, if any
---@field obstacle_faces integer[][] four of these each

---@class limax.motion.film
---@field poses limax.motion.pose[]
---@field path number[][] of the centre of mass, at every sample
---@field faces table[] of the skin
---@field colors table<string, limax.color> by letter
---@field materials table[]
---@field used table<string, boolean> letters of the body
---@field ground number|nil m
---@field start number m along the way

--- Everything that pictures draw of a robot whose "position" was recorded.
---@param robot limax.scored_robot
---@param times number[] s, of the poses
---@return limax.motion.film
function motion.of(robot, times)
  local trace, context = robot:trace "position", robot.context
  local heading = heading_of(robot)
  local sites, mass_at = context.simulation:sites(context.index):table(), {}
  for m, site in ipairs(sites) do mass_at[site] = m end
  local materials, used = context.materials:table().materials, {}
  for letter in robot.body.letters:gmatch "[^%s.]" do used[letter] = true end
  local ground = context.scene.ground
  local film = { poses = poses_of(robot, trace, heading, times), materials = materials,
    path = path_of(robot, trace, heading), colors = palette.of(materials), used = used,
    faces = skin.faces(robot.body.voxel, mass_at), ground = ground and ground.height }
  film.colors[block_picture.letter] = { hex = block_picture.hex }
  film.colors[obstacle_picture.letter] = { hex = obstacle_picture.hex }
  add_obstacles(film.poses, context.scene, heading)
  film.start = film.poses[1].middle[1]
  return film
end

--- All points and faces of a pose, the block's and the obstacles' included.
---@param film limax.motion.film
---@param pose limax.motion.pose
---@return number[][] points
---@return table[] faces
function motion.skin(film, pose)
  if #pose.block + #pose.obstacles == 0 then return pose.points, film.faces end
  local before, faces = #pose.points + #pose.block, {}
  for i, face in ipairs(pose.obstacle_faces) do
    local corners = {}
    for k, corner in ipairs(face) do corners[k] = before + corner end
    faces[i] = { corners = corners, letter = obstacle_picture.letter }
  end
  return joined(pose.points, pose.block, pose.obstacles),
    joined(film.faces, #pose.block > 0 and block_picture.faces(#pose.points) or {}, faces)
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
