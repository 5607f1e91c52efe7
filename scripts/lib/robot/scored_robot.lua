--- scored_robot.lua: the `robot` that fitness, selection and supervisors see: its body, measures
--- and traces. It reads its row and, as long as that exists, the simulation. SI units; t = 0 is
--- when actuation starts.

local body = require "limax.robot.body"
local choice = require "limax.base.choice"
local defaults = require "limax.settings.defaults"
local measured = require "limax.robot.measured"
local energy_balance = require "limax.robot.energy_balance"
local engine = require "limax.engine"
local prepared = require "limax.robot.prepared"
local robot_file = require "limax.robot.robot_file"
local robot_in_motion = require "limax.robot.robot_in_motion"
local robot_trials = require "limax.robot.robot_trials"
local rows = require "limax.robot.rows"
local schema = require "limax.engine.schema"
local strict = require "limax.engine.strict"
local suggest = require "limax.engine.suggest"

local scored_robot = {}

local function fail(pattern, ...) engine.fail(pattern:format(...)) end

---@class limax.scored_robot
---@field id integer number in its run
---@field parents integer[] ids, none or two
---@field generation integer that it first appeared in
---@field origin string "initial", "elite", "bred" or "hand"
---@field island integer|nil that it is on, in an experiment with islands
---@field status "done"|"invalid"|"diverged"|"failed" how its simulation ended
---@field reason string|nil why not "done"
---@field fitness number|nil its score; nil without one
---@field cases number[]|nil scores by case, for lexicase selection
---@field measures table<string, number>|nil numbers that the fitness returns by name
---@field descriptors number[]|nil of the experiment's archive, in its order
---@field objectives number[]|nil of the experiment's survival or archive, in its order
---@field novelty number|nil mean distance to its nearest neighbours, with a novelty archive
---@field age integer|nil generations since its oldest ancestor, with the survival "age_fitness"
---@field coarse boolean a mass was seen to move farther than a tenth of an edge in one step
---@field undersampled boolean a period of the muscles has fewer than 20 steps
---@field trials limax.scored_robot[] it in each trial of the experiment, with all measures; without
--- trials only the robot itself. The robot's own measures are those of the first trial.
---@field genome any view of the genes, nil for a robot made by hand
---@field body limax.robot.body what it consists of
---@field record table the same as a plain table, with `outcome` and `trials`
---@field row limax.row its fields in the array of its generation
---@field context limax.robot.context population, simulation, scene and options
local methods = strict.methods "robot"

local of_record = { id = true, parents = true, generation = true, origin = true, island = true,
  status = true, reason = true, fitness = true, cases = true, measures = true, descriptors = true,
  objectives = true, novelty = true, age = true }

local function gone(record, what)
  fail("robot %s: its %s is gone: a run without a folder keeps genomes for the last three"
    .. " generations; limax.start(experiment, { out = FOLDER }) keeps all", record.id, what)
end

-- The keys of a robot's generation, and of tables that were made of its row.
local GENERATION, TABLES = {}, {}

-- Fields that are made once, when they are first read; a genome of other ranks at each read, in
-- which all of them take part.
local made = {}

local function is_divided(self)
  local robots = rawget(self.context, "robots")
  return robots ~= nil and robots.world.is_divided
end

--- The origin of a robot. Traces need `simulation`, the genome needs `population`.
---@class limax.robot.context
---@field population? limax.population of the engine
---@field index? integer in it
---@field simulation? limax.simulation of the engine
---@field materials limax.materials
---@field scene table
---@field options table settings of the simulation, with `record` and `edge`
---@field fitness? any as robot files keep it
---@field trials? limax.robot.context[] of each trial, where there are any

-- The context of a robot of a generation. It looks up simulations and the population in the
-- generation: a simulation may be freed, and genomes are read from a folder when they are needed.
local Context = {}

function Context.__index(context, key)
  local robots, i = rawget(context, "robots"), rawget(context, "number")
  if key == "population" or key == "index" then
    local population, index = robots.world.place(robots, i)
    if key == "index" then return index end
    return population
  end
  if key ~= "simulation" then return nil end
  local simulations = (rawget(context, "traces") or robots.traces or {})[i]
  return simulations and simulations[context.trial]
end

-- The context of robot i of a generation. `other` has materials, options of each trial, traces and
-- the place in the population if they are not the generation's.
local function context_of(robots, i, other)
  local materials, config = other.materials or robots.materials, robots.world.config
  local function context(k)
    local trial = robots.trials[k]
    return setmetatable({ robots = robots, number = i, trial = k, materials = materials,
      population = other.population, index = other.index, scene = trial.scene,
      options = other.options and other.options[k] or trial.options,
      traces = other.traces }, Context)
  end
  local whole = context(1)
  whole.fitness = config.fitness
  if config.trials then
    whole.trials = {}
    for k, trial in ipairs(robots.trials) do
      whole.trials[k] = context(k)
      whole.trials[k].materials = trial.engine_materials or materials
    end
  end
  return whole
end

function made.context(self)
  local robots = rawget(self, GENERATION)
  return robots and context_of(robots, self.row[2], {})
end

function made.body(self) return body.view(self.row.body) end

function made.genome(self)
  if not rawget(self, GENERATION) and self.row.origin == "hand" then return nil end
  local population = self.context.population
  if not population then gone(self.row, "genome") end
  return population:genome(self.context.index)
end

-- Trials count from 1.
local TRIALS = { __index = function(_, k)
  if k == 0 then fail "robot.trials[0]: trials count from 1: robot.trials[1] is the first" end
end }

function made.trials(self)
  local row, contexts = self.row, self.context.trials
  if not contexts then return setmetatable({ self }, TRIALS) end
  if not row.outcome then
    fail("robot %s has no trials yet: it has not been simulated", row.id)
  end
  return setmetatable(robot_trials.each(row, self.context, scored_robot.new), TRIALS)
end

-- Fields that are computed from the outcomes.
local computed = {}

function computed.coarse(self) return rows.is_coarse(self.row) end

function computed.undersampled(self)
  return robot_trials.is_undersampled(self.row, self.context)
end

function computed.record(self) return rows.record(self.row) end

-- Fields that are tables. They are made from the row at the first read after it changed, so that
-- scripts get the same table each time and may write to it.
local IS_TABLE = { parents = true, cases = true, measures = true, descriptors = true,
  objectives = true, record = true }

local function table_field(self, name)
  local tables, stamp = rawget(self, TABLES), self.row[1].stamp
  if not tables or tables.stamp ~= stamp then
    tables = { stamp = stamp }
    rawset(self, TABLES, tables)
  end
  if tables[name] == nil then
    tables[name] = computed[name] and computed[name](self) or self.row[name]
  end
  return tables[name]
end

local class = {}

function class.__index(self, key)
  if IS_TABLE[key] then return table_field(self, key) end
  if of_record[key] then return self.row[key] end
  if computed[key] then return computed[key](self) end
  if made[key] then
    local value = made[key](self)
    if key ~= "genome" or not is_divided(self) then rawset(self, key, value) end
    return value
  end
  return methods[key] or strict.unknown("a robot", key, of_record, computed, made, methods)
end

class.__newindex = strict.read_only("a robot", "a fitness returns its score and measures; keep"
  .. " other values in a table of your own, by robot.id")

function class.__tostring(self)
  local row = self.row
  local shape = row.body
  local fitness = row.fitness and (", fitness %.6g"):format(row.fitness) or ""
  return ("robot %s: %s%s%s, %d voxels, %dx%dx%d, %.4g kg"):format(row.id, row.status or "bred",
    row.reason and " (" .. rows.explained(row.reason) .. ")" or "", fitness, shape.voxels,
    shape.size[1], shape.size[2], shape.size[3], shape.mass)
end

--- Makes the object of a row and its context.
---@return limax.scored_robot
function scored_robot.new(row, context)
  return setmetatable({ row = row, context = context }, class)
end

--- Robot i of a generation.
---@return limax.scored_robot
function scored_robot.of(robots, i)
  return setmetatable({ row = robots.rows[i], [GENERATION] = robots }, class)
end

--- Robot i of a generation as another simulation of it sees it.
---@param row limax.row of that simulation
---@param i integer in the generation
---@param other { materials: limax.materials, options?: table[], traces: table,
--- population: limax.population, index: integer } options of each trial; simulations by robot and
--- trial; its place in them
---@return limax.scored_robot
function scored_robot.again(row, robots, i, other)
  return scored_robot.new(row, context_of(robots, i, other))
end

--- Was it simulated in several trials?
function scored_robot.has_trials(robot)
  local robots = rawget(robot, GENERATION)
  if robots then return robots.world.config.trials ~= nil end
  return robot.context.trials ~= nil
end

--- Is this the name of a method that robots have once they are simulated?
---@param name any
function scored_robot.measures_by(name) return methods[name] ~= nil end

--- Names of the methods of a robot that was simulated.
function scored_robot.methods() return choice.sorted_keys(methods) end

--- Is this value a scored robot?
function scored_robot.is(value) return getmetatable(value) == class end

-- ---- measures -----------------------------------------------------------------------------------

local axis_rule, from_rule = schema.choice { "x", "y", "z" }, schema.choice { "start", "middle" }
local axis_and_from = schema.fields { axis = axis_rule, from = from_rule }
local only_axis, only_from = schema.fields { axis = axis_rule }, schema.fields { from = from_rule }

local function read_options(options, what, rules)
  local checked, message = rules(options or {}, what)
  if not checked then engine.fail(message) end
  return checked
end

--- Seconds from t = 0 to the end.
---@return number s
function methods:duration() return measured.outcome(self, "duration").time end

--- Horizontal length between the centres of mass at t = 0 and at the end, m; with `axis`, its
--- signed part along x, y or z; with `from = "middle"`, from half of the time on.
---@param options? { axis?: "x"|"y"|"z", from?: "start"|"middle" }
---@return number m
function methods:distance(options)
  options = read_options(options, "distance", axis_and_from)
  return measured.distance(self, options.from, options.axis)
end

--- The vector between the centres of mass at t = 0 (or from the middle) and at the end, m.
---@param options? { from?: "start"|"middle" }
---@return number[] { dx, dy, dz }
function methods:displacement(options)
  options = read_options(options, "displacement", only_from)
  return { measured.moved(self, "displacement", options.from) }
end

--- Distance over duration, m/s; `axis` as in distance.
---@param options? { axis?: "x"|"y"|"z" }
---@return number m/s
function methods:speed(options)
  options = read_options(options, "speed", only_axis)
  return self:distance { axis = options.axis } / self:duration()
end

--- Horizontal length of the path of the centre of mass, m. Reads the trace "center_of_mass".
---@return number m
function methods:path_length()
  return measured.summary(self, "path_length", "path_length", "center_of_mass")
end

--- Highest rise of the centre of mass above its position at t = 0, m. Reads the trace
--- "center_of_mass".
---@return number m
function methods:height() return measured.summary(self, "height", "height", "center_of_mass") end

--- Mean share of the masses that touch the ground or another contact, 0 to 1. Reads the
--- trace "contact".
---@return number
function methods:contact() return measured.summary(self, "contact", "contact", "contact") end

--- Means of kinetic and elastic energy (of springs and contacts), and the muscles' positive work in
--- all, J. Of the body, without a block. Reads the trace "energy".
---@return { kinetic: number, elastic: number, muscle_work: number } J
function methods:energy()
  local function part(field) return measured.summary(self, "energy", field, "energy") end
  return { kinetic = part "kinetic", elastic = part "elastic", muscle_work = part "muscle_work" }
end

---@class limax.robot.block
---@field displacement number[] from t = 0, or the middle, to the end, { dx, dy, dz }, m
---@field distance number horizontal length of that, m
---@field position number[] of its centre at the end, in the world, m
---@field velocity number[] at the end, m/s
---@field tilt number angle between its own z axis and the world's at the end, rad

--- The motion of the scene's first rigid block, with `from = "middle"` in the second half of the
--- time.
---@param options? { from?: "start"|"middle" }
---@return limax.robot.block
function methods:block(options)
  options = read_options(options, "block", only_from)
  local outcome = measured.outcome(self, "block")
  local last = outcome.block_end
  if last[0] ~= last[0] then
    fail("scene.block: robot %s has none in its scene; limax.scenes.land { block = true } has one",
      self.row.id)
  end
  local first = options.from == "middle" and outcome.block_middle or outcome.block_start
  local displacement = { last[0] - first[0], last[1] - first[1], last[2] - first[2] }
  local velocity = outcome.block_velocity
  return {
    displacement = displacement, distance = math.sqrt(displacement[1] ^ 2 + displacement[2] ^ 2),
    position = { last[0], last[1], last[2] },
    velocity = { velocity[0], velocity[1], velocity[2] },
    -- rounding may put a cosine beyond 1
    tilt = math.acos(math.max(-1, math.min(1, outcome.block_upright))),
  }
end

--- The energy balance of the robot: its energy at the end, the works since t = 0, and the balance
--- error. Reads the trace "ledger" (CPU only).
---@return limax.robot.energy_balance
function methods:ledger()
  measured.outcome(self, "ledger")
  return energy_balance.of(self:trace "ledger")
end

--- Mean strain |r - L0| / L0 over springs and time, and the largest of any spring at any sample.
--- Reads the trace "strain".
---@return number mean
---@return number largest
function methods:strain()
  local mean = measured.summary(self, "strain", "strain", "strain")
  return mean, measured.summary(self, "strain", "strain_most", "strain")
end

--- Mass of the body, kg.
---@return number kg
function methods:mass() return self.row.body.mass end

local function edge_of(self)
  return self.context.options.edge or defaults.fields.simulation.edge.value
end

--- Longer horizontal side of the body at rest: one body length, m.
---@return number m
function methods:length()
  local size = self.row.body.size
  return math.max(size[1], size[2]) * edge_of(self)
end

--- A recorded trace from t = 0: [sample][column], or of "position" and "velocity"
--- [sample][mass][column]; with `.rate` (Hz), `.unit` and `.columns`, the columns' names, which
--- `?record` lists for every trace.
---@param kind string
---@return any view
function methods:trace(kind)
  if not choice.contains(defaults.traces, kind) then
    fail("trace: unknown name %s%s", schema.show(kind), suggest.ending(kind, defaults.traces))
  end
  if not measured.is_recorded(self, kind) then
    fail("trace %q was not recorded; add the entry %s (samples per second)", kind,
      measured.entry_to_add(self, kind))
  end
  local simulation = self.context.simulation
  if not simulation then
    fail("robot %s: its trace %q is gone: traces end when the population is bred; copy() keeps one",
      self.row.id, kind)
  end
  return simulation:trace(self.context.index, kind)
end

-- ---- keeping and repeating ----------------------------------------------------------------------

--- All that is needed to simulate this robot again: the plain table that a robot file holds.
---@return limax.robot.description
function methods:table()
  local context, record = self.context, rows.record(self.row)
  if not context.population then gone(self.row, "body") end
  local description =
    robot_file.describe(context.population, context.index, context.materials, edge_of(self))
  description.scene, description.simulation = context.scene, context.options
  description.fitness, description.score = context.fitness, record.fitness
  description.outcome, description.trials = record.outcome, robot_trials.described(context)
  for _, name in ipairs { "id", "generation", "parents", "origin" } do
    description[name] = record[name]
  end
  return description
end

--- Writes this robot as a file that `limax.robot(file)` reads, and that replays to the same score.
---@param path string
function methods:save(path) robot_file.write(path, self:table()) end

-- Row and context after one simulation of a robot.
local function simulated(robot, options)
  local simulation, result, control = prepared.simulation(robot, options)
  local progress = type(options) == "table" and options.progress or nil
  if control then return robot_in_motion.new(simulation, result, control):finish(progress) end
  simulation:run(progress)
  return result()
end

--- Simulates a robot to its end: in each of its trials, unless `options` name a scene or a trial.
---@param robot { description: limax.robot.description, materials: limax.materials,
--- population: limax.population }
---@param options? limax.robot.simulate_options
---@return limax.scored_robot
function scored_robot.simulate(robot, options)
  local own = options == nil and {} or options
  if not robot.description.trials or type(own) ~= "table" or own.scene or own.trial then
    return scored_robot.new(simulated(robot, options))
  end
  return scored_robot.new(robot_trials.joined(robot, own, prepared.simulation))
end

--- Simulates the same body again: scene and settings as they were, except for what `options` names
--- (limax.robot has the list).
---@param options? table
---@return limax.scored_robot
function methods:simulate(options)
  local description = self:table()
  local materials = engine.materials(description.materials)
  return scored_robot.simulate({ description = description, materials = materials,
    population = robot_file.build(description, materials) }, options)
end

return scored_robot
