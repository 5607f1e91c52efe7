--- report_replay.lua: the motion of a robot and its world as a report stores them.

local limax = require "limax"
local motion = require "limax.draw.motion"
local polygon = require "limax.draw.picture.polygon"
local replay = require "limax.tools.report.replay"
local world = require "limax.draw.picture.world"

local suite = require("limax.test").suite "report, replays"

local function simulated(layers, scene, duration)
  local body = limax.robot { voxels = (("ecsbe\n"):rep(5) .. "\n"):rep(layers) }
  local walked = motion.simulate(body, { scene = scene, duration = duration })
  return replay.of(walked), walked, #replay.packed(walked)
end

suite:test("a robot of 5x5x5 voxels takes less than 150 kB for 5 s", { limit = 30 }, function(t)
  local data, walked, size = simulated(5, limax.scenes.land(), 5)
  -- all masses except the inner 4x4x4
  t:equal({ data.masses, #data.materials }, { 216 - 64, 150 })
  t:equal((data.samples - 1) / data.rate, walked:duration())
  local row, height = walked:trace "position", 0
  for s = 0, data.samples - 1 do height = height + data.steps[s * data.masses * 3 + 3] end
  t:near(height * data.step, row[row:size()][1][3], { atol = data.step })
  t:ok(size < 150e3, ("%d bytes"):format(size))
end)

suite:test("the world of a replay is small, and what is far away is left out", { limit = 30 },
  function(t)
    local heights, many = {}, { planes = {}, boxes = {}, spheres = {} }
    for x = 1, 500 do
      heights[x] = {}
      for y = 1, 500 do heights[x][y] = -0.01 * math.sin(x * y) - 0.01 end
    end
    for k = 1, 16 do
      many.planes[k] = { normal = { 0.01 * k, 0, 1 }, offset = -0.1 }
      many.boxes[k] = { from = { k, 0, 0 }, to = { k + 0.5, 1, 0.1 } }
      many.spheres[k] = { center = { 0.5 * k, 2, 0 }, radius = 0.1 }
    end
    many.terrain = { spacing = 0.03, origin = { -5, -5, 0 }, heights = heights }
    local data, _, size = simulated(2, limax.scenes.land(many), 0.2)
    t:ok(size < 150e3, ("%d bytes"):format(size))
    for _, part in ipairs(data.world.parts) do
      t:ok(part.points[1] < 4, ("%g m"):format(part.points[1]))
    end
  end)

suite:test("the world of a replay has each thing where it is", function(t)
  local data = simulated(1, { gravity = true, ground = { height = -0.5 },
    boxes = { { from = { 1, -1, 0 }, to = { 1.25, 1, 0.2 } } },
    planes = { normal = { 0, 2, 0 }, offset = -1 },
    terrain = { spacing = 1, origin = { -2, -2, -0.5 }, heights = { { 0, 0.1 }, { 0.2, 0 } } } },
    0.1)
  local found = {}
  for _, part in ipairs(data.world.parts) do
    local name = part.wall and "wall" or #part.points == 6 and "rule" or part.ink == world.ink
      and "box" or part.edges[1] and "terrain" or "ground"
    found[name] = found[name] or { polygon.bounds(3) }
    for k = 1, #part.points, 3 do found[name][3] { unpack(part.points, k, k + 2) } end
  end
  t:equal({ found.box[1], found.box[2] }, { { 1, -1, 0 }, { 1.25, 1, 0.2 } })
  t:equal({ found.wall[1][2], found.wall[2][2], found.wall[1][3] }, { -1, -1, -0.5 })
  t:equal({ found.ground[1][3], found.ground[2][3] }, { -0.5, -0.5 })
  t:near(found.terrain[2][3], -0.3, { atol = 0.02 })
  t:ok(found.rule, "lines on the ground")
end)

return suite
