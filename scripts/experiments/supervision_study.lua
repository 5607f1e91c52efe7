--- supervision_study.lua: does supervision help, and does a language model help more than varying
--- the parameters at all? Ten repetitions of every arm of scripts/SUPERVISION.md under equal
--- budgets of evaluations; the arms with a language model run if LIMAX_LLM_URL names an endpoint.
--- It prints its cost first, hours on two cores, and can be stopped and started again. --quick
--- takes a minute or two and is too small for any claim.
--- Run it with: limax scripts/experiments/supervision_study.lua [--quick]

local study = require "limax.tools.study.study"

study.main({
  repetitions = 10, evaluations = 2100, -- 30 robots, then 21 per generation: a hundred generations
  experiment = {
    seed = 1, lattice = { 5, 5, 5 }, population = 30, genome = { sigma = 0.25 }, fitness = "walk",
    simulation = { duration = 5, settle = 0.5, accuracy = "evolve" }, record = {},
  },
  quick = {
    repetitions = 3, evaluations = 200,
    experiment = {
      seed = 1, lattice = { 3, 3, 3 }, population = 8, genome = { sigma = 0.25 },
      fitness = "walk", simulation = { duration = 1, settle = 0.1, accuracy = "preview" },
      record = {},
    },
  },
}, { ... })
