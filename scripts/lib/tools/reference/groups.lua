--- groups.lua: the public names by groups, each name with an example. Everything else about them is
--- read from the comments in the code.
---
--- A group: `title`, `text`, `files` with the comments, `class` whose fields are entries too,
--- `prefix` before a name in scripts, `holder` before it in the files, `stage`, Lua that makes what
--- the examples use, and `examples`: a line "name  example" for each function or value. A name may
--- be followed by the place of its comment: "name=holder.name  example".

local of_engine = require "limax.tools.reference.engine_groups"

local ROBOT = 'robot = limax.robot { voxels = "ecs\\nece\\n\\nsbs\\ncec" }'
local RECORDED = ROBOT .. ':simulate { duration = 0.2, device = "cpu", '
  .. "scene = limax.scenes.land { block = true, target = true }, "
  .. "record = { center_of_mass = 50, contact = 50, "
  .. "energy = 50, strain = 50, ledger = 50, block = 50 } }"
local SMALL = '{ fitness = "walk", lattice = { 2, 2, 2 }, population = 6, repetitions = 1, '
  .. "generations = 2, genome = { sigma = 4 }, simulation = { duration = 0.5 } }"
local RUN = "run = limax.start(limax.experiment " .. SMALL .. ")"
local SCORED = RUN .. "\npopulation = run:generations()():simulate():score()"

local groups = {
  { title = "At the prompt", prefix = "", holder = "words.",
    files = { "scripts/lib/tools/repl/words.lua", "scripts/lib/tools/repl/plot.lua",
      "scripts/lib/tools/repl/evolve.lua", "scripts/lib/tools/repl/picture.lua" },
    stage = ROBOT .. "\nrun = evolve(" .. SMALL .. ", 1)",
    text = "Words of `limax repl`. `_` is the last value; a trailing `;` mutes; `?name` is help.",
    examples = [[
who  who()
plot=plot.plot  plot { 1, 4, 9, 16 }
evolve=evolve.evolve  evolve(run, 1)
champion=evolve.champion  champion(run)
picture=picture.picture  picture(robot, "robot.svg", { duration = 0.2 })
]] },
  { title = "limax", text = 'What `require "limax"` gives.', class = "limax", prefix = "limax.",
    files = { "scripts/lib/limax.lua", "scripts/lib/robot/robot.lua",
      "scripts/lib/experiment/experiment.lua", "scripts/lib/evolution/evolve.lua" },
    examples = [[
robot=robot.new  limax.robot { voxels = "ecs\nece\n\nsbs\ncec" }
experiment=experiment.new  limax.experiment { fitness = "walk", generations = 5 }
start=evolve.start  limax.start(limax.experiment { fitness = "walk", generations = 2 })
]] },
  { title = "A robot by hand", text = "What `limax.robot` gives.", class = "limax.robot",
    files = { "scripts/lib/robot/robot.lua", "scripts/lib/experiment/replay.lua" },
    prefix = "robot:", holder = "Robot:", stage = ROBOT,
    examples = [[
simulate  robot:simulate { duration = 0.2 }
begin  robot:begin { duration = 0.2 }:step(10)
edit  robot:edit(1, 1, 2, "b")
modes  robot:modes(3)[1].frequency
replay  limax.robot(robot:simulate { duration = 0.2 }):replay()
save  robot:save "robot.json"
table  robot:table().voxels
]] },
  { title = "A robot in motion", text = "What `robot:begin` gives.",
    class = "limax.robot_in_motion", files = { "scripts/lib/robot/robot_in_motion.lua" },
    prefix = "walk:", holder = "Moving:",
    stage = ROBOT .. "\nwalk = robot:begin { duration = 0.2 }",
    examples = [[
step  walk:step(10)
go  walk:go(0.05)
finish  walk:finish()
center  walk:center()
positions  walk:positions()
velocities  walk:velocities()
]] },
  { title = "A robot that was simulated", class = "limax.scored_robot",
    text = "What `robot:simulate` gives, and what fitness, selection and supervisors see.",
    files = { "scripts/lib/robot/scored_robot.lua" }, prefix = "robot:", holder = "methods:",
    stage = RECORDED,
    examples = [[
distance  robot:distance { axis = "x" }
displacement  robot:displacement { from = "middle" }
speed  robot:speed()
path_length  robot:path_length()
height  robot:height()
contact  robot:contact()
energy  robot:energy().muscle_work
ledger  robot:ledger().closure
strain  robot:strain()
block  robot:block()
mass  robot:mass()
length  robot:length()
duration  robot:duration()
trace  robot:trace "center_of_mass"
simulate  robot:simulate { accuracy = "publish" }
save  robot:save "robot.json"
table  robot:table().voxels
]] },
  { title = "A body", text = "`robot.body`.", class = "limax.robot.body", prefix = "body.",
    files = { "scripts/lib/robot/body.lua" }, stage = ROBOT .. "\nbody = robot.body" },
  { title = "An array", class = "limax.view", prefix = "view:", holder = "methods:",
    text = "Traces, genomes, positions: `view[i][j]` reads, indices count from 1.",
    files = { "bindings/engine/view.lua" },
    stage = RECORDED .. "\nview = robot:trace 'center_of_mass'",
    examples = [[
size  view:size()
copy  view:copy()
table  view:table()[1]
pointer  view:pointer()
]] },
  { title = "An experiment", text = "What `limax.experiment` gives.", class = "limax.experiment",
    files = { "scripts/lib/experiment/experiment.lua" }, prefix = "experiment:",
    holder = "Experiment:", stage = "experiment = limax.experiment " .. SMALL,
    examples = [[
override  experiment:override { "population=12" }
]] },
  { title = "A run", text = "What `limax.start` gives.", class = "limax.run", prefix = "run:",
    files = { "scripts/lib/evolution/run.lua", "scripts/lib/evolution/evolve.lua" },
    holder = "Run:", stage = RUN,
    examples = [[
generations  for robots in run:generations() do robots:simulate():score() end
finish  run:finish()
]] },
  { title = "A population", class = "limax.population.scored", prefix = "population:",
    text = "What `run:generations()` gives, and `history[n].population`: an array of robots.",
    files = { "scripts/lib/evolution/generation.lua" }, holder = "Population:",
    stage = RUN .. "\npopulation = run:generations()()",
    examples = [[
simulate  population:simulate()
score  population:score "distance"
breed  population:breed { mutation_rate = 0.05 }
]] },
  { title = "limax.encoding", files = { "scripts/lib/experiment/encoding.lua" },
    text = "How genes become bodies: the `encoding` of `genome`, a name or a table of functions.",
    prefix = "limax.encoding.", holder = "encoding.",
    examples = [[
fourier=encoding.entries.fourier  genome = { encoding = "fourier", sigma = 0.3 }
cppn=encoding.entries.cppn  genome = { encoding = "cppn", hidden = { 16 } }
direct=encoding.entries.direct  genome = { encoding = "direct" }
symmetric=encoding.entries.symmetric  genome = { encoding = { "symmetric", of = "cppn" } }
l_system=encoding.entries.l_system  genome = { encoding = { "l_system", levels = 4 } }
get  limax.encoding.get("direct", { lattice = { 5, 5, 5 }, materials = 5 }).name
fields  limax.encoding.fields "cppn"
of_engine  limax.encoding.of_engine({ network = "cppn" }, {}, { lattice = { 2, 2, 2 } }).genes
entries  limax.encoding.entries.cppn.fields
]] },
  { title = "limax.variation", files = { "scripts/lib/experiment/variation.lua" },
    text = "How offspring differ from parents: `mutation` and `crossover` of `genome`.",
    prefix = "limax.variation.", holder = "variation.",
    examples = [[
gaussian=variation.mutations.gaussian  genome = { mutation = "gaussian" }
block=variation.mutations.block  genome = { mutation = "block" }
self_adaptive=variation.mutations.self_adaptive  genome = { mutation = "self_adaptive" }
uniform=variation.crossovers.uniform  genome = { crossover = "uniform" }
two_point=variation.crossovers.two_point  genome = { crossover = "two_point" }
mutations  genome = { mutation = "none" }
crossovers  genome = { crossover = "none" }
get  limax.variation.get({ mutation = "block" }, {}).mutation.call
]] },
  { title = "Robots of an encoding", class = "limax.batch", prefix = "robots:", holder = "methods:",
    text = "What the functions of an encoding, a mutation and a crossover get.",
    files = { "scripts/lib/experiment/batch.lua" },
    stage = of_engine.genomes .. '\nlocal batch = require "limax.experiment.batch"\n'
      .. "function parents() local p = limax.engine.population { count = 4, encoding = coder } "
      .. "p:initialize() return p end\npopulation, robots = robots, batch.new({ 2, 3 }, { "
      .. "generation = 1, lattice = { 2, 2, 2 }, materials = materials, parameters = rates, "
      .. "parts = { population = robots, parents = parents(), empty = parents, seed = 1, "
      .. "repetition = 1, counter = 0, pairs = { { 1, 1 }, { 1, 2 }, { 2, 3 }, { 3, 4 } } } })",
    examples = [[
genes  robots:genes(2)[1]
control  #robots:control(2)
voxels  robots:voxels(2)[1]
weights  robots:weights(2)[1][1]
parents  robots:parents(2)
random  robots:random(2):uniform()
initialize  robots:initialize()
cross  robots:cross()
mutate  robots:mutate({ 2 }, { mutation_scale = 0.5 })
express  robots:express()
]] },
  { title = "limax.fitness", files = { "scripts/lib/experiment/fitness.lua" }, holder = "fitness.",
    text = 'Fitness functions: `fitness = "walk"`, or `{ "distance", axis = "x" }`.',
    prefix = "limax.fitness.", stage = RECORDED,
    examples = [[
walk  limax.fitness.walk(robot)
distance  limax.fitness.distance(robot, { axis = "x" })
speed  limax.fitness.speed(robot)
height  limax.fitness.height(robot)
efficiency  limax.fitness.efficiency(robot)
straightness  limax.fitness.straightness(robot)
carry  limax.fitness.carry(robot)
target  limax.fitness.target(robot)
get  limax.fitness.get("walk").call(robot)
entries  limax.fitness.entries.walk.formula
]] },
  { title = "limax.selection", files = { "scripts/lib/experiment/selection.lua" },
    text = 'Selection schemes: `selection = "rank"`, or `{ "tournament", size = 3 }`.',
    prefix = "limax.selection.", holder = "selection.", named = "selection",
    examples = [[
truncation=selection.entries.truncation  { "truncation", share = 0.5 }
tournament=selection.entries.tournament  { "tournament", size = 3 }
rank=selection.entries.rank  { "rank", pressure = 1.8 }
roulette=selection.entries.roulette  { "roulette" }
lexicase=selection.entries.lexicase  { "lexicase", epsilon = "mad" }
get  limax.selection.get "rank"
entries  limax.selection.entries.rank
]] },
  { title = "limax.survival", files = { "scripts/lib/experiment/survival.lua" },
    text = 'Survival schemes: `survival = "generational"`, or `{ "plus", share = 0.25 }`.',
    prefix = "limax.survival.", holder = "survival.", named = "survival",
    stage = 'grid = { "grid", descriptors = { "muscle_share" } }',
    examples = [[
elitist=survival.entries.elitist  "elitist"
generational=survival.entries.generational  "generational"
plus=survival.entries.plus  { "plus", share = 0.25 }
map_elites=survival.entries.map_elites  "map_elites", archive = grid
novelty=survival.entries.novelty  "novelty", archive = { "novelty", descriptors = { "mass" } }
nsga2=survival.entries.nsga2  { "nsga2", objectives = { "distance", "-energy" } }
age_fitness=survival.entries.age_fitness  { "age_fitness", newcomers = 2 }
get  limax.survival.get "plus"
entries  limax.survival.entries.plus
]] },
  { title = "limax.archive", files = { "scripts/lib/experiment/archive.lua" },
    text = 'Archives: `archive = { "grid", descriptors = { "muscle_share", "voxel_share" } }`.',
    prefix = "limax.archive.", holder = "archive.", named = "archive",
    examples = [[
grid=archive.entries.grid  { "grid", cells = 5, descriptors = { "muscle_share", "contact" } }
cvt=archive.entries.cvt  { "cvt", cells = 200, descriptors = { "muscle_share", "contact" } }
novelty=archive.entries.novelty  { "novelty", k = 10, descriptors = { "height", "contact" } }
pareto=archive.entries.pareto  { "pareto", objectives = { "distance", "-energy" } }
centres  limax.archive.centres(20, 2)[1]
get  limax.archive.get({ "grid", descriptors = { "muscle_share" } }).name
entries  limax.archive.entries.grid
measures  limax.archive.measures.contact.unit
]] },
  { title = "limax.supervise", folder = "scripts/lib/supervise/", named = "supervisor",
    files = { "scripts/lib/supervise/supervise.lua" },
    text = 'Supervisors: `supervisor = "rules"`, or `{ "rules", patience = 5 }`.',
    prefix = "limax.supervise.", holder = "supervise.",
    examples = [[
fixed  "fixed"
schedule  { "schedule", mutation_scale = { { 0, 0.2 }, { 39, 0.02 } } }
random  { "random", step = 0.5 }
one_fifth  { "one_fifth", window = 3 }
self_adaptive  { "self_adaptive", span = 2 }
bandit  { "bandit", spread = 2 }
rules  { "rules", patience = 5 }
llm  { "llm", model = "gpt-oss:20b", url = "http://localhost:11434/v1" }
replay  { "replay", run = "runs/walk-1" }
yoked  { "yoked", run = "runs/walk-1" }
shuffled  { "shuffled", run = "runs/walk-1" }
constant_median  { "constant_median", run = "runs/walk-1" }
get  limax.supervise.get("rules").name
entries  limax.supervise.entries.rules
parameters  limax.supervise.parameters
]] },
  { title = "limax.scenes", files = { "scripts/lib/settings/scenes.lua" }, holder = "scenes.",
    text = "Ready scenes; an effect in the argument replaces the scene's own, false removes it.",
    prefix = "limax.scenes.",
    examples = [[
land  limax.scenes.land { friction = false }
air  limax.scenes.air { gravity = false }
water  limax.scenes.water { buoyancy = 0.9 }
slope  limax.scenes.slope { angle = math.rad(10) }
stairs  limax.scenes.stairs { step = 0.05, depth = 0.3, count = 5 }
corner  limax.scenes.corner { distance = 1 }
kick  limax.scenes.kick({ time = 1, velocity = { 0, 0.5, 0 } }).acceleration
rough  limax.scenes.rough({ roughness = 0.05, seed = 1 }).terrain.spacing
]] },
  { title = "limax.control", files = { "scripts/lib/settings/control.lua" }, holder = "control.",
    text = "Controllers: each returns what a scene's `control` takes ([CONTROL.md](CONTROL.md)).",
    prefix = "limax.control.",
    examples = [[
sine  limax.control.sine { frequency = 2 }
reflex  limax.control.reflex { gain = 0.5, sensor = "strain.x", frequency = 2, rate = 50 }
network  limax.control.network { sensors = { "strain", "contact", "clock" }, states = 2 }
central  limax.control.central { sensors = { "gravity", "clock" }, groups = 4 }
oscillators  limax.control.oscillators { frequency = 2, feedback = "contact" }
]] },
  { title = "limax.diversity", files = { "scripts/lib/run/diversity.lua" }, holder = "diversity.",
    text = "Measures of a scored population.", prefix = "limax.diversity.", stage = SCORED,
    examples = [[
hamming  limax.diversity.hamming(population)
genotype  limax.diversity.genotype(population, "top")
control  limax.diversity.control(population)
distinct  limax.diversity.distinct(population)
material_shares  limax.diversity.material_shares(population)
top_half  limax.diversity.top_half(population.ranked)
measure  limax.diversity.measure(population.engine, population.ranked, population.materials).all
]] },
  { title = "limax.rescore", files = { "scripts/lib/evolution/rescore.lua" }, holder = "rescore.",
    text = "Robots of a population, simulated and scored again under another setting.",
    prefix = "limax.rescore.", stage = SCORED,
    examples = [[
population  limax.rescore.population(population, { accuracy = "preview" }, { 1, 2 })
options  limax.rescore.options(run.config, { accuracy = "preview" }).precision
]] },
  { title = "Random numbers", class = "limax.random", prefix = "random:", holder = "methods:",
    text = "The `random` of selection and supervisors, from the seed of the run.",
    files = { "bindings/engine/random.lua" }, stage = 'random = limax.engine.random(1, 1, "user")',
    examples = [[
integer  random:integer(6)
uniform  random:uniform()
normal  random:normal()
]] },
  { title = "limax.test", files = { "scripts/lib/tools/test/test.lua" }, holder = "test.",
    text = "Suites of scripted regressions, run by `limax test FILE`.", prefix = "limax.test.",
    examples = [[
suite  limax.test.suite "my walker"
DEVICES  limax.test.DEVICES
]] },
  { title = "A suite", text = "What `limax.test.suite` gives.", class = "limax.suite",
    files = { "scripts/lib/tools/test/test.lua" }, prefix = "suite:", holder = "methods:",
    stage = 'suite = limax.test.suite "of the reference"',
    examples = [[
test  suite:test("adds", { limit = 5 }, function(t) t:equal(1 + 1, 2) end)
fixture  suite:fixture("cube", function() return limax.robot { voxels = "s" } end)
]] },
  { title = "A test's t", text = "The argument of the function of a test.", prefix = "t:",
    class = "limax.test_context", files = { "scripts/lib/tools/test/context.lua" },
    holder = "methods:",
    stage = 'local context = require "limax.tools.test.context"; t = context.new { '
      .. 'name = "a test", suite = "a suite", file = "suite.lua", '
      .. 'fixtures = { cube = { make = function() return 1 end } }, '
      .. "state = context.file_state() }",
    examples = [[
near  t:near(0.1 + 0.2, 0.3, { rtol = 1e-12 })
equal  t:equal({ 1, 2 }, { 1, 2 })
same_bits  t:same_bits(0.5, 0.5)
ok  t:ok(1 < 2, "one should be less than two")
raises  t:raises("boo", function() error "boo" end)
golden  pcall(t.golden, t, "height", { z = 1 }, { rtol = 1e-3, why = "before contact" })
fixture  t:fixture "cube"
with  t:with { duration = 2 }
skip  pcall(t.skip, t, "no GPU")
note  t:note "took three tries"
folder  t:folder(); t:close()
]] },
}

for _, group in ipairs(of_engine) do groups[#groups + 1] = group end

return groups
