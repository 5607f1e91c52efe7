--- runs.lua: run folders as `limax report`, `watch`, `list` and `compare` read them: whole lines of
--- their files, in whatever state the run is. Nothing is locked and nothing is written, so a run in
--- progress is not disturbed.

local arms = require "limax.tools.report.arms"
local changes = require "limax.run.changes"
local check = require "limax.run.check"
local choice = require "limax.base.choice"
local failure = require "limax.base.failure"
local files = require "limax.run.files"
local fitness = require "limax.fitness"
local reader = require "limax.run.reader"
local robot_file = require "limax.robot.robot_file"
local schema = require "limax.engine.schema"
local source = require "limax.base.source"
local study_file = require "limax.run.study_file"
local supervision = require "limax.supervise.supervision"
local terminal = require "limax.base.terminal"

local runs = {}

---@class limax.report.run one repetition of a run folder
---@field path string of its folder
---@field folder limax.run.reader
---@field name string of the experiment
---@field seed string
---@field repetition integer
---@field config table
---@field state "running"|"done"|"stopped"|"failed"
---@field lines table[] metrics, generation by generation
---@field ledger table[] likewise
---@field timing table[] likewise
---@field evaluations integer so far, `before` included
---@field before integer evaluations that a study spent on tuning
---@field arm string|nil its name in a study
---@field changes limax.run.change[] of what its scores mean
---@field donor string|nil whose parameters it repeats: "parameters of random"

---@class limax.report.folder
---@field path string
---@field config table
---@field state "running"|"done"|"stopped"|"failed"
---@field message string|nil why it failed
---@field sessions table[] the processes that wrote it: lines `begin` of its journal
---@field reader limax.run.reader
---@field runs limax.report.run[] those that have a generation

-- The supervisor whose parameters a run repeats, as its ledger names it.
local function donor_of(ledger)
  local line = ledger and ledger[2] or {}
  local donor = arms.REPEATS[line.supervisor]
    and (line.reason or ""):match "repetition %d+ of .+ %(([%w_]+)%)"
  return donor and "parameters of " .. donor or nil
end

--- Is this path a run folder?
runs.is_folder = reader.is_run

--- A run folder as it is now. Ends the command where a file is damaged.
function runs.read(path)
  local read = reader.read(path)
  if read.is_edited then failure.raise_damaged(read:edited_text()) end
  if read.journal.damage[1] then
    failure.raise_damaged(("%s is damaged:\n%s"):format(terminal.word(path),
      check.text(read.journal.damage)))
  end
  local config, state, message = read.config, read.journal:state()
  config.name = terminal.word(config.name)
  local folder = { path = read.path, config = config, runs = {}, state = state, message = message,
    sessions = read.journal.begins, reader = read }
  for _, repetition in ipairs(read:repetitions()) do
    local ledger = read:lines("ledger", repetition)
    table.insert(folder.runs, { path = read.path, folder = read, name = config.name,
      config = config, seed = tostring(config.seed), repetition = repetition, state = state,
      lines = read:lines("metrics", repetition), ledger = ledger,
      timing = read:lines("timing", repetition), evaluations = read:evaluations(repetition),
      before = 0, donor = donor_of(ledger), changes = changes.of(read, repetition) })
  end
  return folder
end

-- Adds the runs of a study that have begun, with their entries in the study. With `whole` all must
-- be done.
local function add_study(list, word, whole, say)
  local study, missing = study_file.read(word), 0
  for _, entry in ipairs(study.runs) do
    say(word .. "/" .. entry.path)
    local begun = runs.is_folder(word .. "/" .. entry.path)
    local folder = begun and runs.read(word .. "/" .. entry.path)
    if not begun or folder.state ~= "done" then missing = missing + 1 end
    for _, run in ipairs(begun and folder.runs or {}) do
      run.arm, run.before = entry.arm, entry.tuning_evaluations or 0
      run.donor = entry.donor or run.donor
      run.evaluations = run.evaluations + run.before
    end
    list[#list + 1] = folder or nil
  end
  if whole and missing > 0 then
    failure.raise(2, ("%s: %d of its %d runs are not done; start the study again in this folder"
      .. " to continue it"):format(word, missing, #study.runs))
  end
end

--- The run folders that these words name; a study names its runs.
---@param whole? boolean true: all runs of a study must be done; else those are read that have begun
---@param on_progress? fun(text: string) called before each is read
function runs.read_all(words, whole, on_progress)
  local list = {}
  local function say(path) if on_progress then on_progress("reading " .. path) end end
  for _, word in ipairs(words) do
    word = #word > 1 and word:gsub("/+$", "") or word
    if study_file.exists(word) then
      add_study(list, word, whole, say)
    else
      say(word)
      list[#list + 1] = runs.read(word)
    end
  end
  return list
end

--- Every repetition of these folders or arms.
function runs.of(list)
  local all = {}
  for _, each in ipairs(list) do
    for _, run in ipairs(each.runs) do all[#all + 1] = run end
  end
  return all
end

--- The same for a comparison: all folders must be done.
function runs.finished(folders)
  for _, folder in ipairs(folders) do
    if folder.state ~= "done" then
      failure.raise(2, ("%s is not done (%s); only complete runs are compared"):format(folder.path,
        folder.state))
    end
  end
  return runs.of(folders)
end

--- Runs as arms, as `limax compare` groups them; where it would refuse, each folder is an arm,
--- except in a study, which names its arms, and the second result is the reason.
function runs.arms(folders)
  local all = runs.of(folders)
  if #all == 0 then return {} end
  local fine, groups = failure.attempt(arms.group, all)
  if fine then
    for _, arm in ipairs(groups) do arm.name = terminal.word(arm.name) end
    return groups
  end
  local list, of_study = {}, {}
  for _, folder in ipairs(folders) do
    local first = folder.runs[1]
    local arm = first and of_study[first.arm]
    if first and not arm then
      arm = { name = terminal.word(first.arm or source.name_of(folder.path)), runs = {} }
      list[#list + 1] = arm
      if first.arm then of_study[first.arm] = arm end
    end
    for _, run in ipairs(folder.runs) do table.insert(arm.runs, run) end
  end
  return list, failure.bare(groups)
end

--- Each text once, in the order in which they first come.
function runs.distinct(texts)
  local list, seen = {}, {}
  for _, text in ipairs(texts) do
    if not seen[text] then
      seen[text] = true
      list[#list + 1] = text
    end
  end
  return list
end

--- The generations that a run folder has, and those of a whole run.
function runs.generations(folder)
  local config, done = folder.config, 0
  for _, run in ipairs(folder.runs) do done = done + #run.lines end
  return done, config.generations * (config.run.repetition and 1 or config.repetitions)
end

--- The champion's score, under the first materials where that is recorded.
function runs.score(line) return line.best_standard or line.best end

--- The lines since the last change of what a score means: only these can be compared.
function runs.comparable(run)
  local first, list = 0, {}
  for _, change in ipairs(run.changes or {}) do
    if change.generation < #run.lines then first = change.generation end
  end
  for k = first + 1, #run.lines do list[#list + 1] = run.lines[k] end
  return list
end

--- The changes of what the scores of these runs mean, one text for each run that has any.
---@param title_of fun(run: limax.report.run): string|nil
function runs.changed(list, title_of)
  local texts = {}
  for _, run in ipairs(list) do
    if run.changes and run.changes[1] then
      local title = title_of and title_of(run)
      texts[#texts + 1] = (title and title .. ": " or "") .. changes.text(run.changes)
    end
  end
  return runs.distinct(texts)
end

--- The generation whose champion is the result of a run: the last one, or, as only the survival
--- "elitist" keeps the best robot to the end, the last of those with the best score.
---@return table line of metrics
function runs.result(run)
  local found = run.lines[#run.lines]
  for _, line in ipairs(run.config.survival and runs.comparable(run) or {}) do
    if (runs.score(line) or -math.huge) > (runs.score(found) or -math.huge) then found = line end
  end
  return found
end

--- The repetition with the best result.
function runs.leading(list)
  local found = list[1]
  for _, run in ipairs(list) do
    local score, best = runs.score(runs.result(run)), runs.score(runs.result(found))
    if score and (not best or score > best) then found = run end
  end
  return found
end

--- An arm's name, and of several runs what distinguishes this one: "rules, seed 2".
function runs.title(arm, run)
  local text, seeds, repetitions = arm.name, false, false
  for _, other in ipairs(arm.runs) do
    seeds = seeds or other.seed ~= run.seed
    repetitions = repetitions or other.repetition ~= run.repetition
  end
  if seeds then text = ("%s, seed %s"):format(text, run.seed) end
  return repetitions and ("%s, repetition %d"):format(text, run.repetition) or text
end

--- A number that the fitness returned beside the champion's score; nil if it has none.
function runs.measure(line, name)
  local measure = (line.measures or {})[name]
  return measure and measure.champion
end

--- The score of a generation's champion with its unit, and what else the fitness returned.
---@return string "height 0.277 m"
function runs.score_text(run, line)
  local stored = run.config.fitness
  local unit = runs.fitness_words(stored)
  local name = type(stored) == "table" and stored.name or stored
  local parts, score = {}, runs.score(line)
  parts[1] = ("%s %s%s"):format(unit and name or "fitness", score and ("%.3g"):format(score) or "-",
    unit and unit ~= "1" and " " .. unit or "")
  for _, measure in ipairs(choice.sorted_keys(line.measures or {})) do
    local value = runs.measure(line, measure)
    parts[#parts + 1] = value and ("%s %.3g"):format(measure, value) or nil
  end
  return table.concat(parts, ", ")
end

--- A note about failed supervisors of these runs; nil if none failed.
---@return string|nil
---@return boolean all did they fail in every generation?
function runs.supervisor_failures(list)
  local failed, asked = 0, 0
  for _, run in ipairs(list) do
    local its, all = supervision.failures(run.lines,
      function(k) return (run.ledger[k] or {}).source end)
    failed, asked = failed + its, asked + all
  end
  return supervision.failure_text(failed, asked), failed > 0 and failed == asked
end

--- The robot file of a generation's champion.
function runs.champion(run, line)
  run.folder:file("champion", run.repetition, line.generation)
  return run.path .. "/" .. files.place("champion", run.repetition, line.generation)
end

--- The champion of a generation as its robot file describes it.
function runs.description(run, line)
  local path = runs.champion(run, line)
  return failure.about(path, robot_file.read, path)
end

--- Unit and description of the fitness of a configuration. A function of a script has no unit.
---@param stored any `fitness` of config.json
function runs.fitness_words(stored)
  local options = type(stored) == "table" and stored or {}
  local name = options.name or stored
  local entry = type(name) == "string" and fitness.entries[name]
  if not entry then return nil, "a function of the script" end
  -- "m/s; with body_lengths = true, body lengths per second"
  local unit, condition, other = entry.unit:match "^(.-); with ([%w_]+) = true, (.*)$"
  unit = condition and options[condition] and other or unit or entry.unit
  local chosen = {}
  for _, option in ipairs(schema.names(options, "fitness") or {}) do
    if option ~= "name" then
      chosen[#chosen + 1] = ("%s = %s"):format(option, tostring(options[option]))
    end
  end
  local which = #chosen > 0 and (" (%s)"):format(table.concat(chosen, ", ")) or ""
  local formula = entry.formula
  if options.axis then formula = formula:gsub("|([^|]+)|", "(%1) along " .. options.axis) end
  return unit, ("%s%s, %s: %s"):format(name, which, unit == "1" and "no unit" or unit, formula)
end

return runs
