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
  for gene = 1, 20 do first[gene] = children:genome(COUNT)[gene] end
  t:golden("genomes-1", { sha256 = host.sha256(children:genomes_bytes()), first_of_last = first })
end)
