--- breeding.lua: the genes of bred children, on every device. Rates and distributions are tested in
--- tests/engine/genome/breeding_test.cpp.

local host = require "limax.host"
local limax = require "limax"
local npy = require "limax.base.npy"
local suite = require("limax.test").suite "breeding"

local COUNT = 40

-- Children of the first genomes of this seed.
local function bred(t, rates)
  local encoding = limax.engine.encoding { lattice = { 3, 3, 3 }, seed = t.seed }
  local function population()
    return limax.engine.population { encoding = encoding, lattice = { 3, 3, 3 }, count = COUNT }
  end
  local parents, children, indices = population(), population(), {}
  parents:initialize()
  for i = 1, COUNT do indices[i] = { i, i % COUNT + 1 } end
  local options = { seed = t.seed, repetition = 1, generation = 1, elites = 4,
    mutation_rate = 0, mutation_scale = 0.1, crossover_rate = 0 }
  for name, value in pairs(rates) do options[name] = value end
  children:breed(parents, indices, options, t.device)
  return parents, children, options
end

suite:test("elites keep every bit", { devices = "all", seeds = { 1 } }, function(t)
  local parents, children, options = bred(t, { mutation_rate = 0.5, crossover_rate = 0.5 })
  for i = 1, options.elites do
    t:same_bits(children:genome(i):table(), parents:genome(i):table())
  end
end)

suite:test("genomes are the recorded ones", { devices = "all", seeds = { 1, 2 } }, function(t)
  local _, children, options = bred(t, { mutation_rate = 0.1, crossover_rate = 0.4 })
  local first = {}
  for gene = 1, 20 do first[gene] = children:genome(COUNT)[gene] end
  t:golden(("genomes-%d"):format(t.seed), {
    sha256 = host.sha256(children:genomes_bytes()),
    first_of_last = first }, { configuration = options })
end)

suite:test("genomes written and read have the same bits", { seeds = { 7 } }, function(t)
  local _, children = bred(t, { mutation_rate = 0.3 })
  local text = npy.encode(children:genomes_bytes(), COUNT, children.genes)
  t:equal((npy.decode(text)), children:genomes_bytes())
end)

return suite
