--- sameness.lua: hard cases where two runs must agree: mirrored, beside others, after a failure,
--- with an effect that never acts, and evolved against a coarse step. SI units.

local engine = require "limax.engine"

local cases = {}

local function case(fields) cases[#cases + 1] = fields end

-- Why XPBD is not asked.
local IN_ORDER = "springs come in an order, whose mirror image is another"

local SOFTER = "its bodies are stiffer at a tenth of the step, and half as fast there"

local LAND = { gravity = true, ground = true, friction = true, damping = true, actuation = true }

-- A body whose materials and phases are their own mirror image at y = 0.2 m.
local SYMMETRIC = { lattice = { 4, 4, 2 },
  voxels = function(x, y, z)
    local k = (2 * x + 3 * math.min(y, 5 - y) + z) % 4 + 1
    return ("ecsb"):sub(k, k)
  end,
  weights = { phase = function(x, y) return (3 * x + math.min(y, 5 - y)) % 7 / 7 end } }

-- How far a body is from its own mirror image at `y`, m.
local function asymmetry(positions, nx, ny, y)
  local most = 0
  for i, p in ipairs(positions) do
    local row = math.floor((i - 1) / nx) % ny
    local q = positions[i + (ny - 1 - 2 * row) * nx]
    most = math.max(most, math.abs(p[1] - q[1]), math.abs(p[2] + q[2] - 2 * y),
      math.abs(p[3] - q[3]))
  end
  return most
end

for _, ground in ipairs { false, true } do
  case { row = 49, name = "mirror symmetry " .. (ground and "on the ground" or "in the air"),
    smooth = not ground, except = { xpbd = IN_ORDER }, run = function(c)
      local spec = { duration = ground and 0.25 or 1, energy = false, center_tolerance = 10,
        scene = { gravity = ground or { acceleration = { 0, 0, -0.5 } }, ground = ground,
          friction = ground, damping = true, actuation = true },
        position = { 0, 0, ground and 0.01 or 0 } }
      for name, value in pairs(SYMMETRIC) do spec[name] = value end
      -- sums in another order differ by their last bits, which contact carries on
      c:at_most("distance to the mirror image", asymmetry(c:run(spec):state(), 5, 5, 0.2),
        ground and c:by_precision { double = 1e-6, fp32 = 1e-3 }
          or c:by_precision { double = 1e-9, fp32 = 1e-5, single = 1e-4 })
    end }
end

case { row = 49, name = "the same body in a larger lattice", run = function(c)
  -- Its masses have other numbers there. An edge of 1/8 m keeps every place exact, so that the same
  -- sums in the same order give the same bits.
  local edge = 0.125
  local function ends(margin)
    local n = { 3 + 2 * margin, 2 + margin, 2 + margin }
    local run = c:run { lattice = n, edge = edge, duration = 0.5, scene = LAND, energy = false,
      -- of the body's lowest corner
      position = { 0, 0, 0.25 }, time_step = 2e-4,
      voxels = function(x, y, z)
        x, y = x - margin, y - margin
        if x < 1 or x > 3 or y < 1 or y > 2 or z > 2 then return "." end
        local k = (2 * x + 3 * y + z) % 4 + 1
        return ("ecsb"):sub(k, k)
      end, weights = { phase = function(x, y) return (3 * (x - margin) + y - margin + 9) % 7 / 7
      end } }
    return run:state()
  end
  local small, large = ends(0), ends(2)
  if c.device.kind == "cpu" then c:same_bits("places", large, small) end
  -- a GPU shares the springs of a mass among threads by the number of sites, and joins other sums
  for i, p in ipairs(small) do
    for axis = 1, 3 do
      c:near(("place of mass %d"):format(i), large[i][axis], p[axis],
        { atol = c:by_precision { double = 1e-9, fp32 = 1e-3 } })
    end
  end
end }

-- Voxels of a crowd: each robot another one, robot `k` always the same.
local function crowd(count, mine, thrown)
  return { lattice = { 2, 1, 1 }, count = count, duration = 0.2, scene = LAND, energy = false,
    may_diverge = { "speed", "nonfinite", "stretch" }, center = false,
    voxels = function(x, _, _, robot)
      local k = mine[robot] and 2 or robot
      return ("ecsb"):sub((x + k) % 4 + 1, (x + k) % 4 + 1)
    end,
    place = function(_, velocities, robot)
      if not thrown[robot] then return false end
      for i = 1, #velocities do velocities[i] = { 1e30 * (-1) ^ i, 0, 1e30 } end
    end }
end

case { row = 52, name = "alone and among 4096, beside robots that burst", brief = true,
  run = function(c)
    -- `prepare` places by asking for states, robot by robot
    local count = c.full and 4096 or 512
    local slots = { 1, 18, count }
    local mine, thrown = {}, {}
    for _, slot in ipairs(slots) do
      mine[slot] = true
      if slot < count then thrown[slot + 1] = true end
    end
    local alone = c:run(crowd(1, { true }, {}))
    local among = c:run(crowd(count, mine, thrown))
    local expected, speeds = alone:state()
    for _, slot in ipairs(slots) do
      local positions, velocities = among:state(slot)
      c:same_bits(("places in slot %d"):format(slot), positions, expected)
      c:same_bits(("speeds in slot %d"):format(slot), velocities, speeds)
    end
    for slot in pairs(thrown) do
      c:same_bits("a robot that burst", among:outcome(slot).status, "diverged")
      c:at_most("step at which it is found out", among:outcome(slot).step, 64)
    end
    c.reported = nil
  end }

case { row = 53, name = "an effect that never acts", run = function(c)
  local function ends(scene)
    scene.gravity, scene.damping = true, true
    return (c:run { lattice = { 3, 2, 2 }, voxels = "s", position = { 0, 0, 100 }, duration = 1,
      time_step = 2e-4,
      scene = scene, center_tolerance = 10 }:state())
  end
  -- 1 s of fall ends high above the ground
  local bare = ends {}
  c:same_bits("places with a ground", ends { ground = true }, bare)
  c:same_bits("places with friction", ends { ground = true, friction = true }, bare)
end }

case { row = 56, name = "after a failure, as if nothing had been", run = function(c)
  local function fresh()
    return (c:run { lattice = { 2, 2, 2 }, voxels = "e", scene = LAND, duration = 0.3 }:state())
  end
  local before = fresh()
  local burst = c:run { lattice = { 2, 2, 2 }, voxels = "e", scene = LAND, duration = 0.3,
    place = function(_, velocities)
      for i = 1, #velocities do velocities[i] = { 1e38 * (-1) ^ i, -1e38, 1e38 } end
    end, diverges = { "nonfinite", "speed", "stretch" } }
  c:at_most("step at which it is found out", burst:outcome().step, 64)
  c.reported = nil
  c:same_bits("places", fresh(), before)
end }

-- A small evolution of bodies for speed on ice, and its best robot's population and index.
local function evolved(c, materials, scene, options, generations, count)
  local encoding = engine.encoding { lattice = { 3, 3, 3 }, materials = materials.count, seed = 57,
    repetition = 1, features = 8, sigma = 0.5, hidden = { 16 }, initial_scale = 1 }
  local parents = engine.population { count = count, encoding = encoding }
  parents:initialize()
  local best
  for generation = 1, generations do
    parents:express(materials, { device = c.device, require_muscle = true })
    local simulation = engine.simulation(parents, materials, scene, options, c.device)
    simulation:run()
    local ranked, scores = {}, {}
    for i = 1, count do
      local outcome = simulation:outcome(i)
      if outcome.status == "done" then
        ranked[#ranked + 1] = i
        scores[i] = math.sqrt((outcome.center_end[1] - outcome.center_start[1]) ^ 2
          + (outcome.center_end[2] - outcome.center_start[2]) ^ 2)
        -- what moves was paid for by the muscles: at the sample rate their work is known to a few
        -- per cent
        c:at_most(("generation %d, robot %d: mean kinetic energy"):format(generation, i),
          outcome.kinetic, 1.1 * outcome.muscle_work + 0.5)
      elseif outcome.status == "diverged" then
        error(("robot %d of generation %d diverged: %s"):format(i, generation, outcome.reason), 0)
      end
    end
    table.sort(ranked, function(a, b) return scores[a] > scores[b] or (scores[a] == scores[b]
      and a < b) end)
    best = { population = parents, index = ranked[1], score = scores[ranked[1]] }
    if generation < generations then
      local pairs_of_parents = {}
      for child = 1, count do
        pairs_of_parents[child] = { ranked[(child - 1) % math.min(4, #ranked) + 1],
          ranked[child % math.min(6, #ranked) + 1] }
      end
      local children = engine.population { count = count, encoding = encoding }
      children:breed(parents, pairs_of_parents, { mutation_rate = 0.1, mutation_scale = 0.2,
        crossover_rate = 0.4, seed = 57, repetition = 1, generation = generation, elites = 2 },
        c.device)
      parents = children
    end
  end
  return best
end

-- How far a ledger's energies since t = 0 are from its works at the worst sample, over what went
-- through: four energies, then five works.
local function books_off(trace)
  local worst, largest, held, through = 0, 0, nil, 0
  for sample = 1, trace:size() do
    local row = trace[sample]
    local energy, works = row[1] + row[2] + row[3] + row[4], 0
    through = 0
    for k = 5, 9 do works, through = works + row[k], through + math.abs(row[k]) end
    held = held or energy
    worst = math.max(worst, math.abs(energy - held - works))
    largest = math.max(largest, row[1] + row[2] + row[3] + math.abs(row[4] - trace[1][4]))
  end
  return worst / (through + largest)
end

case { row = 57, name = "what evolution finds on ice is no defect", brief = true,
  except = { xpbd = SOFTER }, run = function(c)
  local materials = c:materials()
  local scene = engine.scene { gravity = true, ground = true, damping = true, actuation = true,
    friction = { static = 1e-3, kinetic = 1e-3 } }
  local function options(fraction, kind)
    return { integrator = c.integrator, precision = c.precision, time_step = "auto", settle = 0.5,
      duration = 2, bound_fraction = fraction, record = { [kind] = 200 } }
  end
  local best = evolved(c, materials, scene, options(0.9, "energy"), c.full and 50 or 6,
    c.full and 32 or 12)
  local mask = {}
  for i = 1, best.population.count do mask[i] = i == best.index end
  -- a GPU keeps no books
  local books = c.device.kind == "cpu"
  local again = engine.simulation(best.population, materials, scene,
    options(0.09, books and "ledger" or "energy"), c.device, mask)
  again:run()
  local outcome = again:outcome(best.index)
  c:same_bits("status at a tenth of the step", outcome.status, "done")
  local score = math.sqrt((outcome.center_end[1] - outcome.center_start[1]) ^ 2
    + (outcome.center_end[2] - outcome.center_start[2]) ^ 2)
  c:note("fitness %.4g m, at a tenth of the step %.4g m", best.score, score)
  c:at_least("fitness at a tenth of the step", score, 0.8 * best.score)
  if books then
    -- what the engine's own page promises of a walk: leapfrog twice that of an eighth of the
    -- automatic step; symplectic Euler what it promises of the whole one, for slow bodies on ice
    -- hold most of their energy in springs
    local off = books_off(again:trace(best.index, "ledger"))
    c:note("its energy's books are off by %.2g of what went through", off)
    c:at_most("error of its energy's books", off, c.integrator == "leapfrog" and 2e-5
      or 2e-3)
  end
end }

return cases
