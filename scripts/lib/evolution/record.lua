--- record.lua: what a run keeps of each generation: an entry of its history and the files in its
--- folder; also reads them back, to continue a run.

local engine = require "limax.engine"
local exchange = require "limax.base.exchange"
local failure = require "limax.base.failure"
local front = require "limax.experiment.front"
local genes = require "limax.experiment.genes"
local history = require "limax.run.history"
local host = require "limax.host"
local materials = require "limax.evolution.materials"
local metrics = require "limax.run.metrics"
local npy = require "limax.base.npy"
local population = require "limax.evolution.population"
local run_files = require "limax.settings.run_files"
local scoring = require "limax.robot.scoring"
local source = require "limax.base.source"
local state = require "limax.run.state"

local record = {}

-- What scored a generation whose configuration has changed since: equal to no fitness.
local EARLIER = {}

--- Do the scores of a generation mean what they would mean now?
function record.scores_valid(robots) return robots.scored_with ~= EARLIER end

-- The champion's score under the run's first materials; nil where it does not end well under them.
local function standard_score(run, robots)
  local world, best = robots.world, robots.ranked[1]
  local champion = robots.records[best]
  if materials.equal(materials.fields(robots.materials), run.first_fields) then
    return champion.fitness
  end
  -- the score of a robot that was the champion before cannot have changed in the same trials
  local before = run.history[#run.history]
  if before and before.champion.id == champion.id and before.population.trials == robots.trials
    and robots.scored_with == robots.parents_scored_with then
    return before.best_standard
  end
  local mask = {}
  for i = 1, #robots do mask[i] = i == best end
  local again, simulations = population.simulate_again(robots, mask, world.first_materials)
  local score
  if again[best].status == "done" then
    score = scoring.call(robots.scored_by.call, again[best], state.copy(world.state))
  end
  population.free(simulations, "its robot had been scored under the first materials")
  return score
end

-- The population of an entry, with genomes if it has an engine's population.
local function rebuilt(run, entry, records, engine_population)
  return population.new(run.world, { engine = engine_population,
    materials = engine.materials(entry.materials), generation = entry.generation,
    repetition = entry.repetition, parameters = entry.parameters, ledger = entry.ledger,
    records = records, ranked = metrics.rank(records), evaluations = entry.evaluations })
end

-- Genomes and bodies of a generation that the folder holds.
local function read_engine(run, robots)
  local made = run:new_robots()
  made:set_genomes(run.folder:genomes_of(run.repetition, robots.generation))
  genes.express(run:rules_of_genes(robots), made)
  return made
end

-- An old generation, whose genomes and bodies are read when one of its robots needs them.
local function old_population(run, entry, records)
  local robots, made = rebuilt(run, entry, records), nil
  robots.on_disk = { __index = function(_, key)
    if key ~= "population" or not run.folder then return nil end
    made = made or read_engine(run, robots)
    return made
  end }
  return robots
end

-- The values of a generation's materials as a material file holds them.
local function materials_table(run, fields)
  local made = materials.with(run.first_materials, fields)
  local values = made:table()
  made:free()
  return values
end

--- What makes the entries of a run's history.
---@return limax.history.entries
function record.entries(run)
  return history.entries {
    on_disk = function() return run.folder ~= nil or not exchange.is_first end,
    metrics = function(generation) return run.folder.lines:metrics(run.repetition, generation) end,
    fields = function(generation)
      local fields = run.folder.lines:metrics(run.repetition, generation)
      fields.ledger = run.folder.lines:ledger(run.repetition, generation)
      fields.materials = materials_table(run, fields.materials)
      return fields
    end,
    records = function(generation)
      local packed = run.packed[generation]
      local text = packed and host.rows.lines(packed)
        or run.folder:lines_of(run.repetition, generation)
      return run_files.robots(text, "generation " .. generation)
    end,
    build = function(entry, records) return old_population(run, entry, records) end,
  }
end

-- Adds an entry to the history. Generations with the same materials share their table.
local function remember(run, line, ledger)
  local last = run.last_materials
  if not last or not materials.equal(last.fields, line.materials) then
    last = { fields = line.materials, values = materials_table(run, line.materials) }
    run.last_materials = last
  end
  return run.entries:add(run.history, line, ledger, last.values)
end

-- The front of the archive, else of the scored robots; nil without objectives.
local function front_of(world, robots)
  local measured, list = world.measured or {}, {}
  if not measured.objectives then return nil end
  if world.archive and world.archive.definition.objectives then
    list = world.archive.rows
  else
    for k, index in ipairs(robots.ranked) do list[k] = robots.records[index] end
  end
  return front.measure(list, measured.objectives, measured.reference)
end

--- Adds a scored generation to the history, which its supervisor reads. Its traces end.
---@return table line of metrics.jsonl
function record.enter(run, robots)
  local line = metrics.measure(robots)
  line.schema = "limax.metrics/1"
  line.repetition, line.generation = robots.repetition, robots.generation
  line.evaluations, line.parameters = robots.evaluations, robots.parameters
  line.materials = materials.fields(robots.materials)
  line.best_standard = standard_score(run, robots)
  line.supervisor_failed = robots.supervisor_failed
  local archive = run.world.archive
  line.archive = archive and archive:measure()
  line.front = front_of(run.world, robots)
  remember(run, line, robots.ledger).population = robots
  run.evaluations = run.evaluations + line.evaluations
  population.end_traces(robots, "its population was bred")
  return line
end

-- Writes B, without which genomes of the encoding "fourier" cannot be read by other programs.
local function write_matrix(run)
  if run.encoding.network ~= "fourier" then return end
  local name, numbers = ("r%02d/B.npy"):format(run.repetition), {}
  local rows = run.encoding:matrix():table()
  for k, row in ipairs(rows) do
    for axis = 1, 3 do numbers[3 * (k - 1) + axis] = row[axis] end
  end
  run.folder:make_folder(source.folder_of(name))
  run.folder:write_later(name, npy.encode("<f8", { #rows, 3 }, numbers))
end

--- Writes the newest generation of the history into the folder.
---@param line table as from `enter`
function record.write(run, robots, line)
  if not exchange.is_first then return end
  local archive, packed = run.world.archive, robots.columns:pack()
  if not run.folder then
    run.packed[line.generation] = packed
  else
    if line.generation == 0 then write_matrix(run) end
    robots.timing.write = run.folder:write_generation { metrics = line, ledger = robots.ledger,
      seconds = robots.timing, supervision = robots.supervision, robots = packed,
      state = robots.state_text, archive = archive and archive:text(), engine = robots.engine,
      champion = robots[robots.ranked[1]]:table() }
  end
  if run.on_generation then run.on_generation(run.history[#run.history], robots.timing) end
end

-- The newest populations of a run that is restored have their genomes.
local function restore_genomes(run, folder, entry, scores_valid)
  local records = run_files.robots(folder:lines_of(run.repetition, entry.generation),
    "generation " .. entry.generation)
  local robots = rebuilt(run, entry, records, run:new_robots())
  robots.engine:set_genomes(folder:genomes_of(run.repetition, entry.generation))
  genes.express(run:rules_of_genes(robots), robots.engine)
  if not scores_valid then robots.scored_with = EARLIER end
  entry.population, run.upcoming = robots, robots
end

-- Refuses a run whose robots were not measured as its archive and its survival need it now.
local function check_measured(run)
  local measured, robots = run.world.measured or {}, run.upcoming
  for _, kind in ipairs { "descriptors", "objectives" } do
    local wanted, values = #(measured[kind] or {}), nil
    for _, each in ipairs(robots.records) do values = each.fitness and each[kind] or values end
    if wanted ~= #(values or {}) then
      failure.raise(2, ("%s cannot be continued with another archive or survival: its robots have"
        .. " %d %s, and %d are needed"):format(run.folder and run.folder.path or "the run",
        #(values or {}), kind, wanted))
    end
  end
end

--- Reads the generations of a folder into a run's history; the next generation of the loop is then
--- the last one there, with its scores.
--- Where the configuration changed since, elites are scored again. Ranks without the folder get the
--- newest generations from the first one.
---@param folder limax.run_folder|nil
function record.read(run, folder)
  run.folder = folder
  local repetition, own_lines = run.repetition, (folder or {}).lines
  local lines = exchange.object(own_lines)
  folder = exchange.object(folder)
  local last, scores_valid = lines:last(repetition), folder:scores_valid(repetition)
  run.evaluations = lines:evaluations(repetition)
  for generation = 0, last do
    if last - generation < history.genomes_kept then
      restore_genomes(run, folder, remember(run, lines:metrics(repetition, generation),
        lines:ledger(repetition, generation)), scores_valid)
    elseif history.is_old(generation, last) or not own_lines then
      run.entries:add_unread(run.history)
    else
      remember(run, own_lines:metrics(repetition, generation),
        own_lines:ledger(repetition, generation))
    end
  end
  if run.upcoming then check_measured(run) end
  if run.upcoming and run.world.archive then
    run.world.archive:restore(folder, run.upcoming.generation, run.encoding.genes)
    run.upcoming.archive = run.world.archive:list()
    if not scores_valid then
      run:say "the archive keeps scores and descriptors from before the change"
    end
  end
  local before = run.upcoming and run.world.state
    and folder:text("state", run.repetition, run.upcoming.generation)
  if before then run.world.state = state.decode(before) end
end

return record
