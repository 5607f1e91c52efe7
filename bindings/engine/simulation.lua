--- simulation.lua: bodies in a scene over time. A simulation copies its bodies; `advance` does
--- whole steps for a slice of wall time, `run` repeats it to the end. Slicing does not affect
--- results. SI units.

local ffi = require "ffi"
local host = require "limax.host"
local abi = require "limax.engine.abi"
local device = require "limax.engine.device"
local fault = require "limax.engine.fault"
local fields = require "limax.engine.fields"
local materials = require "limax.engine.materials"
local names = require "limax.engine.names"
local object = require "limax.engine.object"
local outcome = require "limax.engine.outcome"
local population = require "limax.engine.population"
local scene = require "limax.engine.scene"
local schema = require "limax.engine.schema"
local view = require "limax.engine.view"

local C = abi.C
local class = object.class("simulation", "simulation")
local methods = class.methods

-- seconds of one slice of run(): short enough for progress and Ctrl-C
local SLICE = 0.05

local CHOICES = { "integrator", "precision", "sharing", "bound" }

local rules, rates, numbers = {}, {}, fields.of "simulation"
for _, name in ipairs(names.trace.names) do rates[name] = schema.number(numbers.record) end
for name, field in pairs(numbers) do rules[name] = schema.field(field) end
for _, name in ipairs(CHOICES) do rules[name] = schema.choice(names[name].names) end
rules.time_step = schema.word_or_number("auto", numbers.time_step)
rules.record = schema.fields(rates)
numbers.time_step, numbers.record = nil, nil
local options_rule = schema.fields(rules)
local any_number, steps_rule = schema.number {}, schema.whole(0, 2 ^ 53, 0)
local state_rule, which_rule = schema.whole(0, 15), schema.whole(1, 2 ^ 31 - 1, 1)
local trace_rule, row_rule = schema.choice(names.trace.names), schema.numbers(3)

---@class limax.simulation : limax.object
---@field count integer robots of the population, simulated or not
---@field record table<string, integer> samples per second of each recorded trace
---@field masses integer[] of each robot
---@field voxels integer of the lattice

-- Options of a script in the interface's struct, over the engine's defaults; and the rates of the
-- traces that are recorded.
local function options_of(options)
  options = schema.demand(options_rule, options, "simulation")
  local o, recorded = ffi.new "limax_simulation_options", {}
  C.limax_simulation_defaults(o)
  for name in pairs(numbers) do o[name] = options[name] end
  for _, name in ipairs(CHOICES) do
    if options[name] then o[name] = names[name].value[options[name]] end
  end
  if type(options.time_step) == "number" then o.time_step = options.time_step end
  for name, rate in pairs(options.record) do
    o.record[names.trace.value[name]] = rate
    if rate > 0 then recorded[name] = rate end
  end
  return o, recorded
end

local function mask_of(mask, count)
  if mask == nil then return nil end
  local rule = schema.list(schema.boolean(), { count = count,
    expected = ("a list of %d, true or false"):format(count) })
  return ffi.new("uint8_t[?]", count, schema.demand(rule, mask, "simulation: mask"))
end

--- Prepares to simulate the robots of a population whose bodies were expressed or checked.
---@param robots limax.population
---@param table_of_materials limax.materials
---@param in_scene limax.scene
---@param options table fields of `simulation` and `record` of an experiment; the engine's defaults
---@param on limax.device|nil
---@param mask boolean[]|nil which robots; all if left out
---@return limax.simulation
local function simulation(robots, table_of_materials, in_scene, options, on, mask)
  local what = "simulation"
  local population_handle = object.handle(what .. ": population", robots, population.class)
  local materials_handle = object.handle(what .. ": materials", table_of_materials, materials.class)
  local scene_handle = object.handle(what .. ": scene", in_scene, scene.class)
  local o, recorded = options_of(options)
  local target = device.handle(what, on)
  local bytes = mask_of(mask, robots.count)
  -- the engine counts a robot's masses when it begins, its buffers are needed before
  local bodies, masses = C.limax_population_bodies(population_handle), {}
  for i = 1, robots.count do masses[i] = bodies[i - 1].masses end
  return object.make(class, what, function(out)
    return C.limax_simulation_create(population_handle, materials_handle, scene_handle, o, bytes,
      target, out)
  end, { count = robots.count, record = recorded, masses = masses, inputs = in_scene:inputs(),
    voxels = robots.lattice[1] * robots.lattice[2] * robots.lattice[3] })
end

---@class limax.overlap
---@field subject string "robot 3", "the block", or "scene.block[2]" of several
---@field obstacle string "scene.boxes[2]"
---@field depth number m, of the deepest place
---@field robots integer that begin inside something

--- The deepest place of a body, or of a block, that begins inside an obstacle by more than a
--- twentieth of an edge; nil if none does.
---@return limax.overlap|nil
function methods:overlap()
  local what = "simulation:overlap"
  local out = ffi.new "limax_overlap"
  abi.check(C.limax_simulation_overlap(object.handle(what, self, class), out), what)
  if out.depth == 0 then return nil end
  return { subject = ffi.string(out.subject), obstacle = ffi.string(out.obstacle),
    depth = out.depth, robots = out.robots }
end

---@class limax.progress
---@field done integer robots that have ended, whatever their status
---@field robots integer robots that are simulated
---@field finished boolean
---@field interrupted boolean an interrupt ended the call early; the state is consistent
---@field steps number robot steps done
---@field steps_total number
---@field spring_steps number springs times steps done

local function progress_of(out)
  return { done = out.done, robots = out.robots, finished = out.finished ~= 0,
    interrupted = out.interrupted ~= 0, steps = out.steps, steps_total = out.steps_total,
    spring_steps = out.spring_steps }
end

--- Does whole steps for about `seconds` of wall time, or at most `steps` steps of each robot.
---@param seconds number
---@param steps integer|nil
---@return limax.progress
function methods:advance(seconds, steps)
  local what = "simulation:advance"
  local handle = object.handle(what, self, class)
  schema.demand(any_number, seconds, what .. ": seconds")
  steps = schema.demand(steps_rule, steps, what .. ": steps")
  local out = ffi.new "limax_progress"
  abi.check(C.limax_simulation_advance(handle, seconds, steps, out), what)
  return progress_of(out)
end

-- The handles of a list of simulations, and their number.
local function handles_of(what, simulations, seconds)
  schema.demand(schema.table, simulations, what .. ": simulations")
  schema.demand(any_number, seconds, what .. ": seconds")
  local handles = ffi.new("limax_simulation *[?]", #simulations)
  for i, each in ipairs(simulations) do
    handles[i - 1] = object.handle(("%s: simulations[%d]"):format(what, i), each, class)
  end
  return handles, #simulations
end

--- Begins with about `seconds` of steps of each simulation on its GPU and returns at once: the next
--- call that needs their results waits for them. On the CPU nothing happens until then.
---@param simulations limax.simulation[]
---@param seconds number
local function begin_together(simulations, seconds)
  local what = "begin_together"
  local handles, count = handles_of(what, simulations, seconds)
  abi.check(C.limax_simulations_begin(handles, count, seconds), what)
end

--- Advances several simulations for about `seconds` of wall time in total, so that small ones share
--- a device. Results are the same as when each is advanced by itself.
---@param simulations limax.simulation[]
---@param seconds number
---@return limax.progress[] of each
local function advance_together(simulations, seconds)
  local what = "advance_together"
  local handles, count = handles_of(what, simulations, seconds)
  local out = ffi.new("limax_progress[?]", count)
  abi.check(C.limax_simulations_advance(handles, count, seconds, out), what)
  local progress = {}
  for i = 1, count do progress[i] = progress_of(out[i - 1]) end
  return progress
end

--- Advances to the end. An interrupt raises host.interrupt; the simulation can then be continued.
---@param on_progress fun(progress: limax.progress)|nil called after each slice
---@return limax.progress
function methods:run(on_progress)
  object.handle("simulation:run", self, class)
  if on_progress ~= nil and type(on_progress) ~= "function" then
    schema.refuse("simulation:run: on_progress", "a function", on_progress)
  end
  while true do
    local progress = self:advance(SLICE)
    if progress.interrupted then
      host.raise_if_interrupted()
      error(host.interrupt, 0)
    end
    if on_progress then on_progress(progress) end
    if progress.finished then return progress end
  end
end

--- Describes the computation of this simulation: `device`; for cpu `passes`; for cuda `path`,
--- `effects`, `precision`, `architecture`, the kernel's `origin` ("ahead of time", "cached",
--- "compiled") and the `seconds` it took to get it, `threads`, `registers`, `spilled` (bytes),
--- `shared_bytes`, `blocks_of_multiprocessor`, `instructions`. Prepares the robots, so the first
--- call may take as long as a first step; numbers are those of the first GPU.
---@return table
function methods:describe()
  local what = "simulation:describe"
  local handle = object.handle(what, self, class)
  local out = ffi.new "const char *[1]"
  abi.check(C.limax_simulation_describe(handle, out), what)
  return abi.description(out[0], "simulation")
end

--- The outcome of robot i so far.
---@param i integer
---@return limax.outcome
function methods:outcome(i)
  local handle, robot = object.entry("simulation:outcome", self, class, i)
  return outcome.table(C.limax_simulation_outcomes(handle)[robot])
end

--- A recorded trace of robot i, as far as it goes: "center_of_mass" [sample][3], "position" and
--- "velocity" [sample][mass][3], "contact" [sample][1], "energy" [sample][4], "strain" [sample][2],
--- "ledger" [sample][9], "block" [sample][7] or, of several, [sample][block][7], "activation"
--- [sample][voxel], "sensor" [sample][input][voxel]; with .rate, .unit, .samples, .columns, and
--- .inputs, the names of what the controller reads.
---@param i integer
---@param kind string
---@return limax.view
function methods:trace(i, kind)
  local what = "simulation:trace"
  local handle, robot = object.entry(what, self, class, i)
  local value = names.trace.value[schema.demand(trace_rule, kind, what .. ": kind")]
  if not self.record[kind] then
    fault.raise(("%s: %s was not recorded; add record = { %s = 50 } (Hz)"):format(what, kind, kind))
  end
  local data = ffi.new "const double *[1]"
  local samples, width = ffi.new "int64_t[1]", ffi.new "int64_t[1]"
  abi.check(C.limax_simulation_trace(handle, robot, value, data, samples, width), what)
  local count, columns = tonumber(samples[0]), tonumber(width[0])
  local shape = { count, columns }
  if kind == "position" or kind == "velocity" then shape = { count, columns / 3, 3 } end
  local each = #names.trace_columns.block
  if kind == "block" and columns > each then shape = { count, columns / each, each } end
  local inputs = kind == "sensor" and { unpack(self.inputs) } or nil
  if inputs then shape = { count, #inputs, columns / math.max(1, #inputs) } end
  return view.new(self, kind, "double", data[0], shape,
    { fields = { rate = self.record[kind], unit = names.trace_unit[kind], samples = count,
      columns = { unpack(names.trace_columns[kind]) }, inputs = inputs } })
end

--- Site of each mass of robot i as the engine counts them, from 0: x + (nx + 1) (y + (ny + 1) z).
---@param i integer
---@return limax.view [mass]
function methods:sites(i)
  local handle, robot = object.entry("simulation:sites", self, class, i)
  local out = ffi.new "const int32_t *[1]"
  abi.check(C.limax_simulation_sites(handle, robot, out), "simulation:sites")
  return view.new(self, "sites", "int32_t", out[0], { self.masses[i] })
end

--- Positions (m) and velocities (m/s) of robot i's masses now, world coordinates, as copies.
---@param i integer
---@return limax.view positions [mass][3]
---@return limax.view velocities [mass][3]
function methods:state(i)
  local handle, robot = object.entry("simulation:state", self, class, i)
  local masses = self.masses[i]
  local positions = ffi.new("double[?]", math.max(1, 3 * masses))
  local velocities = ffi.new("double[?]", math.max(1, 3 * masses))
  abi.check(C.limax_simulation_state(handle, robot, positions, velocities), "simulation:state")
  local function copied(what, unit, data)
    return view.new(data, what, "double", data, { masses, 3 }, { fields = { unit = unit } })
  end
  return copied("positions", "m", positions), copied("velocities", "m/s", velocities)
end

---@class limax.block_state
---@field position number[] of its centre in the world, m
---@field orientation number[] quaternion w, x, y, z that turns its own axes into the world's
---@field velocity number[] m/s
---@field angular_velocity number[] rad/s, in the world

--- Sets state s[k] of robot i's controller in every voxel of the lattice, x first, for the next
--- tick; on the CPU only.
---@param i integer
---@param k integer from 0, as in the text
---@param values number[]
function methods:set_state(i, k, values)
  local what = "simulation:set_state"
  local handle, robot = object.entry(what, self, class, i)
  k = schema.demand(state_rule, k, what .. ": k")
  values = schema.demand(schema.list(any_number, { count = self.voxels,
    expected = ("a list of %d numbers, one for each voxel"):format(self.voxels) }), values,
    what .. ": values")
  local data = ffi.new("double[?]", #values, values)
  abi.check(C.limax_simulation_set_state(handle, robot, k, data), what)
end

--- Place and motion now of a rigid block of robot i; raises if the scene has no such block.
---@param i integer
---@param which? integer from 1, in the scene's order; 1 if absent
---@return limax.block_state
function methods:block(i, which)
  local what = "simulation:block"
  local handle, robot = object.entry(what, self, class, i)
  which = schema.demand(which_rule, which, what .. ": which")
  local state = ffi.new("double[?]", C.LIMAX_BLOCK_STATE)
  abi.check(C.limax_simulation_block(handle, robot, which - 1, state), what)
  local function part(first, count)
    local list = {}
    for k = 1, count do list[k] = state[first + k - 1] end
    return list
  end
  return { position = part(0, 3), orientation = part(3, 4), velocity = part(7, 3),
    angular_velocity = part(10, 3) }
end

-- [mass][3] numbers of a script, or one list, as the interface takes them; nil stays nil.
local function triples(what, rows, masses)
  if rows == nil then return nil end
  if view.is_view(rows) then rows = rows:table() end
  local flat, expected = rows, ("%d rows of 3 numbers"):format(masses)
  if type(rows) ~= "table" or type(rows[1]) ~= "number" then
    flat = {}
    local rule = schema.list(row_rule, { count = masses, expected = expected })
    for _, row in ipairs(schema.demand(rule, rows, what)) do
      for axis = 1, 3 do flat[#flat + 1] = row[axis] end
    end
  end
  local flat_rule = schema.list(any_number, { count = 3 * masses, expected = expected })
  return ffi.new("double[?]", math.max(1, 3 * masses), schema.demand(flat_rule, flat, what))
end

--- Sets positions (m) and velocities (m/s) of the masses of robot i before its first step.
---@param i integer
---@param positions number[][]|number[]|limax.view|nil [mass][3], or one list
---@param velocities number[][]|number[]|limax.view|nil [mass][3], or one list
function methods:place(i, positions, velocities)
  local what = "simulation:place"
  local handle, robot = object.entry(what, self, class, i)
  local masses = self.masses[i]
  local x = triples(what .. ": positions", positions, masses)
  local v = triples(what .. ": velocities", velocities, masses)
  abi.check(C.limax_simulation_place(handle, robot, x, v), what)
end

function class:__tostring()
  return self.handle and ("simulation of %d robots"):format(self.count) or "freed simulation"
end

return {
  class = class, simulation = simulation, options_of = options_of,
  advance_together = advance_together, begin_together = begin_together,
}
