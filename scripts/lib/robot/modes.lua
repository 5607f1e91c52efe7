--- modes.lua: vibrations of a robot about rest: natural frequencies, with the shape and damping
--- ratio of each, and their distance from the frequency of the muscles. SI units.

local engine = require "limax.engine"
local prepared = require "limax.robot.prepared"
local robot_in_motion = require "limax.robot.robot_in_motion"
local schema = require "limax.engine.schema"
local source = require "limax.base.source"

local modes = {}

-- modes if a script names no number
local COUNT = 6
-- A body comes to rest under a drag of this share of its mass per second, 1/s: critical for 1.6 Hz.
-- It does not change the pose at rest.
local CALM, CALM_NAME = 20, "modes_calm"
-- s: rest is checked at these intervals, and at most for so long
local INTERVAL, MOST_TIME = 0.5, 60
-- m/s: no mass of a body at rest is faster
local AT_REST = 1e-7

-- from this amplification on, muscles may ride a resonance
local RESONANT = 2

---@class limax.robot.modes_options : limax.robot.simulate_options
---@field standing? boolean at rest in its scene instead of free

---@class limax.robot.mode : limax.mode
---@field ratio number|nil its frequency over that of the muscles
---@field amplification number|nil of the muscles' drive, relative to a slow one
---@field amplitude number|nil m, largest displacement of a mass in this mode at the drive

---@class limax.robot.modes a list of modes, the lowest frequency first
---@field rigid integer independent motions without a restoring force, left out: 6 of a free body
---@field standing boolean
---@field drive number|nil Hz, of the muscles
---@field pose limax.view [mass][3] m, the rest about which it vibrates
---@field [integer] limax.robot.mode

-- A simulation that is never run: it has the body's sites and its pose at the start.
local function still(robot, options, scene)
  return prepared.simulation(robot, { scene = scene, trial = options.trial, device = "cpu",
    materials = options.materials, position = options.position,
    velocity = { 0, 0, 0 }, settle = MOST_TIME,
    duration = INTERVAL, record = {}, integrator = "leapfrog", precision = "double",
    time_step = "auto" })
end

local function speed_of(moving)
  local most = 0
  for _, v in ipairs(moving:velocities()) do
    most = math.max(most, v[1] ^ 2 + v[2] ^ 2 + v[3] ^ 2)
  end
  return math.sqrt(most)
end

-- Lets a body come to rest in its scene, and returns the simulation.
local function settled(robot, options, parts)
  local scene, heaviest = parts.scene:table(), 0
  for _, material in ipairs(parts.materials:table().materials) do
    heaviest = math.max(heaviest, material.mass_per_site or 0)
  end
  scene[CALM_NAME] = { force = "f = -rate * m * v;", rate = CALM,
    bound = { damping = CALM * heaviest } }
  local simulation = still(robot, options, scene)
  local moving = robot_in_motion.new(simulation)
  local steps = math.ceil(INTERVAL / simulation:outcome(1).time_step)
  while true do
    local speed, now = speed_of(moving:step(steps)), simulation:outcome(1)
    if now.status ~= "running" then
      engine.fail(("modes: the robot is %s (%s) before it comes to rest"):format(now.status,
        now.reason))
    end
    if speed < AT_REST then return simulation end
    if now.time + INTERVAL > 0 then
      engine.fail(("modes: standing: after %g s the robot still moves at %.2g m/s: it slides, rolls"
        .. " or falls in this scene; leave standing out for the modes of the free body")
        :format(MOST_TIME, speed))
    end
  end
end

--- The modes of a robot.
function modes.of(robot, count, options)
  local own = source.copy(schema.demand(schema.table, options or {}, "modes: options"))
  local standing = schema.demand(schema.boolean(false), own.standing, "modes: standing")
  own.standing = nil
  local parts = prepared.parts(robot, own)
  local simulation = standing and settled(robot, own, parts) or still(robot, own, own.scene)
  local pose = simulation:state(1)
  local list, rigid = engine.modes(parts.population, 1, parts.materials, parts.scene,
    parts.options, standing and pose or nil, count or COUNT)
  local actuation = parts.scene:table().actuation
  list.rigid, list.standing, list.pose = rigid, standing, pose
  list.drive = actuation and actuation.frequency
  for _, mode in ipairs(list.drive and list or {}) do
    local x = list.drive / mode.frequency
    mode.ratio = 1 / x
    mode.amplification = 1 / math.sqrt((1 - x * x) ^ 2 + (2 * mode.damping_ratio * x) ^ 2)
    mode.amplitude = mode.slow * mode.amplification
  end
  return list
end

-- Does the drive amplify a mode beyond what it would do slowly in any of them?
local function is_ridden(mode, all)
  local slowest = 0
  for _, each in ipairs(all) do slowest = math.max(slowest, each.slow) end
  return mode.amplification >= RESONANT and mode.amplitude >= slowest
end

--- Describes a table of modes.
function modes.words(all)
  return ("%s; motions without a restoring force, left out: %d; %s"):format(
    all.standing and "standing in its scene" or "free", all.rigid,
    all.drive and ("muscles at %g Hz"):format(all.drive) or "no muscles act")
end

--- Modes as a table of texts.
---@return string[] columns
---@return string[][] rows
function modes.table(all)
  local columns, rows = { "mode", "frequency, Hz", "damping ratio" }, {}
  for k, mode in ipairs(all) do
    rows[k] = { tostring(k), ("%.4g"):format(mode.frequency),
      ("%.3g"):format(mode.damping_ratio) }
    if all.drive then
      rows[k][4], rows[k][5] = ("%.3g"):format(mode.ratio), ("%.3g"):format(mode.amplification)
      rows[k][6] = ("%.3g"):format(mode.amplitude)
      rows[k][7] = is_ridden(mode, all) and "the muscles ride this resonance" or ""
    end
  end
  if all.drive then
    for _, name in ipairs { "times the drive", "amplification", "amplitude, m", "" } do
      columns[#columns + 1] = name
    end
  end
  return columns, rows
end

return modes
