--- devices.lua: a GPU and the CPU compute the same motion within a tolerance. Genomes and bodies
--- are compared in tests/engine/backend/cuda. SI units.

local agreement = require "limax.tools.bench.agreement"
local bodies = require "limax.tools.bench.bodies"
local engine = require "limax.engine"
local device_cases = require "support.device_cases"

local suite = require("limax.test").suite "devices"

local materials = engine.materials "paper"
local begin = device_cases.begin
local ALL = bodies.ALL
local PRECISIONS = { "single", "compensated", "double" }
local INTEGRATORS = { "leapfrog", "symplectic_euler" }

-- Energies depend on positions over a stretch of 1e-4 of a length: fp32 loses three digits.
local function near_energies(t, got, expected, precision)
  for column = 1, 4 do
    local largest, a, b = 0, {}, {}
    for sample, row in ipairs(expected) do
      a[sample], b[sample] = got[sample][column], row[column]
      largest = math.max(largest, math.abs(row[column]))
    end
    t:near(a, b, { atol = precision == "double" and 1e-9 * largest + 1e-12
      or 0.05 * largest + 1e-4 })
  end
end

-- Compares one robot of two simulations; `atol` of positions, m.
local function near(t, got, expected, robot, precision, atol)
  local a, b = got:outcome(robot), expected:outcome(robot)
  for _, name in ipairs { "status", "reason", "step", "steps", "masses", "springs", "coarse" } do
    t:equal(a[name], b[name])
  end
  for _, name in ipairs { "time_step", "time_step_bound", "mass" } do
    t:same_bits(a[name], b[name])
  end
  if a.status ~= "done" then return end
  for _, name in ipairs { "center_start", "center_middle", "center_end", "block_start",
    "block_middle", "block_end", "block_upright" } do
    t:near(a[name], b[name], { atol = atol })
  end
  t:near(a.block_velocity, b.block_velocity, { atol = 1e3 * atol })
  t:equal(got:sites(robot):table(), expected:sites(robot):table())
  t:near((got:state(robot)):table(), (expected:state(robot)):table(), { atol = atol })
  -- an activation follows strains over their range of 0.2 of an edge of 0.1 m
  local factors = { center_of_mass = 1, position = 1, block = 10, activation = 100,
    strain = not got.record.block and 20 or nil }
  for kind in pairs(got.record) do
    local rows, other = got:trace(robot, kind):table(), expected:trace(robot, kind):table()
    t:equal(#rows, #other)
    if factors[kind] then t:near(rows, other, { atol = factors[kind] * atol }) end
    -- a block amplifies differences of the last bits
    if kind == "energy" and not got.record.block then near_energies(t, rows, other, precision) end
  end
  -- a mass at the ground's height touches or not by its last bit
  if not got.record.block then t:near(a.contact, b.contact, { atol = 0.02 }) end
end

local function agrees(t, case, population, how, atol)
  local got = begin(case, population, how, t.device)
  local expected = begin(case, population, how, engine.device "cpu")
  got:run()
  expected:run()
  for robot = 1, population.count do near(t, got, expected, robot, how.precision, atol) end
  got:free()
  expected:free()
end

for _, case in ipairs(device_cases.list) do
  suite:test(case.name .. " moves as on the CPU", { devices = "cuda", precisions = "all",
    integrators = INTEGRATORS }, function(t)
    for _, lattice in ipairs(case.lattices) do
      -- after some hundred steps; coordinates of a long body are rounded more coarsely
      local atol = (t.precision == "double" and 1e-11 or 3e-5) * math.max(1, 0.1 * lattice[1])
      agrees(t, case, (case.make or device_cases.hollow)(lattice), t, atol)
    end
  end)
end

local SCENES = {
  { "all", ALL },
  { "undamped", { gravity = true, ground = true, friction = true, actuation = true } },
  { "muscles", { actuation = true, damping = true } }, { "air", { gravity = true } },
  { "free", {} },
}

-- from one voxel to bodies of more than a block of threads
for l, lattice in ipairs { { 1, 1, 1 }, { 3, 3, 3 }, { 4, 3, 2 }, { 5, 5, 5 }, { 6, 6, 6 },
  { 10, 2, 3 }, { 8, 8, 8 }, { 10, 10, 10 } } do
  for _, full in ipairs { false, true } do
    suite:test(("walkers of %dx%dx%d%s move as on the CPU"):format(lattice[1], lattice[2],
      lattice[3], full and " in every combination" or ""),
      { devices = "cuda", tags = full and "full" or nil }, function(t)
      local population = bodies.population(materials, lattice, 8, { hollow = true })
      for p, precision in ipairs(PRECISIONS) do
        for s, scene in ipairs(SCENES) do
          for i, integrator in ipairs(INTEGRATORS) do
            -- every pair of lattice, precision and scene
            if full or (l + p) % #SCENES + 1 == s and (l + s) % #INTEGRATORS + 1 == i then
              agrees(t, { scene = function() return scene[2] end, options = {
                duration = agreement.DURATION, settle = agreement.SETTLE,
                time_step = agreement.TIME_STEP } }, population,
                { precision = precision, integrator = integrator },
                agreement.tolerance(precision, scene[2]))
            end
          end
        end
      end
    end)
  end
end
