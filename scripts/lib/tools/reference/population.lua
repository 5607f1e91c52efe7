--- population.lua: one generation of a run.

return {
  title = "A population",
  text = "What `run:generations()` gives, and `history[n].population`: an array of robots.",
  file = "scripts/lib/evolution/population.lua", class = "limax.population.scored", prefix = "population:",
  holder = "Population:",
  stage = 'run = limax.start(limax.experiment { fitness = "walk", lattice = { 2, 2, 2 }, '
    .. "population = 6, generations = 3, genome = { sigma = 4 }, simulation = { duration = 0.1 } })"
    .. "\npopulation = run:generations()()",
  entries = {
    { "simulate", false, "population:simulate()" },
    { "score", "the fitness's", 'population:score "distance"' },
    { "breed", false, "population:breed { mutation_rate = 0.05 }" },
    { "ranked", false, "population.ranked" },
    { "generation", false, "population.generation" },
    { "repetition", false, "population.repetition" },
    { "parameters", "each parameter's own", "population.parameters" },
    { "materials", false, "population.materials" },
    { "engine", false, "population.engine" },
    { "records", "as in a population file", "population.records[1].id" },
    { "evaluations", "robots", "population.evaluations" },
    { "timing", "s", "population.timing.simulate" },
  },
}
