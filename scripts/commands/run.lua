--- run.lua: `limax run FILE`: runs an experiment to its end, keeps every generation in a run
--- folder, and continues an earlier run.

local budget = require "limax.experiment.budget"
local defaults = require "limax.settings.defaults"
local engine = require "limax.engine"
local evolve = require "limax.evolution.evolve"
local exchange = require "limax.base.exchange"
local experiments = require "limax.experiment.experiment"
local failure = require "limax.base.failure"
local host = require "limax.host"
local output = require "limax.base.output"
local passes = require "limax.tools.console.passes"
local progress = require "limax.tools.console.progress"
local rank_share = require "limax.tools.study.rank_share"
local reader = require "limax.run.reader"
local resume = require "limax.run.resume"
local run_folder = require "limax.run.folder"
local script = require "limax.base.script"
local scripts = require "limax.run.scripts"
local shell = require "limax.base.shell"
local tally = require "limax.tools.console.tally"
local terminal = require "limax.base.terminal"
local tiers = require "limax.settings.tiers"
local together = require "limax.evolution.together"

-- The words for an option that is a field of the experiment.
local function instead(name)
  return defaults.fields.experiment[name] and ("--set %s=..."):format(name) or nil
end

local command = {
  summary = "run an experiment, or continue one",
  instead = instead,
  usage = "limax run FILE [options]\n       limax run --resume DIR [options]",
  positional = { least = 0, most = 1, name = "FILE" },
  runs_on_ranks = true,
  exclusive = { { "together", "apart" } },
  options = {
    { name = "set", argument = "PATH=VALUE", many = true,
      text = "change a field of the experiment: population=50, scene.actuation.frequency=3" },
    { name = "accuracy", argument = "TIER", choices = tiers.NAMES,
      text = "preview, evolve, publish or reference, instead of the script's own" },
    { name = "out", argument = "DIR", text = "the new run folder; runs/NAME-N if left out" },
    { name = "device", argument = "NAME", choices = { "auto", "cpu", "cuda" },
      text = "auto, cpu or cuda" },
    { name = "threads", argument = "N", kind = "integer", minimum = 1, maximum = 1024,
      text = "CPU threads; LIMAX_THREADS, else one per core" },
    { name = "repetition", argument = "R", kind = "integer", minimum = 1,
      text = "compute only this repetition, with the same bytes" },
    { name = "together",
      text = "several repetitions at a time, with the same bytes; the default on a GPU" },
    { name = "apart", text = "one repetition after the other, on a GPU too" },
    { name = "live-prompts",
      text = "with a language model: read its prompts again before each generation" },
    { name = "resume", argument = "DIR", text = "continue the run in this folder" },
    { name = "from", argument = "N", kind = "integer", minimum = 0,
      text = "with --resume: go on from generation N; later ones are removed" },
    { name = "changed", text = "with --resume: continue although script or configuration differ" },
    { name = "quiet", short = "q", text = "no progress and no summary; warnings stay" },
  },
}

--- Is this value an experiment?
command.is_experiment = experiments.is

-- ---- before the run -----------------------------------------------------------------------------

-- Calls a function whose error is shown to the user without a traceback.
local function or_refuse(status, call, ...)
  local ok, value = failure.attempt(call, ...)
  if ok then return value end
  local broken = failure.of_machine(value)
  if broken == "device" or broken == "defect" then status = 1 end
  failure.raise(failure.status(value) or status, failure.bare(value))
end

-- The experiment that a script returned.
local function checked(value, path)
  if experiments.is(value) then return value end
  local test = package.loaded["limax.test"]
  if test and test.begun() then
    failure.raise(2, ("%s is a suite of tests: limax test %s"):format(path, path))
  end
  failure.raise(2, ("%s returns no experiment: it should end in `return limax.experiment"
    .. " { ... }`; a script that runs by itself is started by: limax %s"):format(path, path))
end

--- The experiment of a script.
function command.experiment_of(path) return checked(script.run(path), path) end

-- The changes that the options make: the tier first, so that --set overrides it.
local function changes_of(arguments)
  local changes = arguments.accuracy and tiers.overrides(arguments.accuracy) or {}
  for _, text in ipairs(arguments.set or {}) do changes[#changes + 1] = text end
  return changes
end

-- Opens a run folder at its last generation. Returns its experiment. The first rank checks the
-- seal; others get only the configuration.
local function reopen(session, arguments)
  session.folder = exchange.is_first and run_folder.open(arguments.resume) or nil
  local facts = exchange.first(function()
    local opened = session.folder
    scripts.require_own(opened)
    if not arguments.changed then resume.check_scripts(opened) end
    return { path = opened.path, config = opened.config, config_name = opened.config_name,
      owner = opened.owner }
  end)
  local folder = session.folder or reader.of(facts)
  local value, path, note = scripts.run(folder)
  local changes = {}
  for _, list in ipairs { folder.config.run.overrides, changes_of(arguments) } do
    for _, text in ipairs(list) do changes[#changes + 1] = text end
  end
  local experiment = checked(value, path):override(changes)
  session.only = folder.config.run.repetition
  if arguments.repetition and arguments.repetition ~= session.only then
    failure.raise(2, ("--repetition %d: %s computes %s"):format(arguments.repetition, folder.path,
      session.only and "repetition " .. session.only or "all repetitions"))
  end
  if not session.folder then return experiment end
  local comparison = resume.continue(folder, experiment,
    { repetition = session.only, overrides = changes, from = arguments.from }, arguments.changed)
  session.notes = { note }
  if comparison.changed then
    table.insert(session.notes, "continuing with what has changed:\n" .. comparison.text)
  end
  return experiment
end

-- Prints how to extend a run that has ended. Another number of generations changes no score.
local function say_finished(session, config)
  local limit = session.limit
  table.insert(session.notes, ("this run is finished: nothing is left to compute. To extend it:\n"
    .. "  %s --changed --set %s=%d"):format(shell.resume_command(session.path), limit,
    2 * config[limit]))
end

-- Lists the repetitions that are left, and counts what is done.
local function plan(session, config)
  session.first, session.last = session.only or 1, session.only or config.repetitions
  if session.last > config.repetitions then
    failure.raise(2, ("--repetition %d: the experiment has %d"):format(session.only,
      config.repetitions))
  end
  local folder = session.folder
  session.generations, session.left = 0, {}
  for r = session.first, session.last do
    local generations = 0
    if folder then
      generations = folder:last(r) + 1
      for _, line in ipairs(folder:lines("metrics", r)) do session.tally:add(line) end
    end
    session.generations = session.generations + generations
    session.limit = generations > 0 and budget.limit(config, generations) or session.limit
    if generations == 0
      or budget.allows_another(config, generations, folder:evaluations(r)) then
      table.insert(session.left, r)
    end
  end
end

local function announce(session, experiment, device)
  if session.quiet then return end
  local config = experiment.config
  local which = ("repetition%s %d%s%s"):format(session.first < session.last and "s" or "",
    session.first, session.first < session.last and " to " .. session.last or "",
    session.at_once > 1 and " together" or "")
  local supervisor = experiment.supervisor
  local where = device.kind
  if device.threads then where = ("%s (%d threads)"):format(where, device.threads) end
  if exchange.count > 1 then where = ("%d ranks, each on %s"):format(exchange.count, where) end
  local trials = #(config.trials or {})
  output.warn(("%s: %s, %d generations of %d robots%s, supervisor %s, on %s; folder %s\n"):format(
    config.name, which, config.generations, config.population,
    trials > 1 and (" in %d trials"):format(trials) or "",
    supervisor.own and "a function of the script" or supervisor.name, where,
    session.folder.path))
  local tier = tiers.of(config.simulation)
  if tier then
    local measured = tiers.measured(device)
    output.warn(("accuracy %s: %s; %s\n"):format(tier, tiers.describe(tier),
      tiers.price(measured and measured[tier])))
  end
end

-- ---- the run ------------------------------------------------------------------------------------

-- Runs the repetitions that are left. `first_run` is the first of them, begun without a folder.
local function compute(session, experiment, options, first_run)
  together.run { repetitions = session.left, at_once = session.at_once,
    on_progress = options.on_progress,
    begin = function(repetition)
      options.repetition = repetition
      local run = repetition == first_run.repetition and first_run
        or evolve.start(experiment, options)
      run.folder = session.folder
      return run
    end }
end

local function show_end(session, device)
  session.progress:finish()
  session.folder:finish "done"
  session.done = true
  local facts = host.terminal()
  -- it draws the champion, also when quiet
  require("limax.tools.console.summary").show(session.folder.path, { width = facts.columns,
    device = device, color = facts.stdout and facts.color,
    write = session.quiet and function() end or output.write })
  if session.quiet then return end
  output.write("\n", session.tally:text(), session.tally:time_text(session.folder.config),
    "Run folder: ", session.folder.path, "\n")
end

-- Options of limax.start. The first rank shows progress and warnings on the terminal.
local function start_options(session, arguments, device)
  local is_first = exchange.is_first
  return { repetition = session.left[1] or session.first, device = device,
    divided = true, live_prompts = arguments.live_prompts,
    say = is_first and function(text)
      session.tally:add_warning(text)
      session.progress:say(text)
    end or exchange.warn,
    on_progress = function(state) session.progress:robots(state) end,
    on_generation = function(entry, seconds)
      session.tally:add(entry)
      session.tally:add_times(seconds)
      session.progress:generation(entry, seconds)
    end }
end

-- Makes the folder of a new run.
local function make_folder(session, experiment, arguments, changes)
  local message
  -- other processes may take a free name at the same moment; a file system without locks never
  -- gives one
  for _ = 1, arguments.out and 1 or 100 do
    -- named before it is made, for Ctrl-C
    session.path = arguments.out or run_folder.next_free(experiment.config.name)
    session.folder, message = run_folder.take(session.path)
    if session.folder then break end
  end
  if not session.folder then failure.raise(2, message) end
  session.folder:begin(experiment, { repetition = session.only, overrides = changes })
end

-- Begins to write the folder, on the first rank only, which then sends what is left to the others.
local function begin(session, experiment, arguments, changes, device)
  if not session.folder then make_folder(session, experiment, arguments, changes) end
  -- from here on even a hard stop prints how to continue
  host.signal.on_hard_stop("continue with: "
    .. terminal.shown(shell.resume_command(session.path)))
  session.folder:start(device, exchange.count > 1 and exchange.count or nil)
  announce(session, experiment, device)
  local slower = passes.warning(device:describe())
  if slower then table.insert(session.notes, "CPU passes: " .. slower) end
  for _, note in ipairs(session.notes) do session.progress:say(note) end
  return session.path
end

local function execute(session, experiment, arguments)
  local changes, threads = changes_of(arguments), rank_share.take(arguments.threads)
  if arguments.resume then
    experiment = reopen(session, arguments)
  else
    experiment, session.only = experiment:override(changes), arguments.repetition
  end
  local config, supervisor = experiment.config, experiment.supervisor.name
  if arguments.live_prompts and supervisor ~= "llm" then
    failure.raise(2, ('--live-prompts: the supervisor %q reads no prompts; "llm" does')
      :format(supervisor))
  end
  plan(session, config)
  session.left = exchange.first(function() return session.left end)
  if session.folder and #session.left == 0 then say_finished(session, config) end
  local device = or_refuse(1, engine.device, arguments.device or "auto", { threads = threads })
  rank_share.check(experiment, device)
  session.at_once = 1
  if #session.left > 1 and not arguments.apart and (arguments.together or device.kind == "cuda")
    and exchange.count == 1 then
    session.at_once = together.at_once(device, config.population)
  end
  session.progress = progress.new { done = session.generations, quiet = session.quiet,
    total = budget.most_generations(config) * (session.last - session.first + 1),
    repetitions = config.repetitions, write = not exchange.is_first and function() end or nil }
  local options = start_options(session, arguments, device)
  -- the engine checks everything before a folder is made
  local first_run = or_refuse(2, evolve.start, experiment, options)
  session.path = exchange.first(function()
    return begin(session, experiment, arguments, changes, device)
  end)
  compute(session, experiment, options, first_run)
  if session.folder then show_end(session, device) end
  return 0
end

-- ---- a run that did not come to its end ---------------------------------------------------------

local function interrupted(session)
  local path = session.path
  if not path or not run_folder.is_run(path) then
    output.warn "interrupted; no run was begun\n"
  else
    output.warn(session.done and "interrupted; every generation is done\n"
      or "interrupted; what is not on disk is computed again\n", "continue with: ",
      shell.resume_command(path), "\n")
  end
  return host.signal.status()
end

-- Writes the state of the run and prints how to continue it. Nothing on disk is lost.
local function end_early(session, value, trace)
  if session.progress then session.progress:finish() end
  local folder = session.folder
  local is_interrupt = value == host.interrupt
  -- a run is done also if showing it failed
  if folder and session.progress and not session.done then
    failure.attempt(folder.finish, folder, is_interrupt and "stopped" or "failed",
      not is_interrupt and tostring(value) or nil)
  end
  if is_interrupt then return interrupted(session) end
  local status, machine = failure.status(value), failure.of_machine(value)
  local command_line = session.path and shell.resume_command(session.path)
  local repair = ""
  if folder and folder.on_disk and not failure.is_damaged(value) then
    -- a repaired script differs, which resume refuses without --changed
    repair = ("\nwhen it is repaired, continue with: %s --changed"):format(command_line)
  end
  if status == 1 and session.progress and not machine then failure.raise(1, value .. repair) end
  if status then error(value, 0) end
  if machine then
    -- nothing is wrong with the script
    local advice = command_line and ("continue with: %s\n"):format(command_line) or ""
    if machine == "memory" and folder and not folder.on_disk and not folder.found_newest then
      advice = ("no generation is complete: begin again with a smaller population or lattice (--set"
        .. " population=N) and another --out than %s\n"):format(shell.path(session.path))
    end
    output.warn("limax: ", failure.bare(value), "\n", advice)
  else
    output.warn("limax: ", failure.first_trace(value) or trace, repair, "\n")
  end
  return 1
end

--- Runs an experiment to its end, or continues the folder that `arguments.resume` names.
---@param experiment limax.experiment|nil nil with `arguments.resume`
---@param arguments table options of `limax run` by name
---@return integer status 0; 130 after Ctrl-C, 143 after SIGTERM; 1 or 2 after a failure
function command.run_experiment(experiment, arguments)
  local session = { path = arguments.resume, quiet = arguments.quiet, tally = tally.new(),
    notes = {} }
  local ok, value, trace = host.protect(execute, session, experiment, arguments)
  local status = value
  if not ok and exchange.shows(value, trace) then
    ok, status = pcall(end_early, session, value, trace)
  elseif not ok then
    ok, status = true, failure.status(value) or 1
    if value == host.interrupt then status = host.signal.status() end
  end
  host.signal.on_hard_stop(nil)
  if session.folder then session.folder:close() end
  if not ok then error(status, 0) end
  return status
end

function command.run(arguments)
  local file = arguments[1]
  if arguments.resume then
    local extra = arguments.out and "--out" or file
    if extra then
      failure.raise(2, "--resume knows its folder and its script: leave out " .. extra)
    end
    return command.run_experiment(nil, arguments)
  end
  for _, name in ipairs { "changed", "from" } do
    if arguments[name] then failure.raise(2, ("--%s belongs to --resume"):format(name)) end
  end
  if not file then failure.raise(2, "limax run: expected a FILE, or --resume DIR") end
  if reader.is_run(file) then
    failure.raise(2, ("%s is a run folder; to continue it: %s"):format(terminal.shown(file),
      shell.resume_command(file)))
  end
  return command.run_experiment(command.experiment_of(file), arguments)
end

return command
