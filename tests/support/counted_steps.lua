--- counted_steps.lua: the script that effects_cost.lua runs under valgrind: a number of steps of
--- one full body of 5x5x5 voxels. Arguments: the steps, and the scene as JSON.

local bodies = require "limax.tools.bench.bodies"
local engine = require "limax.engine"
local host = require "limax.host"

local materials = engine.materials "paper"
local simulation = engine.simulation(bodies.population(materials, { 5, 5, 5 }, 1), materials,
  engine.scene(host.json.decode(arg[2], "scene")),
  { duration = 100, time_step = 1e-4, settle = 0 },
  engine.device("cpu", { threads = 1 }))
-- creates the robot, outside of what is counted
simulation:state(1)
simulation:advance(1000, tonumber(arg[1]))
