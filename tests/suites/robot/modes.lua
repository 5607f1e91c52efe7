--- modes.lua: a body that is kicked in the shape of a mode rings at the frequency of the mode and
--- calms down by its damping ratio. tests/engine/physics/modes_test.cpp compares many modes with a
--- dense solution.

local limax = require "limax"
local suite = require("limax.test").suite "modes"

-- Simulates a body in double from its pose, kicked with `speed` m/s of a mode's shape, and returns
-- its path along the shape, m, and the time between samples, s.
local function ring(robot, all, mode, scene, speed)
  local shape, pose, rate = mode.shape:table(), all.pose:table(), 2000
  local kick = {}
  for m, move in ipairs(shape) do
    kick[m] = { speed * move[1], speed * move[2], speed * move[3] }
  end
  local moving = robot:begin { scene = scene, settle = 0,
    duration = math.ceil(12 * rate / mode.frequency) / rate, device = "cpu", precision = "double",
    integrator = "leapfrog", time_step = 1e-4, record = { position = rate } }
  moving.simulation:place(1, pose, kick)
  local path = {}
  for k, sample in ipairs(moving:finish():trace "position") do
    path[k] = 0
    for m, place in ipairs(sample) do
      for axis = 1, 3 do
        path[k] = path[k] + shape[m][axis] * (place[axis] - pose[m][axis])
      end
    end
  end
  return path, 1 / rate
end

-- Frequency of a path and its damping ratio, from where it crosses 0 and how far it goes between.
local function ringing(path, interval)
  local crossings, peaks, peak = {}, {}, 0
  for k = 2, #path do
    peak = math.max(peak, math.abs(path[k]))
    if path[k - 1] * path[k] < 0 then
      crossings[#crossings + 1] = interval * (k - 1 + path[k - 1] / (path[k - 1] - path[k]))
      peaks[#peaks + 1], peak = peak, 0
    end
  end
  local n = #crossings
  return (n - 1) / 2 / (crossings[n] - crossings[1]), math.log(peaks[2] / peaks[n]) / math.pi
    / (n - 2)
end

local BODY = { voxels = "esb\nse.\n\ns.b\nsse" }

suite:test("a body rings: free, standing on the ground, and hanging from anchors", function(t)
  local robot = limax.robot(BODY)
  local ground = { gravity = true, ground = { damping_ratio = 0 }, friction = true }
  local hanging = { gravity = true,
    anchors = { from = { -0.01, -0.01, -0.01 }, to = { 0.01, 1, 1 } } }
  for _, case in ipairs {
    { scene = {}, rigid = 6, rtol = 1e-5, speed = 1e-4 },
    { scene = { damping = true }, rigid = 6, rtol = 2e-3, speed = 1e-4 },
    { scene = ground, standing = true, rigid = 0, rtol = 1e-4, speed = 1e-5 },
    { scene = hanging, standing = true, rigid = 0, rtol = 1e-4, speed = 1e-5 },
  } do
    local all = robot:modes(3, { scene = case.scene, standing = case.standing })
    t:equal({ #all, all.rigid, all.standing, all.drive }, { 3, case.rigid, case.standing or false })
    for _, mode in ipairs(all) do
      local frequency, ratio = ringing(ring(robot, all, mode, case.scene, case.speed))
      t:near(frequency, mode.frequency, { rtol = case.rtol })
      if not case.standing then
        t:near(ratio, mode.damping_ratio, { rtol = 0.03, atol = 1e-5 })
        t:equal(mode.damping_ratio > 0, case.scene.damping == true)
      end
    end
  end
  t:raises("it slides, rolls or falls in this scene; leave standing out",
    function() robot:modes(1, { scene = { gravity = true }, standing = true }) end)
end)
