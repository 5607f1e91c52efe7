--- by_hand.lua: one robot written by hand, dropped, and walking. Shows bodies as letters, a scene
--- named effect by effect, and traces. One or two seconds.
--- Run it with: limax scripts/experiments/by_hand.lua

local limax = require "limax"

-- letters: . empty, e expanding muscle, c contracting muscle, s soft tissue, b bone; the lowest
-- layer first
local robot = limax.robot {
  voxels = [[
    e.c
    e.c

    sss
    sss

    .b.
    .b.
  ]],
  weights = { phase = 0.5 }, -- of the muscles' largest phase
}
print(robot)

-- dropped from half a metre, without actuation
local dropped = robot:simulate {
  scene = limax.scenes.land { actuation = false },
  position = { 0, 0, 0.5 }, -- m
  settle = 0, duration = 2, -- s
  record = { center_of_mass = 100, strain = 100 }, -- Hz
}
local height = dropped:trace "center_of_mass"
local mean, most = dropped:strain()
print(("\ndropped: the centre of mass falls from %.3f m to %.3f m"):format(height[1][3],
  height[height:size()][3]))
print(("strain: %.1f %% on average, %.1f %% at most"):format(100 * mean, 100 * most))

-- walking on the ground
local walked = robot:simulate { scene = limax.scenes.land { actuation = { frequency = 2 } },
  duration = 5 }
print(("walking: %.3f m in 5 s, %.3f m of path"):format(walked:distance(), walked:path_length()))
