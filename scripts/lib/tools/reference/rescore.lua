--- rescore.lua: robots scored again under another accuracy.

return {
  title = "limax.rescore",
  text = "Robots of a population, simulated and scored again under another setting.",
  file = "scripts/lib/evolution/rescore.lua", prefix = "limax.rescore.", holder = "rescore.",
  stage = 'run = limax.start(limax.experiment { fitness = "walk", lattice = { 2, 2, 2 }, '
    .. "population = 6, generations = 2, genome = { sigma = 4 }, simulation = { duration = 0.1 } })"
    .. "\npopulation = run:generations()():simulate():score()",
  entries = {
    { "population", "the fitness's; m; s",
      'limax.rescore.population(population, { accuracy = "preview" }, { 1, 2 })' },
    { "options", "s", 'limax.rescore.options(run.config, { accuracy = "preview" }).precision' },
  },
}
