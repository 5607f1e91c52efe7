--- breeding.lua: the recorded genes of bred children, on every device. Rates and elites are tested
--- in tests/engine/genome.

local host = require "limax.host"
local limax = require "limax"
local suite = require("limax.test").suite "breeding"

local COUNT = 40

suite:test("genomes are the recorded ones", { devices = "all" }, function(t)
  local encoding = limax.engine.encoding { lattice = { 3, 3, 3 }, seed = 1 }
  local parents = limax.engine.population { encoding = encoding, count = COUNT }
  local children = limax.engine.population { encoding = encoding, count = COUNT }
  local indices, first = {}, {}
  parents:initialize()
  for i = 1, COUNT do indices[i] = { i, i % COUNT + 1 } end
  local options = { seed = 1, repetition = 1, generation = 1, elites = 4, mutation_rate = 0.1,
    mutation_scale = 0.1, crossover_rate = 0.4 }
  children:breed(parents, indices, options, t.device)
  return parents, children
end

-- Calls `visit(gene, first parent's, second parent's)` for every gene of a child that is no elite.
local function each_gene(parents, children, elites, visit)
  for i = elites + 1, COUNT do
    local child, a, b = children:genome(i), parents:genome(i), parents:genome(i % COUNT + 1)
    for gene = 1, child:size() do visit(child[gene], a[gene], b[gene]) end
  end
end

suite:test("crossover takes its share of the second parent", { devices = "all" }, function(t)
  local rate, taken, genes = 0.4, 0, 0
  local parents, children, options = bred(t, { crossover_rate = rate })
  each_gene(parents, children, options.elites, function(child, a, b)
    if child ~= a and child ~= b then t:ok(false, "a gene of neither parent") end
    -- biases are 0 in both
    if a ~= b then genes, taken = genes + 1, taken + (child == b and 1 or 0) end
  end)
  -- five standard deviations of a binomial share
  t:near(taken / genes, rate, { atol = 5 * math.sqrt(rate * (1 - rate) / genes) })
end)

suite:test("mutation adds N(0, scale^2) to its share of the genes", { devices = "all" },
  function(t)
    local rate, scale = 0.1, 0.2
    local mutated, genes, sum, squares = 0, 0, 0, 0
    local parents, children, options = bred(t, { mutation_rate = rate, mutation_scale = scale })
    each_gene(parents, children, options.elites, function(child, a)
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
  local _, children = bred(t, { mutation_rate = 0.1, crossover_rate = 0.4 })
  local first = {}
  for gene = 1, 20 do first[gene] = children:genome(COUNT)[gene] end
  t:golden(("genomes-%d"):format(t.seed), {
    sha256 = host.sha256(children:genomes_bytes()),
    first_of_last = first })
end)
