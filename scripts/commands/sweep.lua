--- sweep.lua: `limax sweep FILE --set PATH=VALUE,VALUE`: an experiment for every combination of
--- values, several runs at once, or as jobs for a cluster.

local at_once = require "limax.tools.study.at_once"
local engine = require "limax.engine"
local exchange = require "limax.base.exchange"
local failure = require "limax.base.failure"
local host = require "limax.host"
local output = require "limax.base.output"
local rank_share = require "limax.tools.study.rank_share"
local run = require "limax.commands.run"
local shell = require "limax.base.shell"
local sweep = require "limax.tools.study.sweep"
local terminal = require "limax.base.terminal"

local command = {
  summary = "run an experiment for every combination of values, here or on a cluster",
  usage = "limax sweep FILE --set PATH=VALUE,VALUE,... --out DIR [options]\n"
    .. "       limax sweep --resume DIR [options]",
  instead = run.instead,
  text = [[
Each --set is a list of values of one field, separated by commas; a comma within brackets, braces or
quotation marks belongs to a value: --set lattice=[4,4,4],[5,5,5]. The runs are all combinations, in
all repetitions. Each is a run folder in DIR; `limax compare DIR` and `limax report DIR` read them
together, with an arm for each combination. A field that the supervisor changes during a run is
refused: add --set supervisor=fixed.

Every configuration is checked before anything runs. The same command again, or --resume DIR, goes
on: runs that are done stay, a run that was stopped is continued. Further values and repetitions
may be added. Any number of processes, also on several machines with a common file system, may work
in DIR at the same time; each run is computed by one of them. CLUSTER.md has examples.]],
  positional = { least = 0, most = 1, name = "FILE" },
  runs_on_ranks = true,
  exclusive = { { "slurm", "list", "run" } },
  options = {
    { name = "set", argument = "PATH=VALUE,VALUE", many = true,
      text = "values of a field: breeding.mutation_rate=0.05,0.1,0.2" },
    { name = "repetitions", argument = "N", kind = "integer", minimum = 1, maximum = 1000,
      text = "of each combination; the experiment's own if left out" },
    { name = "out", argument = "DIR", text = "the sweep's folder" },
    { name = "resume", argument = "DIR", text = "go on with the sweep in this folder" },
    { name = "jobs", short = "j", argument = "N", kind = "integer", minimum = 1, maximum = 1024,
      text = "runs at a time; one per GPU, or per core on a CPU" },
    { name = "threads", argument = "N", kind = "integer", minimum = 1, maximum = 1024,
      text = "CPU threads of each run; the cores divided among the runs at a time" },
    { name = "device", argument = "NAME", choices = { "auto", "cpu", "cuda" }, value = "auto",
      text = "auto, cpu or cuda" },
    { name = "slurm", text = "only print a job script for sbatch: an array with a task per run" },
    { name = "list", text = "only print a command per run, for GNU parallel or xargs" },
    { name = "run", argument = "K", kind = "integer", minimum = 1,
      text = "with --resume: only run number K; does nothing if it is done or in use" },
    { name = "quiet", short = "q", text = "no line per run; warnings and failures stay" },
  },
}

-- The sweep that the arguments name.
local function chosen(arguments)
  local file = arguments[1]
  if arguments.resume then
    local given = file or arguments.set[1] and "--set" or arguments.out and "--out"
      or arguments.repetitions and "--repetitions"
    if given then failure.raise(2, "--resume knows its plan: leave out " .. given) end
    local self = sweep.open(arguments.resume)
    sweep.require_own(self)
    return self
  end
  if arguments.run then failure.raise(2, "--run belongs to --resume") end
  if not file then failure.raise(2, "limax sweep: expected a FILE, or --resume DIR") end
  if not arguments.out then failure.raise(2, "limax sweep: expected --out DIR") end
  local self = sweep.plan(run.experiment_of(file), arguments)
  if self.question then
    output.warn(("! limax compare cannot compare runs that differ in %s; limax report shows them\n")
      :format(self.question))
  end
  return self
end

-- Computes one run in this process, unless it is done or another process has it.
local function run_one(self, arguments)
  local number = arguments.run
  local one = self.runs[number]
  if not one then
    failure.raise(2, ("--run %d: the sweep has %d runs"):format(number, #self.runs))
  end
  local path = self.out .. "/" .. one.path
  local lock = sweep.claim(self, number)
  if not lock or sweep.is_done(self, one) then
    output.warn(("run %d, %s, is %s\n"):format(number, shell.path(path),
      lock and "done" or "in use by another process"))
    return 0
  end
  local options = { threads = arguments.threads, device = arguments.device,
    quiet = arguments.quiet }
  local experiment
  if host.file.exists(path .. "/config.json") then
    options.resume = path
  else
    experiment = sweep.experiment(self, run.experiment_of)
    options.out, options.repetition = path, one.repetition
    options.set = { ("repetitions=%d"):format(self.runs[#self.runs].repetition),
      unpack(one.changes) }
  end
  local status = run.run_experiment(experiment, options)
  lock:free() -- here, as an unused lock would be collected during the run
  return status
end

-- The GPUs that runs may use, as CUDA_VISIBLE_DEVICES names them.
local function visible_gpus(name)
  if name == "cpu" then return {} end
  local device, names, list = engine.device(name), {}, {}
  for word in (os.getenv "CUDA_VISIBLE_DEVICES" or ""):gmatch "[^,%s]+" do
    names[#names + 1] = word
  end
  for k, gpu in ipairs(device:describe().gpus or {}) do
    list[k] = names[gpu.ordinal + 1] or tostring(gpu.ordinal)
  end
  device:free()
  return list
end

local function run_here(self, left, arguments)
  local share = rank_share.take()
  local gpus = visible_gpus(arguments.device)
  local cores = engine.device("cpu", { threads = share }).threads
  local places = math.min(#left, arguments.jobs or (gpus[1] and #gpus or cores))
  local threads = arguments.threads or math.max(1, math.floor(cores / places))
  local warned, failed = {}, nil
  local function say(text) if not arguments.quiet then output.warn(text, "\n") end end
  local first_says = exchange.is_first and say or function() end
  first_says(("%d of %d runs left, %d at a time with %d thread%s each%s; folder %s"):format(#left,
    #self.runs, places, threads, threads == 1 and "" or "s",
    (gpus[1] and (", on %d GPU%s"):format(#gpus, #gpus == 1 and "" or "s in all") or "")
      .. (exchange.count > 1 and (", on each of %d ranks"):format(exchange.count) or ""),
    shell.path(self.out)))
  local go_on = terminal.shown(sweep.resume_command(self))
  host.signal.on_hard_stop("continue with: " .. go_on)
  local fine, value = host.protect(function()
    failed = at_once.run(self, { numbers = left, places = places, threads = threads, gpus = gpus,
      device = arguments.device, say = function(text, is_failure)
        if is_failure then output.warn(text, "\n") else say(text) end
      end,
      warn = function(text)
        if not warned[text] then output.warn(text, "\n") end
        warned[text] = true
      end })
  end)
  host.signal.on_hard_stop(nil)
  if fine and failed == 0 then return 0 end
  if not fine and value ~= host.interrupt then error(value, 0) end
  if fine or exchange.shows(value) then
    output.warn(fine and ("%d run%s failed"):format(failed, failed == 1 and "" or "s")
      or "interrupted; unfinished generations are dropped", "\ncontinue with: ", go_on, "\n")
  end
  return fine and 1 or host.signal.status()
end

-- Prints the state of the sweep and the commands that read it.
local function show_end(self)
  local left, folder = #sweep.left(self), shell.path(self.out)
  if left > 0 then
    output.write(("%d of %d runs are done; other processes compute the others\n"):format(
      #self.runs - left, #self.runs))
  else
    local program = shell.program()
    output.write(("all runs are done: %s compare %s, %s report %s\n"):format(program, folder,
      program, folder))
  end
end

-- The runs that are left, in an order that begins with another one on each rank.
local function left_here(self)
  local left, list = sweep.left(self), {}
  local before = math.floor(exchange.index * #left / exchange.count)
  for k = 1, #left do list[k] = left[(k - 1 + before) % #left + 1] end
  return list
end

function command.run(arguments)
  for _, name in ipairs { "run", "slurm", "list" } do
    if arguments[name] and exchange.count > 1 then
      failure.raise(2, ("--%s is for one process: start it without mpirun"):format(name))
    end
  end
  local self = exchange.first(function() return chosen(arguments) end)
  if arguments.run then return run_one(self, arguments) end
  local left = left_here(self)
  if arguments.slurm or arguments.list then
    local options = { threads = arguments.threads or 1,
      device = arguments.device ~= "auto" and arguments.device or nil }
    if #left == 0 then
      output.warn "all runs are done\n"
    elseif self.out:find '[%c"\\]' then
      -- lines are commands, and Slurm has its own rules for quotes and backslashes
      failure.raise(2, ("--slurm and --list need a folder without control characters, \" and \\,"
        .. " got %s"):format(shell.path(self.out)))
    elseif arguments.slurm then
      output.write(sweep.slurm(self, left, options))
    else
      for _, number in ipairs(left) do
        output.write(sweep.command(self, number, options), "\n")
      end
    end
    return 0
  end
  local status = 0
  if #left > 0 then
    sweep.experiment(self, run.experiment_of)
    status = run_here(self, left, arguments)
  end
  if status > 2 then return status end
  for _, other in ipairs(exchange.all(status)) do status = math.max(status, other) end
  if status == 0 and exchange.is_first then show_end(self) end
  return status
end

return command
