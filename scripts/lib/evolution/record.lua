--- record.lua: what a run keeps of each generation: an entry of its history and the files in its
--- folder; also reads them back, to continue a run.

local genes = require "limax.experiment.genes"
local history = require "limax.run.history"
local materials = require "limax.evolution.materials"
local metrics = require "limax.run.metrics"
local population = require "limax.evolution.population"
local run_files = require "limax.settings.run_files"
local scoring = require "limax.robot.scoring"
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
  -- the score of a robot that was the champion before cannot have changed
  local before = run.history[#run.history]
  if before and before.champion.id == champion.id
    and robots.scored_with == robots.parents_scored_with then
    return before.best_standard
  end
  local mask = {}
  for i = 1, #robots do mask[i] = i == best end
  local again, simulation =
    population.simulate_again(robots, mask, world.first_materials, world.options)
  local score
  if again[best].status == "done" then
    score = scoring.call(robots.fitness.call, again[best], state.copy(world.state))
  end
  simulation:free "its robot had been scored under the first materials"
  return score
end

-- An old generation from the text of its population file, with genomes if it has an engine's
-- population.
local function rebuilt(run, line, ledger, records, engine_population)
  return population.new(run.world, { engine = engine_population,
    materials = materials.with(run.first_materials, line.materials), generation = line.generation,
    repetition = line.repetition, parameters = line.parameters, ledger = ledger, records = records,
    ranked = metrics.rank(records), evaluations = line.evaluations })
end

-- Reads the text of a population file again.
local function reader(folder, line)
  return function() return folder:population_text(line.repetition, line.generation) end
end

-- Adds an entry to the history. `text` gives the text of its population file.
local function remember(run, line, ledger, text, robots)
  local before = run.history[#run.history]
  local same = before and materials.equal(run.last_fields, line.materials)
  run.last_fields = line.materials
  local entry = history.entry { metrics = line, ledger = ledger, text = text, population = robots,
    materials = same and before.materials
      or materials.with(run.first_materials, line.materials):table(),
    build = function(records) return rebuilt(run, line, ledger, records) end }
  run.history[#run.history + 1] = entry
  run.evaluations = run.evaluations + line.evaluations
  history.forget(run.history)
  return entry
end

--- Writes a scored generation into history and folder.
function record.write(run, robots)
  local line = metrics.measure(robots)
  line.schema = "limax.metrics/1"
  line.repetition, line.generation = robots.repetition, robots.generation
  line.evaluations, line.parameters = robots.evaluations, robots.parameters
  line.materials = materials.fields(robots.materials)
  line.best_standard = standard_score(run, robots)
  line.supervisor_failed = robots.supervisor_failed
  local archive = run.world.archive
  line.archive = archive and archive:measure()
  local text = history.encode(robots.records)
  local kept = run.world.state and state.encode(run.world.state)
  local entry = remember(run, line, robots.ledger,
    run.folder and reader(run.folder, line) or function() return text end, robots)
  if run.folder then
    robots.timing.write = run.folder:write_generation { metrics = line, ledger = robots.ledger,
      seconds = robots.timing, supervision = robots.supervision, text = text,
      state = kept, archive = archive and archive:text(), engine = robots.engine,
      champion = robots[robots.ranked[1]]:table() }
  end
  run.world.state = kept and state.decode(kept)
  population.end_traces(robots, "its population was bred")
  if run.on_generation then run.on_generation(entry, robots.timing) end
end

--- Reads the generations of a folder into a run's history; the next generation of the loop is then
--- the last one there, with its scores.
--- Where the configuration changed since, elites are scored again.
function record.read(run, folder)
  local scores_valid = folder:scores_valid(run.repetition)
  for _, kept in ipairs(folder:generations(run.repetition, history.genomes_kept)) do
    local line, robots = kept.metrics, nil
    local text = reader(folder, line)
    if kept.genomes then
      robots = rebuilt(run, line, kept.ledger,
        run_files.robots(text(), "generation " .. line.generation), run:new_robots())
      robots.engine:set_genomes(kept.genomes)
      genes.express(run:rules_of_genes(robots), robots.engine)
      if not scores_valid then robots.scored_with = EARLIER end
    end
    remember(run, line, kept.ledger, text, robots)
    run.upcoming = robots
  end
  if run.upcoming and run.world.archive then
    run.world.archive:restore(folder, run.upcoming.generation, run.encoding.genes)
  end
  local before = run.upcoming and run.world.state
    and folder:state_text(run.repetition, run.upcoming.generation)
  if before then run.world.state = state.decode(before) end
end

return record
