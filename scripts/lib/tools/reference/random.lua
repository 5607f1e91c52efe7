--- random.lua: the random numbers that selection and supervisors are given.

return {
  title = "Random numbers",
  text = "The `random` of selection and supervisors, from the seed of the run.",
  file = "bindings/engine/random.lua", class = "limax.random", prefix = "random:",
  holder = "methods:",
  stage = 'random = limax.engine.random(1, 1, "user")',
  entries = {
    { "integer", "1", "random:integer(6)" },
    { "uniform", "1", "random:uniform()" },
    { "normal", "1", "random:normal()" },
    { "draw", "numbers", "random.draw" },
  },
}
