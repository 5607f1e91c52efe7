--- expression.lua: the recorded genes of bred children and bodies of genomes, on every device.
--- Rates, elites, ranges and statuses are tested in tests/engine/genome, pieces in grid_test.cpp.

local host = require "limax.host"
local limax = require "limax"
local suite = require("limax.test").suite "expression"

local function population(options, count)
  return limax.engine.population { encoding = limax.engine.encoding(options),
    lattice = options.lattice, count = count }
end

suite:test("children's genomes are the recorded ones", { devices = "all" }, function(t)
  local count, indices, first = 40, {}, {}
  local parents = population({ lattice = { 3, 3, 3 }, seed = 1 }, count)
  local children = population({ lattice = { 3, 3, 3 }, seed = 1 }, count)
  parents:initialize()
  for i = 1, count do indices[i] = { i, i % count + 1 } end
  children:breed(parents, indices, { seed = 1, repetition = 1, generation = 1, elites = 4,
    mutation_rate = 0.1, mutation_scale = 0.1, crossover_rate = 0.4 }, t.device)
  for gene = 1, 20 do first[gene] = children:genome(count)[gene] end
  t:golden("genomes-1", { sha256 = host.sha256(children:genomes_bytes()), first_of_last = first })
end)

-- The first bodies, as text, and the weights of the first robot.
local function expressed(t, options, count)
  local robots, bodies, weights = population(options, 24), {}, {}
  robots:initialize()
  robots:express(limax.engine.materials "paper", { device = t.device, require_muscle = true })
  for i = 1, count do bodies[i] = robots:text(i, ".ecsb"):gsub("\n", "/") end
  for w, name in ipairs { "stiffness", "amplitude", "phase" } do
    weights[name] = robots:weights(1)[w]:table()
  end
  return bodies, weights
end

suite:test("bodies and weights are the recorded ones", { devices = "all" }, function(t)
  local bodies, weights = expressed(t, { lattice = { 4, 3, 3 }, sigma = 1, seed = 1 }, 24)
  t:golden("bodies-1", { bodies = bodies, weights = weights })
  local found = {}
  for _, network in ipairs { "cppn", "direct" } do
    bodies, weights = expressed(t, { network = network, lattice = { 4, 3, 3 }, seed = 1 }, 6)
    found[network] = { bodies = bodies, weights = weights.amplitude }
  end
  t:golden("networks", found)
end)
