--- breeding.lua: parents become children: elites as they are, every gene from one of two parents or
--- near it, the same bits on every device and in a golden.

local host = require "limax.host"
local limax = require "limax"
local npy = require "limax.base.npy"
local suite = require("limax.test").suite "breeding"

local COUNT = 40

-- Parents of this seed, and their children under these rates.
local function bred(t, rates)
  local encoding = limax.engine.encoding { lattice = { 3, 3, 3 }, seed = t.seed or 1 }
  local function population()
    return limax.engine.population { encoding = encoding, lattice = { 3, 3, 3 }, count = COUNT }
  end
  local parents, children = population(), population()
  parents:initialize()
  local pairs_of_indices = {}
  for i = 1, COUNT do pairs_of_indices[i] = { i, i % COUNT + 1 } end
  local given = { seed = t.seed or 1, repetition = 1, generation = 1, elites = 4,
    mutation_rate = 0, mutation_scale = 0.1, crossover_rate = 0 }
  for name, value in pairs(rates) do given[name] = value end
  children:breed(parents, pairs_of_indices, given, t.device)
  return parents, children, given
end

-- Calls `see(child gene, first parent's, second parent's)` for every gene that is bred.
local function each_gene(parents, children, elites, see)
  for i = elites + 1, COUNT do
    local child, a, b = children:genome(i), parents:genome(i), parents:genome(i % COUNT + 1)
    for gene = 1, child:size() do see(child[gene], a[gene], b[gene]) end
  end
end

suite:test("elites keep every bit", { devices = "all", seeds = { 1, 2 } }, function(t)
  local parents, children, given = bred(t, { mutation_rate = 0.5, crossover_rate = 0.5 })
  for i = 1, given.elites do
    t:same_bits(children:genome(i):table(), parents:genome(i):table())
  end
end)

suite:test("without rates a child is its first parent", { devices = "all" }, function(t)
  local parents, children = bred(t, {})
  each_gene(parents, children, 0, function(child, a) if child ~= a then t:equal(child, a) end end)
end)

suite:test("crossover takes its share of the second parent", { devices = "all" }, function(t)
  local rate, taken, genes = 0.4, 0, 0
  local parents, children, given = bred(t, { crossover_rate = rate })
  each_gene(parents, children, given.elites, function(child, a, b)
    if child ~= a and child ~= b then t:ok(false, "a gene of neither parent") end
    -- biases begin at 0 in both
    if a ~= b then
      genes = genes + 1
      taken = taken + (child == b and 1 or 0)
    end
  end)
  -- five standard deviations of a binomial share
  t:near(taken / genes, rate, { atol = 5 * math.sqrt(rate * (1 - rate) / genes) })
end)

suite:test("mutation adds N(0, scale^2) to its share of the genes", { devices = "all" },
  function(t)
    local rate, scale = 0.1, 0.2
    local mutated, genes, sum, squares = 0, 0, 0, 0
    local parents, children, given = bred(t, { mutation_rate = rate, mutation_scale = scale })
    each_gene(parents, children, given.elites, function(child, a)
      genes = genes + 1
      if child ~= a then
        mutated, sum, squares = mutated + 1, sum + (child - a), squares + (child - a) ^ 2
      end
    end)
    t:near(mutated / genes, rate, { atol = 5 * math.sqrt(rate * (1 - rate) / genes) })
    t:near(sum / mutated, 0, { atol = 5 * scale / math.sqrt(mutated) })
    -- the variance of a squared normal number is 2
    t:near(squares / mutated, scale ^ 2, { rtol = 5 * math.sqrt(2 / mutated) })
  end)

suite:test("genomes are the recorded ones", { devices = "all", seeds = { 1, 2 } }, function(t)
  local _, children, given = bred(t, { mutation_rate = 0.1, crossover_rate = 0.4 })
  local first = {}
  for gene = 1, 20 do first[gene] = children:genome(COUNT)[gene] end
  t:golden(("genomes-%d"):format(t.seed), {
    sha256 = host.sha256(children:genomes_bytes()),
    first_of_last = first }, { configuration = given })
end)

suite:test("genomes written and read are the same bits", { seeds = { 1, 7 } }, function(t)
  local _, children = bred(t, { mutation_rate = 0.3 })
  local text = npy.encode(children:genomes_bytes(), COUNT, children.genes)
  t:equal((npy.decode(text)), children:genomes_bytes())
end)

return suite
