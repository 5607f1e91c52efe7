--- diversity.lua: how different the robots of a population are.

return {
  title = "limax.diversity",
  text = "Measures of a scored population.",
  file = "scripts/lib/run/diversity.lua", prefix = "limax.diversity.", holder = "diversity.",
  stage = 'run = limax.start(limax.experiment { fitness = "walk", lattice = { 2, 2, 2 }, '
    .. "population = 6, generations = 2, genome = { sigma = 4 }, simulation = { duration = 0.1 } })"
    .. "\npopulation = run:generations()():simulate():score()",
  entries = {
    { "hamming", "share of voxels, 0 to 1", "limax.diversity.hamming(population)" },
    { "genotype", "genes", 'limax.diversity.genotype(population, "top")' },
    { "distinct", "bodies", "limax.diversity.distinct(population)" },
    { "material_shares", "1", "limax.diversity.material_shares(population)" },
    { "top_half", false, "limax.diversity.top_half(population.ranked)" },
    { "measure", "as above", "limax.diversity.measure(population.engine, population.ranked, "
      .. "population.materials).all.hamming" },
  },
}
