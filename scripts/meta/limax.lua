---@meta limax
--- limax.lua: what `require "limax"` gives, for editors. Made by scripts/dev/reference.lua from the
--- API table (scripts/lib/tools/reference/) and the comments in the code; do not edit. It is never run.

error "this file is for editors"

---@class limax.block_state
---@field position number[] of its centre in the world, m
---@field orientation number[] quaternion w, x, y, z that turns its own axes into the world's
---@field velocity number[] m/s
---@field angular_velocity number[] rad/s, in the world

---@class limax.body
---@field status "unknown"|"valid"|"no voxel"|"no muscle"
---@field voxels integer that are not empty
---@field counts integer[] voxels of each material, the empty one first
---@field masses integer
---@field springs integer
---@field size integer[] extent in voxels along x, y, z
---@field hash string 16 hexadecimal digits; equal bodies have equal hashes

---@class limax.breeding
---@field mutation_rate number per gene, 0 to 1
---@field mutation_scale number standard deviation of a mutation
---@field crossover_rate number chance of a gene to come from the second parent, 0 to 1
---@field seed number|string
---@field repetition integer
---@field generation integer of the children
---@field elites integer|nil the first so many children are copies of their first parent; 0

---@class limax.case
---@field name string
---@field axes table<string, any[]> see test/axes.lua
---@field limit number|nil
---@field skip string|nil
---@field tags string[]
---@field run fun(t: limax.test_context)

---@class limax.device : limax.object
---@field name string as it was asked for
---@field kind string "cpu" or "cuda"
---@field threads integer

---@class limax.diversity
---@field hamming number mean share of voxels in which two of the robots differ
---@field genotype number|nil root mean square over genes of the deviation; nil without genomes
---@field distinct integer different bodies
---@field robots integer
---@field material_shares number[] of each material over all voxels, the empty one first

--- `hamming` is the mean share of voxels in which two distinct robots differ, N / (N - 1) times the
--- mean over voxels of 1 - sum_m p_m^2; `genotype` the root mean square over genes of the standard
--- deviation over the robots; `material_shares` include the empty one.
---@class limax.diversity.values
---@field hamming number 0 to 1
---@field genotype number|nil nil without genomes
---@field distinct integer number of different bodies
---@field robots integer size of the set
---@field material_shares table<string, number> mean share of all voxels, by name

---@class limax.effect
---@field name string
---@field summary string
---@field needs string[] effects, one of which must be there too; none if empty
---@field instances integer how often a scene may have it
---@field fields limax.field[]

---@class limax.encoding : limax.object
---@field genes integer numbers in a genome
---@field lattice integer[]
---@field features_count integer m, rows of the matrix

---@class limax.encoding_options
---@field lattice integer[] voxels along x, y, z
---@field features integer|nil m, rows of the matrix; 16
---@field sigma number|nil standard deviation of its entries; 1
---@field hidden integer[]|nil width of each hidden layer; { 32, 32 }
---@field materials integer|nil classes of the softmax; 5
---@field initial_scale number|nil factor on the initial weights; 1
---@field seed number|string|nil 1
---@field repetition integer|nil 1

---@class limax.experiment
---@field config table the resolved configuration, plain values only (schema limax.config/1)
---@field fitness { name: string, call: function, record: table }
---@field selection fun(population: table, random: table): integer, integer
---@field supervisor { name: string, call: function }
---@field notes string[] what the resolution changed and a user should know
---@field scripts string[] absolute paths of the script files that it is made of
---@field origin string|nil absolute path of the file that made it
local limax_experiment = {}

--- The same experiment with fields changed by `path=value` texts, checked again as a whole.
---@param changes string[]
---@return limax.experiment
function limax_experiment:override(changes) end

---@class limax.field
---@field name string
---@field unit string
---@field note string
---@field components integer 1, 3 for a vector, 0 for a table of heights
---@field minimum number of each component
---@field maximum number
---@field value number[] the default

---@class limax.fitness
---@field name string a library name, or "function"
---@field call fun(robot: limax.scored_robot): number, number[]?
---@field record table<string, number> traces that it reads, samples per second
---@field options table resolved options of a library fitness

--- A generation that has been scored, as supervisors and prompts see it; the fields of its line in
--- metrics.jsonl, and more.
---@class limax.generation
---@field repetition integer 1, 2, ...
---@field generation integer 0, 1, ...
---@field population limax.population.scored its robots; genomes for the last three generations
---@field parameters table<string, number> that it was bred with
---@field materials table that it was made of, as a material file holds them
---@field ledger { supervisor: string, source?: string, reason?: string, entries: table[] } how it
--- got its parameters: its line in ledger.jsonl
---@field best number the champion's fitness
---@field best_standard? number the same under the first materials; absent if it ends badly there
---@field mean number of the scored robots' fitness; likewise the next three
---@field median number
---@field worst number
---@field quantiles table<string, number> q10, q25, q50, q75, q90
---@field measures? table<string, table> of each number that the fitness names: champion, mean,
--- least, most
---@field diversity { all: table, top: table } hamming, genotype, distinct, robots, material_shares
---@field failed { invalid: integer, diverged: integer, fitness: integer } robots without a score
---@field coarse integer robots of which a mass moved farther than a tenth of an edge in one step
---@field scored integer robots with a score
---@field evaluations integer robots that were simulated
---@field champion { id: integer, index: integer, hash: string } the best robot

---@class limax.life
---@field stamp integer raised whenever what the views show is replaced
---@field why string|nil what raised it last, with its line

--- What binds one field of a proposal.
---@class limax.limit
---@field field string mutation_rate, ..., stiffness
---@field minimum number
---@field maximum number
---@field factor? number largest ratio between two generations
---@field step? number largest difference between two generations
---@field unit string
---@field material? boolean a field of materials; for stiffness the range is in first values
---@field allowed boolean may a supervisor set it in this experiment?

---@class limax.material
---@field name string
---@field letter string
---@field kind "empty"|"passive"|"expanding"|"contracting"
---@field stiffness number N/m
---@field mass_per_site number kg
---@field damping_ratio number 1
---@field amplitude number largest relative change of rest length, 1
---@field phase number largest phase, rad
---@field stiffness_floor number smallest stiffness weight, 1

---@class limax.materials : limax.object
---@field count integer
---@field name string
local limax_materials = {}

--- One material.
---@param i integer
---@return limax.material
function limax_materials:get(i) end

--- Index of the material with this letter or name, or nil.
---@param letter_or_name string
---@return integer|nil
function limax_materials:index(letter_or_name) end

--- Sets one number of one material, within the field's legal range.
---@param i integer
---@param field string
---@param value number
function limax_materials:set(i, field, value) end

--- What is known of a field: unit, legal range (inclusive) and where its numbers come from.
---@param name string
---@return { unit: string, minimum: number, maximum: number, source: string }
function limax_materials:field(name) end

--- A second table with the same values, which may be changed on its own.
---@return limax.materials
function limax_materials:copy() end

--- The table as plain Lua values, as a material file holds them; `engine.materials` accepts it
--- again.
---@return table
function limax_materials:table() end

---@class limax.object
---@field handle ffi.cdata*|nil nil once freed
---@field life limax.life

---@class limax.outcome
---@field status "skipped"|"running"|"done"|"invalid"|"diverged"
---@field reason string|nil "no voxel", "no muscle"; "nonfinite", "speed", "stretch"
---@field step integer steps done since the start of settling
---@field steps integer steps in all
---@field time number s since t = 0, negative while settling
---@field time_step number s
---@field time_step_bound number s
---@field masses integer
---@field springs integer
---@field coarse boolean a mass was seen to move farther than a tenth of an edge in one step
---@field mass number kg
---@field center_start number[] centre of mass at t = 0, m
---@field center_middle number[] after half of the steps from t = 0
---@field center_end number[] at the end
---@field path_length number|nil m; this and the following: nil where their trace is not recorded
---@field height number|nil m
---@field contact number|nil 1
---@field kinetic number|nil J
---@field elastic number|nil J
---@field muscle_work number|nil J
---@field strain number|nil 1
---@field strain_most number|nil 1
---@field block_start number[]|nil centre of the rigid block at t = 0, m; these are nil without one
---@field block_middle number[]|nil after half of the steps from t = 0
---@field block_end number[]|nil at the end
---@field block_velocity number[]|nil at the end, m/s
---@field block_upright number|nil cosine of the angle between its own z axis and the world's, there

---@class limax.population : limax.object
---@field count integer robots
---@field genes integer numbers in a genome, 0 without an encoding
---@field lattice integer[] voxels along x, y, z
local limax_population = {}

--- Draws the initial genomes: weights N(0, 1 / fan_in) times the encoding's initial_scale, biases
--- 0.
---@param first integer|nil
---@param count integer|nil
function limax_population:initialize(first, count) end

--- Makes bodies of genomes.
---@param table_of_materials limax.materials
---@param options { require_muscle: boolean|nil, device: limax.device|nil }|nil
---@param first integer|nil
---@param count integer|nil
function limax_population:express(table_of_materials, options, first, count) end

--- Finds out what bodies written by hand are; nothing is removed from them.
---@param table_of_materials limax.materials
---@param options { require_muscle: boolean|nil }|nil
---@param first integer|nil
---@param count integer|nil
function limax_population:check(table_of_materials, options, first, count) end

--- Writes this population's genomes: elites are copies of their first parent, the others cross and
--- mutate.
---@param parents limax.population
---@param pairs_of_parents integer[][] { i, j } for each child
---@param options limax.breeding
---@param on limax.device|nil
function limax_population:breed(parents, pairs_of_parents, options, on) end

--- Genome of robot i.
---@param i integer
---@return limax.view [gene]
function limax_population:genome(i) end

--- A copy of all genomes, [robot][gene], in memory of its own.
---@param into? ffi.cdata* such a copy of as many genomes as long, to be written over
---@return ffi.cdata* float[robots * genes]
function limax_population:genomes_array(into) end

--- All genomes as little-endian 32-bit floats, [robot][gene].
---@return string
function limax_population:genomes_bytes() end

--- Writes all genomes, from what genomes_bytes gave.
---@param bytes string
function limax_population:set_genomes(bytes) end

--- Material indices of robot i, from 0 (the empty one).
---@param i integer
---@return limax.view [x][y][z]
function limax_population:voxels(i) end

--- The voxels of robot i as text: a letter for each, lines along x, an empty line between layers,
--- the lowest first.
---@param i integer
---@param letters string of all materials, the empty one first
---@return string
function limax_population:text(i, letters) end

--- Weights of robot i: stiffness, amplitude and phase of each voxel, 0 to 1.
---@param i integer
---@return limax.view [3][x][y][z]
function limax_population:weights(i) end

--- What robot i is, as far as expressing or checking has found out.
---@param i integer
---@return limax.body
function limax_population:body(i) end

--- Writes the body of robot i by hand; `population:check` then says whether it is one.
---@param i integer
---@param voxels table|limax.view indices from 0, letters, names: [x][y][z], or one list, x first
---@param weights table|limax.view|nil { stiffness=, amplitude=, phase= }: numbers or as `voxels`
---@param table_of_materials limax.materials|nil what letters and names refer to
function limax_population:set_body(i, voxels, weights, table_of_materials) end

--- How different the bodies and genomes of some robots are. Linear in their number.
---@param robots integer[]
---@return limax.diversity
function limax_population:diversity(robots) end

--- Ends the population now; views of it end.
---@param why string|nil completes "this view ended when ..."
function limax_population:free(why) end

---@class limax.population.scored an array of robots (limax.scored_robot)
---@field ranked integer[]|nil indices of the scored robots, best first; nil before the first score
---@field generation integer 0, 1, ...
---@field repetition integer 1, 2, ...
---@field parameters table<string, number> that it was bred with
---@field engine limax.population genomes and bodies
---@field materials limax.materials that it is made of
---@field records table[] one plain table per robot, the lines of its population file
---@field evaluations integer robots simulated for their score
---@field timing table<string, number> s of each step
local limax_population_scored = {}

--- Simulates the robots that have no status yet: all but the elites that keep their score.
---@param on_progress? fun(progress: table)
---@return limax.population.scored self
function limax_population_scored:simulate(on_progress) end

--- Scores every robot that ended well: by the experiment's fitness, or by another one. A robot
--- whose score stands already, an elite or one read from a run folder, keeps it.
---@param with? string|table|fun(robot: table): number, number[]?
---@return limax.population.scored self
function limax_population_scored:score(with) end

--- Ends this generation (metrics, history, files) and breeds the next one, if the experiment has
--- one. `parents` holds a pair of indices per offspring and `elites` the robots that are copied;
--- what is left out comes from the experiment. The numbers of elites and pairs add up to the
--- population.
---@param choice? { parents?: integer[][], elites?: integer[], mutation_rate?: number, mutation_scale?: number, crossover_rate?: number }
---@return limax.population.scored self
function limax_population_scored:breed(choice) end

---@class limax.progress
---@field done integer robots that have ended, whatever their status
---@field robots integer robots that are simulated
---@field finished boolean
---@field interrupted boolean the call was cut short by an interrupt; the state is whole
---@field steps number robot steps done
---@field steps_total number
---@field spring_steps number springs times steps done

---@class limax.proposal what a supervisor may ask for; the ledger records what became of it
---@field mutation_rate? number per gene
---@field mutation_scale? number
---@field crossover_rate? number per gene
---@field elite_fraction? number of the population
---@field materials? table<string, { stiffness?: number, amplitude?: number, phase?: number }>

---@class limax.random
---@field draw integer numbers drawn so far
local limax_random = {}

--- One of 1, 2, ... n.
---@param n integer
---@return integer
function limax_random:integer(n) end

--- Uniform in [0, 1).
---@return number
function limax_random:uniform() end

--- Standard normal, N(0, 1).
---@return number
function limax_random:normal() end

---@class limax.rescored
---@field fitness table<integer, number> by index of the robot; nil where it failed
---@field distance table<integer, number> m, horizontal, from t = 0 to the end
---@field status table<integer, string> "done", "diverged", "invalid" or "failed"
---@field time_step table<integer, number> s
---@field failed integer robots without a fitness
---@field robots integer that were simulated
---@field seconds number wall time of simulating them
---@field simulated number s of simulated time, all robots together

---@class limax.robot
---@field description limax.robot.description
---@field body limax.robot.body
---@field materials limax.materials
---@field population limax.population of the engine, with this robot only
local limax_robot = {}

--- Simulates this robot: it settles, then its muscles run for `duration`.
---@param options? limax.robot.simulate_options
---@return limax.scored_robot
function limax_robot:simulate(options) end

--- The same, to be taken step by step.
---@param options? limax.robot.simulate_options
---@return limax.robot_in_motion
function limax_robot:begin(options) end

--- This robot with one voxel of another material; weights stay. The robot itself does not change.
---@param x integer from 1
---@param y integer from 1
---@param z integer from 1, the lowest layer
---@param letter string of a material, `.` takes the voxel away
---@return limax.robot
function limax_robot:edit(x, y, z, letter) end

--- Simulates a robot read from a file exactly as it was scored: same scene, settings and materials,
--- and, on the same build and kind of device, the same score to the bit. A file does not hold a
--- fitness that is a function of a script: pass that function.
---@param options? { fitness?: any, device?: string|limax.device }
---@return limax.scored_robot robot its `fitness` is set
---@return number|nil score the one in the file
function limax_robot:replay(options) end

--- Writes this robot to a file without loss.
---@param path string
function limax_robot:save(path) end

--- The plain table that a robot file holds.
---@return limax.robot.description
function limax_robot:table() end

---@class limax.robot.block
---@field displacement number[] from t = 0, or the middle, to the end, { dx, dy, dz }, m
---@field distance number horizontal length of that, m
---@field position number[] of its centre at the end, in the world, m
---@field velocity number[] at the end, m/s
---@field tilt number angle between its own z axis and the world's at the end, rad

---@class limax.robot.body
---@field size integer[] extent in voxels along x, y, z
---@field mass number kg
---@field count table<string, integer> voxels by name of material
---@field voxels integer that are not empty
---@field masses integer
---@field springs integer
---@field hash string
---@field letters string
---@field voxel string[][][] letters, [x][y][z]
local limax_robot_body = {}

--- Where a record comes from. Without `simulation` there are no traces, without `population` there
--- is no genome.
---@class limax.robot.context
---@field population? limax.population of the engine
---@field index? integer in it
---@field simulation? limax.simulation of the engine
---@field materials limax.materials
---@field scene table
---@field options table settings of the simulation, with `record` and `edge`
---@field fitness? any as robot files keep it

---@class limax.robot.description the plain table that a file holds
---@field schema string
---@field lattice integer[] voxels along x, y, z
---@field edge number m
---@field voxels string[][] letters, [z][y], lowest layer first, letters along x
---@field weights table<string, number|number[][][]> one number for all voxels, or [z][y][x]; 0 to 1
---@field materials table as a material file holds it
---@field scene? table
---@field simulation? table settings, with the rates of the recorded traces as `record`
---@field fitness? any name, { name = ... } or the record of a function
---@field score? number what that fitness gave
---@field outcome? table what the simulation measured
---@field id? integer
---@field generation? integer
---@field parents? integer[]
---@field origin? string

---@class limax.robot.given
--- `voxels` holds the materials' letters: layers parted by an empty line, the lowest first; the
--- first line of a layer is y = 1, and letters run along x. Each weight is a number from 0 to 1,
--- [x][y][z] or a function (x, y, z); 1 if absent.
---@field voxels string
---@field weights? number|{ stiffness?: any, amplitude?: any, phase?: any }
---@field materials? string|table|limax.materials "paper" if absent
---@field lattice? integer[] larger than the letters say: the rest is empty
---@field edge? number m

---@class limax.robot.ledger
---@field kinetic number energy at the end, J; this and the following
---@field elastic number of the springs
---@field contact number in what touches
---@field gravitational number from the world's origin
---@field muscles number work from t = 0 to the end, J, positive into the body; this and the next
---@field damping number of the dashpots along springs
---@field contact_damping number
---@field friction number
---@field other number of every effect that has no entry of its own
---@field change number of the energy since t = 0, J
---@field closure number 1: how far off the books are at the worst sample: the energy since t = 0
--- less all works, over what went through (the sizes of the works at the end, the largest energy)

---@class limax.robot.of_genome
---@field genome "random"|number[]|limax.view a random one, or its numbers
---@field lattice? integer[] voxels along x, y, z; { 5, 5, 5 }
---@field materials? string|table|limax.materials "paper" if absent
---@field edge? number m
---@field features? integer of the encoding, as in an experiment's `genome`; 16
---@field sigma? number 1
---@field hidden? integer[] { 32, 32 }
---@field initial_scale? number of random genomes; 1
---@field seed? number|string of the encoding, and of a random genome; 1
---@field repetition? integer 1
---@field individual? integer which robot of the initial population a random genome is; 1

---@class limax.robot.simulate_options
---@field scene? table as in an experiment; the robot's own, else flat ground
---@field device? "auto"|"cpu"|"cuda"|limax.device "auto" if absent
---@field record? table<string, integer> traces, samples per second
---@field materials? string|table other materials under the same letters
---@field progress? fun(progress: table) called about 20 times a second
---@field duration? number s
---@field settle? number s
---@field accuracy? "preview"|"evolve"|"publish"|"reference"
---@field integrator? "leapfrog"|"rk4"|"symplectic_euler"|"xpbd"
---@field precision? "compensated"|"double"|"mixed"|"single"
---@field time_step? number|"auto" s
---@field position? number[] m
---@field velocity? number[] m/s

---@class limax.robot_in_motion
---@field simulation limax.simulation
---@field time number s since t = 0, negative while the body settles
---@field steps integer done
---@field status "running"|"done"|"invalid"|"diverged"
local limax_robot_in_motion = {}

--- Takes whole steps, or fewer where the simulation ends.
---@param steps? integer 1 if absent
---@return limax.robot_in_motion self
function limax_robot_in_motion:step(steps) end

--- Goes on for a time of the simulation, rounded up to whole steps.
---@param seconds number s
---@return limax.robot_in_motion self
function limax_robot_in_motion:go(seconds) end

--- Goes on to the end.
---@param progress? fun(progress: table)
---@return limax.scored_robot
function limax_robot_in_motion:finish(progress) end

--- The mean of the masses' places now: the centre of mass where all weigh the same, as in the
--- paper's materials.
---@return number[] { x, y, z } m
function limax_robot_in_motion:center() end

--- Positions of the masses now, world coordinates, as a copy.
---@return limax.view positions [mass][3] m
function limax_robot_in_motion:positions() end

--- Velocities of the masses now, as a copy.
---@return limax.view velocities [mass][3] m/s
function limax_robot_in_motion:velocities() end

---@class limax.run one repetition of an experiment
---@field experiment limax.experiment
---@field config table the experiment's resolved configuration
---@field repetition integer 1, 2, ...
---@field history limax.generation[] one entry per scored generation
---@field population limax.population.scored|nil the newest generation
local limax_run = {}

--- Iterates over the generations: `for population in run:generations() do ... end`. What the body
--- of the loop leaves out (simulate, score, breed) is done by the experiment's own rules.
---@return fun(): limax.population.scored|nil
function limax_run:generations() end

--- Runs all generations that are left. Returns the history.
---@return limax.generation[]
function limax_run:finish() end

---@class limax.run.options
---@field repetition? integer 1 if left out
---@field device? string|table "auto", "cpu", "cuda", or a device of the engine
---@field threads? integer
---@field out? string a new folder that keeps the generations
---@field resume? boolean continue what `out` holds, if it is there: the loop's first population
--- is then the last whole one, with its scores
---@field changed? boolean with `resume`: continue although script or configuration differ
---@field folder? table the same, made already (run_folder.lua)
---@field say? fun(text: string) receives warnings; standard error if left out
---@field on_progress? fun(progress: table) while robots are simulated
---@field wait? fun(simulation: limax.simulation) advances a simulation to its end (together.lua)
---@field on_generation? fun(entry: limax.generation, seconds: table) after each generation
---@field live_prompts? boolean read a model's prompts again before each generation

---@class limax.scene : limax.object

---@class limax.scored_robot
---@field id integer
---@field parents integer[] ids, none or two
---@field generation integer that it first appeared in
---@field origin string "initial", "elite", "bred" or "hand"
---@field status "done"|"invalid"|"diverged"|"failed"
---@field reason string|nil why not "done"
---@field fitness number|nil
---@field cases number[]|nil
---@field measures table<string, number>|nil
---@field coarse boolean a mass was seen to move farther than a tenth of an edge in one step
---@field undersampled boolean a period of the muscles has fewer than 20 steps
---@field genome any view of the genes, nil for a robot made by hand
---@field body limax.robot.body
---@field record table
---@field context limax.robot.context
local limax_scored_robot = {}

--- Horizontal length between the centres of mass at t = 0 and at the end, m; with `axis`, its
--- signed part along x, y or z; with `from = "middle"`, from half of the time on.
---@param options? { axis?: "x"|"y"|"z", from?: "start"|"middle" }
---@return number m
function limax_scored_robot:distance(options) end

--- The vector between the centres of mass at t = 0 (or from the middle) and at the end, m.
---@param options? { from?: "start"|"middle" }
---@return number[] { dx, dy, dz }
function limax_scored_robot:displacement(options) end

--- Distance over duration, m/s; `axis` as in distance.
---@param options? { axis?: "x"|"y"|"z" }
---@return number m/s
function limax_scored_robot:speed(options) end

--- Horizontal length of the path of the centre of mass, m. Reads the trace "center_of_mass".
---@return number m
function limax_scored_robot:path_length() end

--- Highest rise of the centre of mass above its place at t = 0, m. Reads the trace
--- "center_of_mass".
---@return number m
function limax_scored_robot:height() end

--- Mean share of the masses that touch the ground or another contact, 0 to 1. Reads the
--- trace "contact".
---@return number
function limax_scored_robot:contact() end

--- Means of kinetic and elastic energy, and the muscles' positive work in all, J. Reads the trace
--- "energy".
---@return { kinetic: number, elastic: number, muscle_work: number } J
function limax_scored_robot:energy() end

--- The books of the robot's energy: what it holds at the end, what put energy in or took it out
--- since t = 0, and how well the two agree. Reads the trace "ledger" (CPU only).
---@return limax.robot.ledger
function limax_scored_robot:ledger() end

--- Mean strain |r - L0| / L0 over springs and time, and the largest of any spring at any sample.
--- Reads the trace "strain".
---@return number mean
---@return number largest
function limax_scored_robot:strain() end

--- What became of the rigid block of the scene. `from = "middle"` counts its way from half of the
--- time on.
---@param options? { from?: "start"|"middle" }
---@return limax.robot.block
function limax_scored_robot:block(options) end

--- Mass of the body, kg.
---@return number kg
function limax_scored_robot:mass() end

--- Longer horizontal side of the body at rest: one body length, m.
---@return number m
function limax_scored_robot:length() end

--- Seconds from t = 0 to the end.
---@return number s
function limax_scored_robot:duration() end

--- A recorded trace from t = 0: "center_of_mass" [sample][3] m, "position" [sample][mass][3] m,
--- "velocity" [sample][mass][3] m/s, "contact" [sample][1], "energy" [sample][4], "strain"
--- [sample][2], "ledger" [sample][9], "block" [sample][7] (centre, m, and quaternion w, x, y, z);
--- with `.rate` (Hz) and `.unit`.
---@param kind string
---@return any view
function limax_scored_robot:trace(kind) end

--- Simulates the same body again: scene and settings as they were, except for what `options` names
--- (limax.robot has the list).
---@param options? table
---@return limax.scored_robot
function limax_scored_robot:simulate(options) end

--- Writes this robot as a file that `limax.robot(file)` reads, and that replays to the same score.
---@param path string
function limax_scored_robot:save(path) end

--- Everything that it takes to simulate this robot again: the plain table that a robot file holds.
---@return limax.robot.description
function limax_scored_robot:table() end

---@alias limax.selection.scheme fun(population: table, random: table): integer, integer

---@class limax.simulation : limax.object
---@field count integer robots of the population, simulated or not
---@field record table<string, integer> samples per second of each recorded trace
---@field masses integer[] of each robot
local limax_simulation = {}

--- Puts the masses of robot i where and as fast as given (m, m/s), before its first step.
---@param i integer
---@param positions number[][]|number[]|limax.view|nil [mass][3], or one list
---@param velocities number[][]|number[]|limax.view|nil [mass][3], or one list
function limax_simulation:place(i, positions, velocities) end

--- Does whole steps for about `seconds` of wall time, or at most `steps` steps of each robot.
---@param seconds number
---@param steps integer|nil
---@return limax.progress
function limax_simulation:advance(seconds, steps) end

--- Advances to the end. An interrupt raises host.interrupt and leaves a state that can be advanced
--- further.
---@param on_progress fun(progress: limax.progress)|nil called after each slice
---@return limax.progress
function limax_simulation:run(on_progress) end

--- What became of robot i so far.
---@param i integer
---@return limax.outcome
function limax_simulation:outcome(i) end

--- A recorded trace of robot i, as far as it goes: "center_of_mass" [sample][3], "position" and
--- "velocity" [sample][mass][3], "contact" [sample][1], "energy" [sample][4], "strain" [sample][2],
--- "ledger" [sample][9], "block" [sample][7]; with .rate, .unit, .samples.
---@param i integer
---@param kind string
---@return limax.view
function limax_simulation:trace(i, kind) end

--- Site of each mass of robot i as the engine counts them, from 0: x + (nx + 1) (y + (ny + 1) z).
---@param i integer
---@return limax.view [mass]
function limax_simulation:sites(i) end

--- Positions (m) and velocities (m/s) of robot i's masses now, world coordinates, as copies.
---@param i integer
---@return limax.view positions [mass][3]
---@return limax.view velocities [mass][3]
function limax_simulation:state(i) end

--- Where robot i's rigid block is now and how it moves; raises in a scene without one.
---@param i integer
---@return limax.block_state
function limax_simulation:block(i) end

--- What the steps of this simulation run on: `device`; for cpu `passes`; for cuda `path`,
--- `effects`, `precision`, `architecture`, the kernel's `origin` ("ahead of time", "cached",
--- "compiled") and the `seconds` that it took to get it, `threads`, `registers`, `spilled` (bytes),
--- `shared_bytes`, `blocks_of_multiprocessor`, `instructions`. Prepares the robots, so the first
--- call may take as long as a first step; numbers are those of the first GPU.
---@return table
function limax_simulation:describe() end

---@class limax.suite
---@field name string
---@field cases limax.case[] in the order in which they were written
---@field fixtures table<string, limax.test_fixture>
local limax_suite = {}

--- Adds a test. Its name must be its own within the suite.
---@param name string
---@param options limax.test_options|nil may be left out
---@param run fun(t: limax.test_context)
---@overload fun(self: limax.suite, name: string, run: fun(t: limax.test_context))
function limax_suite:test(name, options, run) end

--- Says how to make what several tests begin with: `t:fixture(name)` makes it when a test first
--- asks for it, and `close` ends it after that test. A shared one is made once for the file,
--- without a `t`, and ended after the file's last test: for what no test changes.
---@param name string
---@param options { close: fun(value: any)|nil, shared: boolean|nil }|nil may be left out
---@param make fun(t: limax.test_context|nil): any
---@overload fun(self: limax.suite, name: string, make: fun(t: limax.test_context): any)
function limax_suite:fixture(name, options, make) end

---@class limax.supervision.step what a supervisor with state between generations gets
---@field generation integer that is to be bred
---@field history limax.generation[]
---@field random table
---@field limits limax.limit[]
---@field judge fun(proposal: any, reason: any, about: { supervisor: string, source?: string }): table, table, table as `ledger.judge`

---@class limax.supervisor
---@field name string a library name, or "function"
---@field call limax.supervisor.law|nil
---@field start (fun(run: limax.run): limax.supervisor.session)|nil instead of `call`
---@field own boolean|nil is it the user's own function?
---@field unfit? fun(config: table): string|nil why it cannot serve this experiment

---@alias limax.supervisor.law
---| fun(history: limax.generation[], random: table, limits: limax.limit[]): limax.proposal?,string?

---@class limax.supervisor.session
---@field decide fun(self: any, step: limax.supervision.step): table, table, table, table

---@class limax.test_context
---@field name string of the test
---@field suite string
---@field file string path of the suite's file
---@field device limax.device|nil where the test names devices or threads
---@field threads integer|nil where the test names threads
---@field precision string|nil where the test names precisions
---@field integrator string|nil where the test names integrators
---@field seed integer|nil where the test names seeds
local limax_test_context = {}

--- Fails unless |got - expected| <= atol + rtol |expected|, for numbers and for every number of
--- nested tables and views. Without a tolerance, rtol is 1e-9.
---@param got any
---@param expected any
---@param options { rtol: number|nil, atol: number|nil }|nil
function limax_test_context:near(got, expected, options) end

--- Fails unless both are equal, element by element; NaN equals NaN.
---@param got any
---@param expected any
function limax_test_context:equal(got, expected) end

--- Fails unless every number has the same 64 bits, and all else is equal.
---@param got any
---@param expected any
function limax_test_context:same_bits(got, expected) end

--- Fails unless `condition` is true (or anything but nil and false).
---@param condition any
---@param text string|nil what should have held
function limax_test_context:ok(condition, text) end

--- Fails unless `call` raises a message that contains `pattern`, as it stands or as a Lua pattern.
---@param pattern string
---@param call fun()
---@return string message what was raised
function limax_test_context:raises(pattern, call) end

--- Fails unless the values are near those recorded in golden/SUITE_FILE/NAME.json, and what the
--- test has simulated so far is what was simulated then: scenes, materials, bodies and settings,
--- but not the device, nor what the test's matrix varies. A missing golden fails; `limax test
--- --update-golden` records. `class` names the kind of tolerance ("bits", "rounding", "short
--- horizon", "statistics"), from which rtol comes where it is left out; `why` says where it comes
--- from. `configuration` stands for what no simulation shows, such as the options of an expression.
---@param name string letters, digits, _ and -
---@param values table numbers, strings, tables and views
---@param options { class: string|nil, rtol: number|nil, atol: number|nil, why: string|nil, configuration: table|nil }|nil exact if left out
function limax_test_context:golden(name, values, options) end

--- Calls `draw` for each seed, and fails where chance would explain its values less often than
--- `level`: their mean against `expected`, `at_least` or `at_most` by Student's t, or the values
--- against another sample by Mann and Whitney's test. The mean is printed.
---@param draw fun(seed: integer): number|boolean
---@param options limax.test_statistics
function limax_test_context:statistically(draw, options) end

--- What the suite's fixture of this name makes: once for this test, or once for the file where it
--- is shared.
---@param name string
---@return any
function limax_test_context:fixture(name) end

--- Options of a simulation with what the test's matrix says: device, precision and integrator.
---@param options table|nil
---@return table
function limax_test_context:with(options) end

--- Ends the test here, neither passed nor failed.
---@param reason string
function limax_test_context:skip(reason) end

--- A line printed with the test's result.
---@param text string
function limax_test_context:note(text) end

--- A new, empty folder, removed after the test.
---@return string path
function limax_test_context:folder() end

---@class limax.test_fixture
---@field make fun(t: limax.test_context|nil): any
---@field close fun(value: any)|nil
---@field shared boolean

---@class limax.test_options
---@field devices "all"|string[]|string|nil t.device is the open device
---@field precisions "all"|string[]|string|nil t.precision is one of them
---@field integrators "all"|string[]|string|nil t.integrator is one of them
---@field threads integer[]|integer|nil of the CPU's device; t.threads is the number
---@field seeds integer[]|integer|nil t.seed is one of them
---@field limit number|nil seconds of wall time that the test may take
---@field skip string|nil why the test does not run for now
---@field tags string[]|string|nil names to choose tests by

---@class limax.test_statistics
---@field seeds integer[]|integer|nil the seeds, or how many from 1; 12
---@field expected number|number[]|nil the mean, or a sample to compare with
---@field rtol number|nil of an expected mean, beside what chance explains
---@field atol number|nil
---@field at_least number|nil
---@field at_most number|nil
---@field level number|nil chance of a false alarm; 1e-4

---@class limax.view
---@field shape integer[] lengths along the axes
---@field unit string|nil of the numbers
---@field rate number|nil samples per second, of a trace
---@field samples integer|nil of a trace
local limax_view = {}

--- Length along an axis, the first if none is named.
---@param axis integer|nil
---@return integer
function limax_view:size(axis) end

--- A view of the same shape over its own memory, which nothing ends.
---@return limax.view
function limax_view:copy() end

--- The numbers as nested Lua lists.
---@return table
function limax_view:table() end

--- Pointer to the first element, unchecked from here on: it does not keep the owner alive, and
--- nobody says when what it points to is gone. The second result is the list of strides, in
--- elements.
---@return ffi.cdata* pointer
---@return integer[] strides
function limax_view:pointer() end

---@class limax
---@field version string Version of limax.
---@field home string folder of scripts, materials and prompts
local limax = {}

--- A robot by hand, of a genome (tables), from a robot file (its path), or again the body of one
--- that was simulated.
---@param given string|limax.robot.given|limax.robot.of_genome|limax.scored_robot
---@return limax.robot
function limax.robot(given) end

--- Checks and resolves an experiment. Whatever is wrong raises at the caller's line, with exit
--- status 2. Fields: name, lattice, materials, seed, genome, scene, simulation, record, population,
--- generations, evaluations, repetitions, breeding, fitness (the one without a default), selection,
--- supervisor, supervision, not_in_paper.
---@param given table
---@return limax.experiment
function limax.experiment(given) end

--- Makes one repetition of an experiment, ready for `:generations()`.
---@param experiment limax.experiment
---@param options? limax.run.options
---@return limax.run
function limax.start(experiment, options) end

--- Fitness functions: `fitness = "walk"`, or `{ "distance", axis = "x" }`.
limax.fitness = {}

--- Twice the horizontal distance of the run's second half, m, so that falling over or one jump is
--- no gait. With `axis`, its signed part along x, y or z.
---@param robot limax.scored_robot
---@param options? { axis?: "x"|"y"|"z" }
---@return number
function limax.fitness.walk(robot, options) end

--- Horizontal distance from t = 0 to the end, m. With `axis`, its signed part. With `cases = n`,
--- also the distances of n equal parts of the run, for lexicase selection.
---@param robot limax.scored_robot
---@param options? { axis?: "x"|"y"|"z", cases?: integer }
---@return number
---@return number[]? cases
function limax.fitness.distance(robot, options) end

--- Mean horizontal speed of the whole run, m/s, or body lengths per second.
---@param robot limax.scored_robot
---@param options? { axis?: "x"|"y"|"z", body_lengths?: boolean }
---@return number
function limax.fitness.speed(robot, options) end

--- Highest rise of the centre of mass above its place at t = 0, m.
---@param robot limax.scored_robot
---@return number
function limax.fitness.height(robot) end

--- Weight times distance for each joule that the muscles put in: the inverse of a cost of
--- transport, 1. Being alive costs `idle_power` too, else a body that hardly moves divides two tiny
--- numbers.
---@param robot limax.scored_robot
---@param options? { idle_power?: number } W/kg
---@return number
function limax.fitness.efficiency(robot, options) end

--- Distance over the length of the path, 0 to 1. Trembling in place has no direction: below
--- `least_path` it is 0.
---@param robot limax.scored_robot
---@param options? { least_path?: number } m
---@return number
function limax.fitness.straightness(robot, options) end

--- Twice the horizontal way of the scene's block in the run's second half, m, so that falling
--- against it once is not enough. With `axis`, its signed part along x, y or z.
---@param robot limax.scored_robot
---@param options? { axis?: "x"|"y"|"z" }
---@return number
function limax.fitness.carry(robot, options) end

--- The fitness that an experiment names: a library name, { name, option = value }, or a function,
--- which says itself through the experiment's `record` what it reads.
---@param spec string|table|fun(robot: limax.scored_robot): number, number[]?
---@return limax.fitness
function limax.fitness.get(spec) end

--- Unit, formula, options and traces of each function, by its name.
limax.fitness.entries = {}

--- Selection schemes: `selection = "rank"`, or `{ "tournament", size = 3 }`.
limax.selection = {}

--- The scheme that an experiment names: a name, { name, option = value }, or a function, which is
--- taken as it is.
---@param spec string|table|limax.selection.scheme
---@return limax.selection.scheme
---@return string name a library name, or "function"
function limax.selection.get(spec) end

--- Options of each scheme, by its name.
limax.selection.entries = {}

--- Supervisors: `supervisor = "rules"`, or `{ "rules", patience = 5 }`.
limax.supervise = {}

--- The supervisor that an experiment names: a name, { name, option = value }, or a function.
---@param spec string|table|limax.supervisor.law
---@return limax.supervisor
function limax.supervise.get(spec) end

--- Options of each supervisor, by its name.
limax.supervise.entries = {}

--- Names of the four parameters that every supervisor may set.
limax.supervise.parameters = {}

--- Ready scenes; effects handed over replace a scene's own, false removes them.
limax.scenes = {}

--- Flat ground at z = 0 under standard gravity, with friction, damping and muscles.
---@param changes? table effect = true, false or { field = value }
---@return table scene
function limax.scenes.land(changes) end

--- Nothing to stand on: gravity, damping and muscles. `gravity = false` floats.
---@param changes? table
---@return table scene
function limax.scenes.air(changes) end

--- Still water without a bottom or a surface: drag on exposed faces, damping and muscles. The field
--- `buoyancy` is the weight of the water that a body displaces over its own: at 1 it hovers, below
--- it sinks, above it rises. Size and weight are the body's, so a scene cannot tell. Other keys are
--- effects: `drag = { current = { 0.2, 0, 0 } }` is a river.
---@param options? { buoyancy?: number }
---@return table scene
function limax.scenes.water(options) end

--- An endless slope, as flat ground under tilted gravity: x and y run along the slope, z at right
--- angles to it. Downhill is +x, turned by `direction` about z. Other keys are effects.
---@param options { angle: number, direction?: number, gravity?: number } rad, rad, m/s^2
---@return table scene
function limax.scenes.slope(options) end

--- Flat ground and stairs that rise along +x: as many steps as `count`, each `step` higher than the
--- one before and `depth` deep. The first begins at x = `start`; a body starts at x = 0 and reaches
--- as far as it is long. Other keys are effects. All lengths in m.
---@param options? table step, depth, count, width, start, and effects
---@return table scene
function limax.scenes.stairs(options) end

--- Flat ground and the inside of a corner: walls across x and across y, `distance` away from the
--- world's origin. Other keys are effects.
---@param options? { distance?: number } m
---@return table scene
function limax.scenes.corner(options) end

--- Uneven land: random heights from `roughness` below 0 to 0, `spacing` apart, on a square of this
--- `size` around the world's origin. The same for the same `seed`. Other keys are effects.
---@param options? { roughness?: number, spacing?: number, size?: number, seed?: integer } m
---@return table scene
function limax.scenes.rough(options) end

--- Measures of a scored population.
limax.diversity = {}

--- Mean share of voxels in which two distinct robots differ, 0 to 1; 0 for one robot.
---@param population table a scored population
---@param part? "all"|"top" all scored robots (the default), or their better half
---@return number|nil
function limax.diversity.hamming(population, part) end

--- Root mean square over genes of the standard deviation over the robots.
---@param population table
---@param part? "all"|"top"
---@return number|nil
function limax.diversity.genotype(population, part) end

--- Number of different bodies.
---@param population table
---@param part? "all"|"top"
---@return integer|nil
function limax.diversity.distinct(population, part) end

--- Mean share of each material over all voxels, by name, empty included.
---@param population table
---@param part? "all"|"top"
---@return table<string, number>|nil
function limax.diversity.material_shares(population, part) end

--- The better half of a ranking, rounded up.
---@param ranked integer[] indices, best first
---@return integer[]
function limax.diversity.top_half(ranked) end

--- The diversity of all scored robots and of their better half; empty without a scored robot.
---@param population limax.population of the engine
---@param ranked integer[] indices of the scored robots, best first
---@param materials limax.materials
---@return { all: limax.diversity.values|nil, top: limax.diversity.values|nil }
function limax.diversity.measure(population, ranked, materials) end

--- Robots of a population, simulated and scored again under another setting.
limax.rescore = {}

--- Scores robots of an expressed population under another setting, by the experiment's fitness.
---@param robots limax.population.scored
---@param setting table see rescore.options
---@param which integer[]|nil indices; every robot if left out
---@return limax.rescored
function limax.rescore.population(robots, setting, which) end

--- Options of the engine for an experiment's `simulation` with another setting instead of its own
--- tier. Raises at `level` where the setting is not valid.
---@param config table of the experiment
---@param setting { accuracy: string|nil, integrator: string|nil, precision: string|nil, time_step: number|"auto"|nil, bound_fraction: number|nil, time_step_most: number|nil }
---@param level integer|nil 1 is the caller of this function
---@return table
function limax.rescore.options(config, setting, level) end

--- Suites of scripted regressions, run by `limax test FILE`.
limax.test = {}

--- Begins a suite.
---@param name string
---@return limax.suite
function limax.test.suite(name) end

--- The devices that `devices = "all"` stands for.
limax.test.DEVICES = {}

--- The objects over the C interface; the library is written on top of them.
limax.engine = {}

--- Opens a device. One that is not to be had raises, saying why.
---@param name "auto"|"cpu"|"cuda"|nil auto if left out
---@param options { threads: integer|nil, isa: string|nil }|nil
---@return limax.device
function limax.engine.device(name, options) end

--- Reads a material table.
---@param source string|table a path that ends in .json, the name of a shipped table, or the table
---@return limax.materials
function limax.engine.materials(source) end

--- Makes an encoding.
---@param options limax.encoding_options
---@return limax.encoding
function limax.engine.encoding(options) end

--- Makes a population whose genomes are 0 and whose bodies are empty.
---@param options { lattice: integer[]|nil, count: integer, encoding: limax.encoding|nil }
---@return limax.population
function limax.engine.population(options) end

--- Every effect that a scene can name, in the order in which they act.
---@return limax.effect[]
function limax.engine.effects() end

--- Makes a scene.
---@param given table<string, boolean|table>
---@return limax.scene
function limax.engine.scene(given) end

--- Prepares to simulate the robots of a population whose bodies were expressed or checked.
---@param robots limax.population
---@param table_of_materials limax.materials
---@param in_scene limax.scene
---@param options table see OPTIONS; what is left out has the engine's default
---@param on limax.device|nil
---@param mask boolean[]|nil which robots; all if left out
---@return limax.simulation
function limax.engine.simulation(robots, table_of_materials, in_scene, options, on, mask) end

--- Advances several simulations for about `seconds` of wall time in all, so that small ones can
--- share a device that none of them fills. Bits are those of advancing each alone.
---@param simulations limax.simulation[]
---@param seconds number
---@return limax.progress[] of each
function limax.engine.advance_together(simulations, seconds) end

--- Stops every simulation once `seconds` of wall time have passed from now: the next slice raises.
--- nil lifts it.
---@param seconds number|nil
function limax.engine.limit_time(seconds) end

--- Steps every robot from the start. The options are a simulation's, and must be symplectic Euler
--- in single precision. Nothing looks for divergence.
---@param robots limax.population
---@param table_of_materials limax.materials
---@param in_scene limax.scene
---@param options table as of engine.simulation
---@param steps integer of each robot
---@param on limax.device|nil
---@return number seconds that the GPU took for the steps, the least of three runs
---@return number[][] centers centre of mass at the end, [robot][3], m
function limax.engine.reconstruction(robots, table_of_materials, in_scene, options, steps, on) end

--- A stream of random numbers, at its beginning.
---@param seed number|string|ffi.cdata*
---@param repetition integer 1, 2, ...
---@param stream "selection"|"supervision"|"user"
---@param generation integer|nil 0 if left out
---@param individual integer|nil 0 if left out
---@return limax.random
function limax.engine.random(seed, repetition, stream, generation, individual) end

--- Whether `value` is a view.
---@param value any
---@return boolean
function limax.engine.is_view(value) end

--- Bytes that live objects hold outside Lua.
---@return integer
function limax.engine.bytes_held() end

--- Counts a handle about to be made, and collects garbage where the limits say so.
---@param weight integer|nil how many handles this one counts for
---@return boolean collected
function limax.engine.collect(weight) end

--- Raises `text` at fault.place().
---@param text string
function limax.engine.fail(text) end

--- `FILE:LINE` of fault.place().
---@return string
function limax.engine.where() end

--- Where the call came from: the nearest line of a user's file, else the nearest one outside
--- bindings/.
---@return string file as Lua shows it in messages; "?" where there is none
---@return integer line
---@return string source the file's whole path
function limax.engine.place() end

--- Version of the engine's library.
limax.engine.version = {}

--- Every name of the C interface's enumerations: traces, integrators, states.
limax.engine.names = {}

--- Every default of an experiment.
limax.defaults = {}

return limax
