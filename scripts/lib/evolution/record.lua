--- record.lua: records each generation, as an entry of the history and as files in the run folder,
--- and restores the last generation of a folder to continue a run.

local archived = require "limax.evolution.archived"
local arrays = require "limax.evolution.arrays"
local diversity = require "limax.run.diversity"
local division = require "limax.evolution.division"
local engine = require "limax.engine"
local engine_population = require "limax.engine.population"
local exchange = require "limax.base.exchange"
local failure = require "limax.base.failure"
local front = require "limax.experiment.front"
local generations = require "limax.evolution.generation"
local genes = require "limax.experiment.genes"
local history = require "limax.run.history"
local host = require "limax.host"
local materials = require "limax.evolution.materials"
local metrics = require "limax.run.metrics"
local rows = require "limax.robot.rows"
local rows_file = require "limax.robot.rows_file"
local scoring = require "limax.robot.scoring"
local state = require "limax.run.state"
local step_check = require "limax.evolution.step_check"

local record = {}

-- The champion's score under the run's first materials; nil if it does not end well under them.
local function standard_score(run, robots)
  local world, best = robots.world, robots.ranked[1]
  local champion = robots.rows[best]
  if materials.equal(materials.fields(robots.materials), world.first_fields) then
    return champion.fitness
  end
  -- the same robot in the same trials has the same score
  local before = run.history[#run.history]
  if before and before.champion.id == champion.id and before.population.trials == robots.trials
    and robots.scored_with == robots.before.scored_with then
    return before.best_standard
  end
  local again, simulations = generations.again(robots, { best }, world.first_materials)
  local score
  if again[best].status == "done" then
    score = scoring.call(robots.scored_by.call, again[best], state.copy(rawget(robots, "state")))
  end
  generations.free(simulations, "its robot had been scored under the first materials")
  return score
end

-- The front of the archive, else of the scored robots; nil without objectives.
local function front_of(world, robots)
  local measured, list = world.measured or {}, {}
  if not measured.objectives then return nil end
  if world.archive and world.archive.objectives then
    list = robots.remembered.rows
  else
    for k, index in ipairs(robots.ranked) do list[k] = robots.rows[index] end
  end
  local measure = front.measure(list, measured.objectives, measured.reference)
  if robots.generation == 0 and measure.hypervolume == 0 then
    local field = world.archive and world.archive.reference and "archive" or "survival"
    world.say(("%s.reference: no robot of generation 0 is better in every objective, so the"
      .. " hypervolume is 0: %s"):format(field, front.ranges(list, measured)))
  end
  return measure
end

-- The line of metrics.jsonl.
local function line_of(run, robots)
  local line, world = metrics.measure(robots), robots.world
  line.schema = "limax.metrics/1"
  line.repetition, line.generation = robots.repetition, robots.generation
  line.evaluations, line.parameters = robots.evaluations, robots.parameters
  line.materials = materials.fields(robots.materials)
  line.best_standard = standard_score(run, robots)
  line.supervisor_failed = robots.decided.failed or nil
  line.archive = robots.remembered and archived.measure(robots.remembered, world.archive)
  line.front = front_of(world, robots)
  return line
end

-- The values of a generation's materials as a material file holds them.
local function materials_table(world, fields)
  local made = world:materials_with(fields)
  local values = made:table()
  made:free()
  return values
end

-- Adds an entry to the history. Generations with the same materials share their table.
local function remember(run, line, ledger)
  local last = run.last_materials
  if not last or not materials.equal(last.fields, line.materials) then
    last = { fields = line.materials, values = materials_table(run.world, line.materials) }
    run.last_materials = last
  end
  return run.entries:add(run.history, line, ledger, last.values)
end

-- The counter of a robot that failed, by its status.
local COUNTER = { invalid = "invalid", diverged = "diverged", failed = "fitness" }

-- What the first rank needs of the others to record a generation.
local function gather(robots)
  local ranked, best = robots.ranked, {}
  local counted = division.counted(robots.rows)
  robots.diversity = diversity.measure(function(count)
    return division.diversity_of_best(robots, count, counted)
  end, ranked, robots.materials)
  local share = robots.share
  local own = { coarse = 0, failed = { invalid = 0, diverged = 0, fitness = 0 } }
  for k = 1, share.count do
    local row = robots.rows[share:number(k)]
    local name = COUNTER[row.status]
    if name then own.failed[name] = own.failed[name] + 1 end
    if rows.is_coarse(row) then own.coarse = own.coarse + 1 end
  end
  robots.coarse, robots.failed = 0, { invalid = 0, diverged = 0, fitness = 0 }
  for _, each in ipairs(exchange.all(own)) do
    robots.coarse = robots.coarse + each.coarse
    for name, count in pairs(each.failed) do robots.failed[name] = robots.failed[name] + count end
  end
  for k = 1, math.min(step_check.ROBOTS, #ranked) do best[k] = ranked[k] end
  division.fetch(robots, best, "best")
  generations.show(robots, best)
end

--- Records a scored generation: ends its traces, and the first rank adds it to the history.
function record.enter(run, robots)
  gather(robots)
  if exchange.is_first then
    step_check.look(run, robots)
    local line = line_of(run, robots)
    robots.entry = remember(run, line, robots.decided.ledger)
    robots.entry.population, robots.line = robots, line
  else
    robots.entry, robots.line = {}, true
  end
  run.evaluations = run.evaluations + robots.evaluations
  generations.end_traces(robots, "its population was bred")
end

-- Genomes of a generation, which are read from the run folder when they are needed.
local Stored = {}
Stored.__index = Stored

local function stored_in(folder) return setmetatable({ folder = folder }, Stored) end

-- All robots, in whole rows.
function Stored:rows_of(robots)
  if not self.rows then
    self.folder:settle() -- it may be about to be written
    self.rows = self.folder:rows(robots.repetition, robots.generation)
  end
  return self.rows
end

function Stored:engine_of(robots)
  local made = robots.world:empty()
  self.folder:settle() -- it may be about to be written
  local read = self.folder:genomes(robots.repetition, robots.generation, made.genes)
  for k = 0, made.count - 1 do engine_population.put_genomes(made, read(1), k, 1) end
  local rules = robots.world:rules(robots)
  rules.number = nil -- it has all robots
  genes.express(rules, made)
  return made
end

--- Writes a recorded generation into the folder, once. Collective.
function record.write(run, robots)
  local line = robots.line
  if not line then return end
  robots.line = nil
  if not run.folder and exchange.is_first then
    run.packed[line.generation] = rows_file.pack(robots.rows)
  else
    local began = host.clock()
    local files, problem = arrays.write(run, robots)
    if problem and not exchange.is_first then exchange.all(true) end -- rank 0 ends all
    if not exchange.is_first then return end
    run.folder:check(not problem, problem)
    if robots.world.is_divided then
      robots.stored = stored_in(run.folder)
      robots.rows.stored = function() return robots.stored:rows_of(robots) end
    end
    robots.timing.write = run.folder:write { robots = robots, metrics = line, arrays = files,
      began = began, evaluations = run.evaluations,
      matrix = line.generation == 0 and run.world:matrix() or nil }
  end
  if run.on_generation then run.on_generation(robots.entry, robots.timing) end
end

-- Makes a generation of plain data, with the genomes and bodies of a share if rank 0 reads genomes.
---@param has_genomes? boolean
---@param read? fun(count: integer): string of the next robots, on rank 0
local function rebuilt(run, kept, all, has_genomes, read)
  local world, share = run.world, division.share(all.count, 0)
  local own = has_genomes and world:empty_share(share)
  if own then
    division.deal(share, world.encoding.genes, read, function(memory, first, count)
      engine_population.put_genomes(own, memory, first, count)
    end)
  end
  local robots = generations.new(world, { share = share, own = own,
    generation = kept.generation, rows = all,
    materials = world:materials_with(kept.metrics.materials), parameters = kept.metrics.parameters,
    ranked = metrics.rank(all), evaluations = kept.metrics.evaluations,
    decided = { ledger = kept.ledger } })
  if own then genes.express(world:rules(robots), own) end
  return robots
end

local function read_rows(run, kept, bytes)
  local all, message = rows_file.read(bytes, run.world:material_names())
  local wanted = run.world.config.population
  if all and all.count == wanted then return all end
  message = message or ("holds %d robots; the run has %d"):format(all.count, wanted)
  failure.raise_damaged(("generation %d of repetition %d: its array of robots %s"):format(
    kept.generation, run.world.repetition, message))
end

--- Makes the entries of a run's history.
function record.entries(run)
  local repetition = run.world.repetition
  return history.entries(function(entry)
    local bytes = run.packed[entry.generation] or run.folder:robots(repetition, entry.generation)
    local robots = rebuilt(run, { generation = entry.generation, ledger = entry.ledger,
      metrics = { materials = materials.fields(engine.materials(entry.materials)),
        parameters = entry.parameters, evaluations = entry.evaluations } },
      read_rows(run, entry, bytes))
    robots.stored = run.folder and stored_in(run.folder) or nil
    return robots
  end)
end

-- Refuses a run whose robots were not measured as its archive and its survival need it now.
local function check_measured(run, robots)
  local measured = run.world.measured or {}
  for _, kind in ipairs { "descriptors", "objectives" } do
    local wanted, found = #(measured[kind] or {}), 0
    for _, row in ipairs(robots.rows) do
      if row.fitness then found = math.max(found, #(row[kind] or {})) end
    end
    if wanted ~= found then
      failure.raise(2, ("%s cannot be continued with another archive or survival: its robots have"
        .. " %d %s, and %d are needed"):format(run.folder and run.folder.path or "the run",
        found, kind, wanted))
    end
  end
end

-- The archive after the last generation of a folder, as plain data, and the genomes of its rows,
-- read as those of a generation.
local function read_archive(run, folder, last)
  local world, list, by_generation, genomes = run.world, nil, {}, {}
  for generation = 0, last do
    list = archived.replay(list, world.archive, generation,
      folder:rows(world.repetition, generation))
  end
  for k, row in ipairs(list.rows) do
    by_generation[row.generation] = by_generation[row.generation] or {}
    by_generation[row.generation][k] = row
  end
  for generation, some in pairs(by_generation) do
    local all = folder:rows(world.repetition, generation)
    local wanted = {}
    for _, row in pairs(some) do wanted[row.index] = true end
    local found = folder:genomes_of(world.repetition, generation, wanted,
      world.encoding.genes)
    for k, row in pairs(some) do
      archived.complete(row, rows.single(all[row.index]))
      genomes[k] = found[row.index]
    end
  end
  local last_read = 0
  return archived.pack(list), function(count)
    last_read = last_read + count
    return table.concat(genomes, "", last_read - count + 1, last_read)
  end
end

--- The last generation of a folder as plain data, for all ranks; nil if it has none. Fills the
--- history with those before it.
---@param run limax.run of the first rank
---@return table|nil
---@return { robots: function, archive: function|nil }|nil functions of how many are next that read
--- the genomes of all robots, and of the archive's
function record.kept(run)
  local folder, repetition = run.folder, run.world.repetition
  local last = folder and folder:last(repetition) or -1
  for generation = 0, last - 1 do
    local kept = folder:kept(repetition, generation)
    local entry = remember(run, kept.metrics, kept.ledger)
    if last - generation < history.genomes_kept and not run.world.is_divided then
      entry.population = rebuilt(run, kept, folder:rows(repetition, generation), true,
        folder:genomes(repetition, generation, run.world.encoding.genes))
    end
  end
  if last < 0 then return nil end
  local kept = folder:kept(repetition, last)
  kept.robots = folder:robots(repetition, last)
  local reads = { robots = folder:genomes(repetition, last, run.world.encoding.genes) }
  if run.world.archive then kept.archive, reads.archive = read_archive(run, folder, last) end
  return kept, reads
end

--- Goes on from the last generation of a folder: it has its scores. Where the configuration changed
--- since, elites are scored again.
---@param kept table of the first rank
---@param reads table|nil those of record.kept, on the first rank
function record.restore(run, kept, reads)
  reads = reads or {}
  local robots = rebuilt(run, kept, read_rows(run, kept, kept.robots), true, reads.robots)
  check_measured(run, robots)
  run.evaluations = kept.evaluations
  robots.outdated = not kept.scores_valid or nil
  robots.scored_with, robots.scored_by = run.world.fitness, run.world.fitness
  if run.world.archive then
    robots.remembered = archived.unpack(kept.archive, run.world:material_names(),
      run.world.encoding.genes, reads.archive)
    robots.archive = archived.shown(robots.remembered)
    if robots.outdated then
      run.world.say "the archive keeps scores and descriptors from before the change"
    end
  end
  -- an experiment that had no state before begins with its first one
  rawset(robots, "state", kept.state or run.world:first_state())
  robots.entry = exchange.is_first and remember(run, kept.metrics, kept.ledger) or {}
  if exchange.is_first then robots.entry.population = robots end
  if exchange.is_first and run.world.is_divided then robots.stored = stored_in(run.folder) end
  return robots
end

return record
