--- paper.lua: the experiment of "CUDA-Accelerated Soft Robot Neural Evolution with Large Language
--- Model Supervision" with every number of its tables, at its time step of 1e-5 s. 3 repetitions of
--- 100 generations of 30 robots are 9000 simulations of 550 000 steps: about three hours on two
--- cores; with --set generations=2 --set repetitions=1 --set population=4, ten seconds.
--- Run it with: limax run scripts/experiments/paper.lua
---
--- The paper's arms are runs with and without a model, GPT-4-Turbo, that sees whole populations.
--- These are they; the second needs an endpoint (lib/supervise/llm/README.md):
---   limax run scripts/experiments/paper.lua --set supervisor=fixed
---   limax run scripts/experiments/paper.lua --set 'supervisor=["llm"]' \
---     --set supervisor.context=paper --set supervisor.model=gpt-4-turbo
---
--- `not_in_paper` lists what the paper does not state and we chose. The report prints the list.

local limax = require "limax"

local not_in_paper = {
  "fitness: the plain horizontal distance between start and end",
  "duration: 5 s from the start of actuation",
  "settle: 0.5 s of rest before actuation starts",
  "waveform: rest lengths change by sin(2 pi f t + phase), from t = 0 without a ramp",
  "frequency: all muscles at 2 Hz",
  "sign: plus for an expanding muscle, minus for a contracting one",
  "springs: 28 per voxel, between every two of its corners; neighbours share them",
  "masses: a site is one mass, 0.1 kg, however many voxels share it",
  "network: two hidden layers of 32, tanh",
  "features: 16 rows of B, 32 inputs; B is drawn once per repetition",
  "input: the centres of the outer voxels are at -1 and 1 along each axis",
  "sigma: 1 (the paper took it from a sweep whose values it does not give)",
  "initial weights: N(0, 1 / fan_in), biases 0",
  "weights: three sigmoids multiply stiffness, amplitude and phase; mass and damping stay",
  "stiffness weights: at least 0.2, else a soft body collapses under its own weight",
  "largest face-connected component kept; a body without a muscle is not simulated",
  "selection: tournaments of 3",
  "crossover: uniform, a gene comes from the second parent with the crossover rate",
  "mutation: a gene changes with the mutation rate by N(0, scale^2)",
  "elites: copied, and not simulated again while nothing that they depend on changes",
  "generations counted from 0 to 99, the initial population included",
  "spring sharing: a spring of several voxels takes the mean of their stiffness",
  "integrator: symplectic Euler",
  "precision: single with compensated sums",
  "damping reference: c = 2 zeta sqrt(k m_r), m_r the pair's reduced mass; for contact, the mass",
  "friction: the table's static 0.6 below kinetic 1.0 is kept, though probably swapped",
  "diversity measure: mean share of voxels in which two robots differ",
  "prompt: the paper's is not published; its model, GPT-4-Turbo, sees three generations",
  "supervisor: offline rules, unless a command above names a model",
  "ranges: what a supervisor may set, and how far in one generation",
}

return limax.experiment {
  name = "paper",
  not_in_paper = not_in_paper,

  -- Table I, general parameters
  generations = 100,
  population = 30,
  lattice = { 5, 5, 5 }, -- voxels
  repetitions = 3,
  breeding = {
    mutation_rate = 0.1, -- per gene
    mutation_scale = 0.1,
    crossover_rate = 0.4, -- per gene
    elite_fraction = 0.3,
  },

  -- Table II, physics and plane parameters; masses (0.1 kg), stiffnesses, damping ratio, amplitude
  -- and phase are those of materials/paper.json
  materials = "paper",
  scene = {
    gravity = { acceleration = { 0, 0, -9.81 } }, -- m/s^2
    ground = { stiffness = 1e5, damping_ratio = 0.1 }, -- N/m, 1
    friction = { static = 0.6, kinetic = 1.0 },
    damping = true,
    actuation = { frequency = 2, ramp = 0 }, -- Hz, periods; not in the paper
  },
  simulation = {
    edge = 0.1, -- m, the original rest length
    time_step = 1e-5, -- s
    -- not in the paper, from here on
    integrator = "symplectic_euler",
    precision = "compensated",
    sharing = "mean",
    duration = 5, -- s
    settle = 0.5, -- s
  },
  genome = { features = 16, sigma = 1, hidden = { 32, 32 }, initial_scale = 1 },
  seed = 1,
  record = { center_of_mass = 50 }, -- Hz
  fitness = "distance", -- m
  selection = { "tournament", size = 3 },
  supervisor = "rules",
  supervision = { hyperparameters = true, materials = true },
}
