--- supervision_study.lua: does supervision help, and does a language model help more than varying
--- the parameters at all? Ten repetitions of every arm under equal budgets of evaluations: fixed,
--- tuned_fixed, schedule, random, one_fifth, self_adaptive, bandit, rules; another run's parameters
--- as constant_median, yoked and shuffled; random materials, alone and with hyperparameters. Where
--- LIMAX_LLM_URL names an endpoint also llm, with materials, the paper's literal populations, names
--- replaced by letters, and another repetition's history. It says what it will cost, hours on two
--- cores, and goes on where it was stopped; --quick takes a minute and shows the tables alone.
--- Run it with: limax scripts/experiments/supervision_study.lua [--quick]

local study = require "limax.tools.study.study"

study.main({
  repetitions = 10, evaluations = 2100, -- 30 robots, then 21 a generation: a hundred generations
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
