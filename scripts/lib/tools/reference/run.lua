--- run.lua: one repetition of an experiment.

return {
  title = "A run",
  text = "What `limax.start` gives.",
  file = "scripts/lib/evolution/evolve.lua", class = "limax.run", prefix = "run:", holder = "Run:",
  stage = 'run = limax.start(limax.experiment { fitness = "walk", lattice = { 2, 2, 2 }, '
    .. "population = 6, generations = 2, genome = { sigma = 4 }, "
    .. "simulation = { duration = 0.1 } })",
  internal = { "materials_with", "new_robots", "restore", "say" },
  entries = {
    { "generations", false, "for robots in run:generations() do robots:simulate():score() end" },
    { "finish", false, "run:finish()" },
    { "experiment", false, "run.experiment",
      what = "What it is a repetition of." },
    { "config", "each field's own", "run.config.population" },
    { "repetition", false, "run.repetition" },
    { "history", "the fitness's", "run.history" },
    { "population", false, "run.population" },
  },
}
