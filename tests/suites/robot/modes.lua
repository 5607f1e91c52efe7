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

-- How far a body moves in a mode, m: its masses are equal, so shapes are orthogonal.
local function amplitude_in(robot, all, mode, scene)
  -- until the start has died out to 1e-3
  local duration = math.ceil(7 / (2 * math.pi * mode.frequency * mode.damping_ratio)) + 1
  local moved = robot:simulate { scene = scene, duration = duration, settle = 0, device = "cpu",
    precision = "double", record = { position = 200 } }
  local shape, pose, least, most = mode.shape:table(), all.pose:table(), math.huge, -math.huge
  local trace = moved:trace "position"
  for k = #trace - 200, #trace do
    local along, squared = 0, 0
    for m, place in ipairs(trace[k]) do
      for axis = 1, 3 do
        along = along + shape[m][axis] * (place[axis] - pose[m][axis])
        squared = squared + shape[m][axis] ^ 2
      end
    end
    least, most = math.min(least, along / squared), math.max(most, along / squared)
  end
  return (most - least) / 2
end

suite:test("muscles move each mode as far as its amplitude says, near a resonance too", function(t)
  local bodies = { "eee", "ses\n\nece", "ee\nss\n\nce\nse", "ecs\nsce", "esc\n\ns.e" }
  for _, voxels in ipairs(bodies) do
    local robot = limax.robot { voxels = voxels, weights = { amplitude = 0.02 } }
    local scene = { damping = true, anchors = { from = { -0.01, -0.01, -0.01 },
      to = { 0.01, 1, 1 } }, actuation = { frequency = 1 } }
    for _, share in ipairs { 0.5, 0.95, 1.5 } do
      scene.actuation.frequency = share * robot:modes(1, { scene = scene })[1].frequency
      local all = robot:modes(6, { scene = scene })
      local first = all[1]
      for _, mode in ipairs(all) do
        if mode.amplitude > first.amplitude then first = mode end
      end
      t:near(amplitude_in(robot, all, first, scene), first.amplitude, { rtol = 0.04 })
    end
  end
end)
