--- run.lua: `limax run FILE`: runs an experiment to its end, keeps every generation in a run
--- folder, and goes on where an earlier run stopped.

local budget = require "limax.experiment.budget"
local engine = require "limax.engine"
local evolve = require "limax.evolution.evolve"
local experiments = require "limax.experiment.experiment"
local failure = require "limax.base.failure"
local history = require "limax.run.history"
local host = require "limax.host"
local passes = require "limax.tools.console.passes"
local progress = require "limax.tools.console.progress"
local resume = require "limax.run.resume"
local run_configuration = require "limax.run.run_configuration"
local run_folder = require "limax.run.run_folder"
local script = require "limax.base.script"
local tally = require "limax.tools.console.tally"
local tiers = require "limax.settings.tiers"
local together = require "limax.evolution.together"

local command = {
  summary = "run an experiment, or continue one",
  usage = "limax run FILE [options]\n       limax run --resume DIR [options]",
  positional = { least = 0, most = 1, name = "FILE" },
  options = {
    { name = "set", argument = "PATH=VALUE", many = true,
      text = "change a field of the experiment: population=50, scene.actuation.frequency=3" },
    { name = "accuracy", argument = "TIER", choices = tiers.NAMES,
      text = "preview, evolve, publish or reference, in the place of what the script says" },
    { name = "out", argument = "DIR", text = "the new run folder; runs/NAME-N if left out" },
    { name = "device", argument = "NAME", choices = { "auto", "cpu", "cuda" },
      text = "auto, cpu or cuda" },
    { name = "threads", argument = "N", kind = "integer", minimum = 1, maximum = 1024,
      text = "CPU threads; LIMAX_THREADS, else one per core" },
    { name = "repetition", argument = "R", kind = "integer", minimum = 1,
      text = "compute this repetition alone, with the same bytes" },
    { name = "together",
      text = "several repetitions at a time, with the same bytes; what a GPU does anyway" },
    { name = "apart", text = "one repetition after the other, on a GPU too" },
    { name = "live-prompts",
      text = "with a language model: read its prompts again before each generation" },
    { name = "resume", argument = "DIR", text = "continue the run in this folder" },
    { name = "changed", text = "with --resume: go on although script or configuration differ" },
    { name = "quiet", short = "q", text = "no progress, nothing at the end; warnings stay" },
  },
}

--- Is this value an experiment?
command.is_experiment = experiments.is

-- Calls what can refuse for a reason that the user should read without a trace.
local function or_refuse(status, call, ...)
  local ok, value = failure.attempt(call, ...)
  if ok then return value end
  local broken = failure.of_machine(value)
  if broken == "device" or broken == "defect" then status = 1 end
  failure.raise(failure.status(value) or status, failure.bare(value))
end

-- The experiment that a script returns.
local function load_experiment(path)
  local value = script.run(path)
  if experiments.is(value) then return value end
  failure.raise(2, ("%s returns no experiment: it should end in `return limax.experiment"
    .. " { ... }`; a script that runs by itself is started by: limax %s"):format(path, path))
end

-- Which repetitions to compute, first and last.
local function span(config, alone)
  if not alone then return 1, config.repetitions end
  if alone > config.repetitions then
    failure.raise(2, ("--repetition %d: the experiment has %d"):format(alone, config.repetitions))
  end
  return alone, alone
end

local function announce(session, experiment, device)
  if session.quiet then return end
  local config = experiment.config
  local first, last = session.first, session.last
  local which = "repetition " .. first
  if first ~= last then which = ("repetitions %d to %d"):format(first, last) end
  if session.together then which = which .. " together" end
  local where = device.kind
  if device.threads then where = ("%s (%d threads)"):format(where, device.threads) end
  io.stderr:write(("%s: %s, %d generations of %d robots, on %s; folder %s\n"):format(config.name,
    which, config.generations, config.population, where, session.folder.path))
  local tier = tiers.of(config.simulation)
  if tier then
    local measured = tiers.measured(device)
    io.stderr:write(("accuracy %s: %s; %s\n"):format(tier, tiers.describe(tier),
      tiers.price(measured and measured[tier])))
  end
end

-- What the words of the command change: a tier first, so that --set has the last word.
local function changes_of(arguments)
  local changes = arguments.accuracy and tiers.overrides(arguments.accuracy) or {}
  for _, text in ipairs(arguments.set or {}) do changes[#changes + 1] = text end
  return changes
end

-- Takes a folder as the run's own. From here on even a hard stop says how to go on.
local function hold(session, folder)
  session.folder = folder
  host.signal.on_hard_stop("continue with: " .. folder:resume_command())
  return folder
end

-- Opens a run folder and brings it to its last whole generation.
local function reopen(session, arguments)
  session.path = arguments.resume
  local folder = hold(session, run_folder.open(arguments.resume))
  local path, note = resume.script(folder)
  local changes = {}
  for _, text in ipairs(folder.config.run.overrides) do changes[#changes + 1] = text end
  for _, text in ipairs(changes_of(arguments)) do changes[#changes + 1] = text end
  local experiment = load_experiment(path):override(changes)
  local alone = folder.config.run.repetition
  if arguments.repetition and arguments.repetition ~= alone then
    failure.raise(2, ("--repetition %d: %s computes %s"):format(arguments.repetition, folder.path,
      alone and "repetition " .. alone or "all repetitions"))
  end
  local config, scripts =
    run_configuration.of(experiment, { repetition = alone, overrides = changes })
  local verdict = resume.judge(folder, config, scripts, arguments.changed)
  folder:continue(config, scripts, verdict.changed)
  session.notes[#session.notes + 1] = note
  if verdict.changed then
    session.notes[#session.notes + 1] = "continuing with what has changed:\n" .. verdict.text
  end
  session.scores_stand = verdict.scores_stand
  session.alone = alone
  return experiment
end

-- Whether a repetition has its last generation.
local function is_whole(session, config, repetition)
  local done = session.done_generations[repetition]
  return done ~= nil and not budget.allows_another(config, done.count, done.evaluations)
end

-- Generations that are on disk and their evaluations, by repetition.
local function done_generations(folder)
  local done = {}
  for _, line in ipairs(folder:lines "metrics") do
    local sofar = done[line.repetition] or { evaluations = 0 }
    done[line.repetition] = { count = line.generation + 1,
      evaluations = sofar.evaluations + line.evaluations }
  end
  return done
end

-- Gives the turn to the first repetition that is not whole: its lines are the next ones.
local function pass_turn(session, config)
  for repetition = session.first, session.last do
    session.folder:take_turn(repetition)
    if not is_whole(session, config, repetition) then return end
  end
end

-- A repetition that stands where its last whole generation left it.
local function begin(session, experiment, run_options, repetition)
  local run = session.first_run
  session.first_run = nil
  if not run or run.repetition ~= repetition then
    run_options.repetition = repetition
    run = evolve.start(experiment, run_options)
  end
  run.folder = session.folder
  run:restore(session.folder, session.scores_stand)
  return run
end

-- Runs the repetitions that are left.
local function compute(session, experiment, run_options)
  local config, folder = experiment.config, session.folder
  for repetition = session.first, session.last do
    for _, generation in ipairs(folder:generations(repetition, 0)) do
      session.tally:add(repetition, history.decode(generation.text, "population"))
    end
  end
  local function ended(repetition)
    session.done_generations[repetition] = { count = config.generations, evaluations = 0 }
    pass_turn(session, config)
  end
  pass_turn(session, config)
  if session.together then
    together.run { repetitions = session.left,
      at_once = together.at_once(run_options.device, config.population), ended = ended,
      begin = function(repetition) return begin(session, experiment, run_options, repetition) end,
      on_progress = run_options.on_progress }
    return
  end
  for _, repetition in ipairs(session.left) do
    begin(session, experiment, run_options, repetition):finish()
    ended(repetition)
  end
end

local function show_end(session, device)
  session.progress:finish()
  session.folder:status "done"
  session.done = true
  local terminal = host.terminal()
  -- quiet or not, it draws the champion
  require("limax.tools.console.summary").show(session.folder.path, { width = terminal.columns, device = device,
    color = terminal.stdout and terminal.color,
    write = session.quiet and function() end or function(text) io.stdout:write(text) end })
  if session.quiet then return end
  io.stdout:write("\n", session.tally:text(), "Run folder: ", session.folder.path, "\n")
end

local function execute(session, experiment, arguments)
  if arguments.together and arguments.apart then
    failure.raise(2, "--together and --apart exclude each other")
  end
  if arguments.resume then
    experiment = reopen(session, arguments)
  else
    experiment = experiment:override(changes_of(arguments))
    session.alone = arguments.repetition
  end
  if arguments.live_prompts and experiment.supervisor.name ~= "llm" then
    failure.raise(2, ('--live-prompts: the supervisor %q reads no prompts; "llm" does')
      :format(experiment.supervisor.name))
  end
  session.first, session.last = span(experiment.config, session.alone)
  local device = or_refuse(1, engine.device, arguments.device or "auto",
    { threads = arguments.threads })

  session.done_generations = session.folder and done_generations(session.folder) or {}
  session.left = {}
  for repetition = session.first, session.last do
    if not is_whole(session, experiment.config, repetition) then
      table.insert(session.left, repetition)
    end
  end
  session.together = #session.left > 1 and not arguments.apart
    and (arguments.together or device.kind == "cuda")

  local slower = passes.warning(device:describe())
  if slower then session.notes[#session.notes + 1] = "CPU passes: " .. slower end
  local total = budget.most_generations(experiment.config) * (session.last - session.first + 1)
  local before = session.folder and #session.folder:lines "metrics" or 0
  session.progress = progress.new { total = total, done = before, quiet = session.quiet,
    repetitions = experiment.config.repetitions }
  local run_options = { repetition = session.left[1] or session.first, device = device,
    wait = session.together and together.wait or nil,
    say = function(text)
      session.tally:hear(text)
      session.progress:say(text)
    end,
    on_progress = function(state) session.progress:robots(state) end,
    live_prompts = arguments.live_prompts,
    on_generation = function(entry, seconds)
      session.tally:add(entry.repetition, entry.population.records)
      session.progress:generation(entry, seconds)
    end }
  -- everything that the engine may refuse is tried before a folder is made
  session.first_run = or_refuse(2, evolve.start, experiment, run_options)
  if not session.folder then
    -- held before it is a run: Ctrl-C finds either none, or one that it can name
    hold(session,
      run_folder.take(arguments.out or run_folder.next_free(experiment.config.name)))
    session.folder:begin(experiment,
      { repetition = session.alone, overrides = changes_of(arguments) })
  end
  session.folder:status "running"
  session.folder:write_environment(device)
  announce(session, experiment, device)
  for _, note in ipairs(session.notes) do session.progress:say(note) end
  compute(session, experiment, run_options)
  show_end(session, device)
  return 0
end

-- What remains to be said when a run did not come to its end. Nothing on disk is lost.
local function aftermath(session, value, trace)
  if session.progress then session.progress:finish() end
  local interrupted = value == host.interrupt
  local path = session.folder and session.folder.path or session.path
  -- what has no configuration yet is no run
  local folder = session.folder and run_folder.is_run(path) and session.folder
  -- every generation is there: what went wrong then is the look at them
  if folder and session.progress and not session.done then
    local message = not interrupted and tostring(value) or nil
    failure.attempt(folder.status, folder, interrupted and "interrupted" or "failed", message)
  end
  if interrupted then
    if not path or not run_folder.is_run(path) then
      if session.folder then session.folder:abandon() end
      io.stderr:write "interrupted; no run was begun\n"
      return 130
    end
    io.stderr:write(session.done and "interrupted; every generation is done\n"
      or "interrupted; the unfinished generation is dropped\n", "continue with: ",
      run_folder.resume_command(path), "\n")
    return 130
  end
  local mend
  if folder and host.file.exists(path .. "/checkpoint") then
    -- mending changes the script, which a resume refuses unless it is told
    mend = "when it is mended, continue with: " .. folder:resume_command() .. " --changed"
  end
  local status = failure.status(value)
  if status == 1 and mend and session.progress and not failure.of_machine(value) then
    failure.raise(1, value .. "\n" .. mend)
  end
  if status then error(value, 0) end
  if failure.of_machine(value) then
    -- nothing is wrong with the script: it goes on as it is
    io.stderr:write("limax: ", failure.bare(value), "\n")
    if folder then io.stderr:write("continue with: ", folder:resume_command(), "\n") end
    return 1
  end
  io.stderr:write("limax: ", failure.first_trace(value) or trace, "\n")
  if mend then io.stderr:write(mend, "\n") end
  return 1
end

--- Runs an experiment to its end, or continues the folder that `arguments.resume` names.
---@param experiment limax.experiment|nil nil with `arguments.resume`
---@param arguments table options of `limax run` by name
---@return integer status 0; 130 after Ctrl-C; 1 or 2 after a failure
function command.run_experiment(experiment, arguments)
  local session = { quiet = arguments.quiet, tally = tally.new(), notes = {} }
  local ok, value, trace = host.protect(execute, session, experiment, arguments)
  local status = value
  if not ok then ok, status = pcall(aftermath, session, value, trace) end
  host.signal.on_hard_stop(nil)
  if session.folder then session.folder:close() end
  if not ok then error(status, 0) end
  return status
end

---@param arguments table
---@return integer status
function command.run(arguments)
  local file = arguments[1]
  if arguments.resume then
    local extra = arguments.out and "--out" or file
    if extra then
      failure.raise(2, "--resume knows its folder and its script: leave out " .. extra)
    end
    return command.run_experiment(nil, arguments)
  end
  if arguments.changed then failure.raise(2, "--changed belongs to --resume") end
  if not file then failure.raise(2, "limax run: expected a FILE, or --resume DIR") end
  return command.run_experiment(load_experiment(file), arguments)
end

return command
