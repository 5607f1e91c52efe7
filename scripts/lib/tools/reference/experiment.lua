--- experiment.lua: a checked experiment.

return {
  title = "An experiment",
  text = "What `limax.experiment` gives.",
  file = "scripts/lib/experiment/experiment.lua", class = "limax.experiment", prefix = "experiment:",
  holder = "Experiment:",
  stage = 'experiment = limax.experiment { fitness = "walk", lattice = { 2, 2, 2 } }',
  entries = {
    { "override", "each field's own", 'experiment:override { "population=12" }' },
    { "config", "each field's own", "experiment.config.simulation" },
    { "notes", false, "experiment.notes" },
    { "scripts", false, "experiment.scripts" },
    { "origin", false, "experiment.origin" },
    { "fitness", false, "experiment.fitness.name",
      what = "The resolved fitness: name, function, traces." },
    { "selection", false, "experiment.selection",
      what = "The resolved scheme." },
    { "supervisor", false, "experiment.supervisor.name",
      what = "The resolved supervisor." },
  },
}
