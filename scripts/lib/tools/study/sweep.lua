--- sweep.lua: runs of one experiment for every point of a grid and every repetition. A sweep is a
--- folder with study.json, which `limax compare` and `limax report` read; each run is a run folder
--- in it. A process that computes a run holds a lock in `.locks` as long as it lives.

local arms = require "limax.tools.report.arms"
local cells = require "limax.tools.study.cells"
local choice = require "limax.base.choice"
local failure = require "limax.base.failure"
local folders = require "limax.tools.report.runs"
local grid = require "limax.tools.study.grid"
local host = require "limax.host"
local proposals = require "limax.supervise.proposals"
local run_config = require "limax.run.config"
local scripts = require "limax.run.scripts"
local shell = require "limax.base.shell"
local source = require "limax.base.source"
local study_file = require "limax.run.study_file"

local sweep = {}

---@class limax.sweep
---@field out string absolute path of its folder
---@field script { path: string, scripts: { file: string, sha256: string }[] } with the files that
--- it requires
---@field runs limax.sweep.run[]
---@field owner "own"|"other"|"edited"|"none" whose plan it is (base/seal.lua)
---@field key string|nil name of the key that sealed it
---@field question string|nil of a new sweep: a field for which limax compare refuses its runs

---@class limax.sweep.run
---@field path string below the sweep's folder
---@field arm string
---@field repetition integer
---@field changes string[] "path=value"

--- The sweep in a folder; ends the command if there is none.
function sweep.open(out)
  out = host.file.absolute(out)
  local found, owner, key
  if study_file.exists(out) then found, owner, key = study_file.read(out) end
  if not found or not found.script then
    failure.raise(2, ("%s holds no sweep: there is no %s of one; begin one with: limax sweep FILE"
      .. " --set PATH=VALUE,VALUE --out DIR"):format(out, study_file.NAME))
  end
  return { out = out, script = found.script, runs = found.runs, owner = owner, key = key }
end

--- The command that goes on with a sweep.
function sweep.resume_command(self)
  return ("%s sweep --resume %s"):format(shell.same_ranks(), shell.path(self.out))
end

--- Refuses a plan of somebody else.
function sweep.require_own(self)
  if self.owner == "own" then return end
  failure.raise(2, scripts.distrust(self.out, study_file.NAME, self.owner, self.key))
end

-- The script of an experiment and the files that it requires.
local function script_of(experiment)
  return { path = experiment.origin, scripts = run_config.of(experiment, {}).run.scripts }
end

local function refuse_script(self)
  failure.raise(2, ("%s, or a file that it requires, has changed since the sweep in %s began;"
    .. " restore it, or begin another sweep with another --out"):format(self.script.path,
    self.out))
end

-- Refuses a script that would make the runs of one sweep incomparable.
local function check_script(self, experiment)
  local now = host.json.encode(script_of(experiment).scripts)
  if now ~= host.json.encode(self.script.scripts) then refuse_script(self) end
end

-- Keeps the numbers of the runs that a folder already has; new ones follow them.
local function extend(self, earlier)
  local by_path, list, known = {}, earlier.runs, {}
  for _, run in ipairs(self.runs) do by_path[run.path] = run end
  for k, run in ipairs(list) do
    local now = by_path[run.path]
    known[run.path], list[k] = true, now
    if not now or table.concat(now.changes, "\n") ~= table.concat(run.changes, "\n") then
      failure.raise(2, ("%s holds another sweep, with %s (%s); continue it with: %s, or add to its"
        .. " lists, or name another --out"):format(self.out, run.path,
        table.concat(run.changes, " "), sweep.resume_command(self)))
    end
  end
  for _, run in ipairs(self.runs) do
    if not known[run.path] then list[#list + 1] = run end
  end
  self.runs = list
end

-- Locks a file of the sweep until this process ends; nil if another process has locked it.
local function lock_of(out, name)
  local lock, message, kind = host.file.lock(("%s/.locks/%s"):format(out, name))
  if lock or kind == "locked" then return lock end
  failure.raise(1, message)
end

-- The lock of the plan, which another process may hold for a moment.
local function lock_plan(out)
  while true do
    local lock = lock_of(out, "plan")
    if lock then return lock end
    host.wait(0.05)
    host.raise_if_interrupted()
  end
end

-- Refuses a list of values of a field that the supervisor changes in a run: the runs would keep the
-- names of the values, not the values.
local function check_supervisor(fields, experiment)
  local config, supervisor = experiment.config, experiment.supervisor
  local may_change = {}
  for _, name in ipairs(supervisor.changes or {}) do may_change[name] = true end
  for _, limit in ipairs(proposals.limits(config.population, nil, config.supervision)) do
    local allowed = limit.allowed and (not supervisor.changes or may_change[limit.field])
    local group = limit.material and "materials" or "breeding"
    for _, field in ipairs(allowed and fields or {}) do
      if #field.values > 1 and field.path:match "^[^.]*" == group
        and field.path:match "[^.]*$" == limit.field then
        failure.raise(2, ('--set %s: the supervisor "%s" changes it from generation to generation,'
          .. " so the runs would not keep these values; add --set supervisor=fixed or --set"
          .. " supervision.%s=false, or sweep supervision.ranges.%s, the range in which it stays")
          :format(field.path, supervisor.name, limit.material and "materials" or "hyperparameters",
          limit.field))
      end
    end
  end
end

--- Plans a sweep, checks every configuration, and writes the plan into its folder. A folder with a
--- sweep that this one contains is extended.
---@param options { out: string, set: string[], repetitions: integer|nil }
function sweep.plan(experiment, options)
  local out = host.file.absolute(options.out)
  local repetitions = options.repetitions or experiment.config.repetitions
  local fields = grid.fields(options.set)
  local points = grid.points(fields, experiment.config.name)
  local first, question
  for _, point in ipairs(points) do
    local changed = experiment:override { ("repetitions=%d"):format(repetitions),
      unpack(point.changes) }
    check_supervisor(fields, changed)
    first = first or changed.config
    question = question or arms.other_question(first, changed.config)
  end
  local self = { out = out, runs = {}, script = script_of(experiment), question = question }
  -- repetition by repetition, so that a sweep that is stopped can be compared
  for repetition = 1, repetitions do
    for _, point in ipairs(points) do
      table.insert(self.runs, { path = ("%s/r%02d"):format(point.folder, repetition),
        arm = point.arm, repetition = repetition, changes = host.json.array(point.changes) })
    end
  end
  if folders.is_folder(out) then
    failure.raise(2, ("%s is a run folder; name another --out"):format(out))
  end
  source.refuse_links(out, 1)
  local made, message = host.file.mkdir(out .. "/.locks")
  if not made then failure.raise(2, message) end
  -- another process may extend the same plan
  local lock = lock_plan(out)
  if study_file.exists(out) then
    local earlier = sweep.open(out)
    sweep.require_own(earlier)
    check_script(earlier, experiment)
    extend(self, earlier)
  end
  study_file.write(out, { script = self.script, runs = host.json.array(self.runs) })
  self.owner = "own"
  lock:free()
  return self
end

--- Is this run done?
function sweep.is_done(self, run) return cells.is_done(self.out .. "/" .. run.path, run) end

--- The numbers of the runs that are not done.
function sweep.left(self)
  local list = {}
  for k, run in ipairs(self.runs) do
    if not sweep.is_done(self, run) then list[#list + 1] = k end
  end
  return list
end

--- Locks a run for this process, until its end; nil if another process has locked it.
function sweep.claim(self, number) return lock_of(self.out, number) end

--- Refuses to compute with another script than that of the other runs, or with one that somebody
--- else named.
---@param self limax.sweep
---@param load fun(path: string): limax.experiment
function sweep.experiment(self, load)
  sweep.require_own(self)
  if not scripts.is_there(self.script.path) then
    failure.raise(2, ("there is no file %s, the script of the sweep in %s"):format(
      self.script.path, self.out))
  elseif scripts.changed(self.script.path, self.script.scripts)[1] then
    refuse_script(self)
  end
  local experiment = load(self.script.path)
  check_script(self, experiment)
  return experiment
end

--- The command line of a run.
---@param number integer|string or what a shell replaces by it
---@param options table<string, string|integer> by name
---@return string words for a shell
function sweep.command(self, number, options)
  local words = { shell.quoted(host.executable), "sweep", "--resume", shell.quoted(self.out),
    "--run", tostring(number) }
  for _, name in ipairs(choice.sorted_keys(options)) do
    words[#words + 1] = "--" .. name
    words[#words + 1] = shell.quoted(tostring(options[name]))
  end
  return table.concat(words, " ")
end

-- Numbers in rising order as Slurm takes them: "1-4,7".
local function ranges(numbers)
  local parts, from = {}, nil
  for k, number in ipairs(numbers) do
    from = from or number
    if numbers[k + 1] ~= number + 1 then
      parts[#parts + 1] = from == number and tostring(from) or ("%d-%d"):format(from, number)
      from = nil
    end
  end
  return table.concat(parts, ",")
end

--- A job script of Slurm: an array with a task for each of these runs.
---@param options { threads: integer, device: string }
function sweep.slurm(self, numbers, options)
  local out = self.out
  return table.concat({
    "#!/bin/sh",
    "#SBATCH --job-name=" .. source.name_of(out):gsub("[^%w_.-]", "-"),
    "#SBATCH --array=" .. ranges(numbers),
    "#SBATCH --cpus-per-task=" .. options.threads,
    options.device == "cuda" and "#SBATCH --gres=gpu:1" or "#SBATCH --ntasks=1",
    ('#SBATCH --output="%s/slurm-%%A-%%a.log"'):format((out:gsub("%%", "%%%%"))),
    "#SBATCH --open-mode=append",
    "#SBATCH --requeue",
    "# interrupted 60 s before the time limit; the next submission goes on",
    "#SBATCH --signal=B:INT@60",
    ("# %d of %d runs are left; add your account, partition and time limit"):format(#numbers,
      #self.runs),
    "exec " .. sweep.command(self, '"$SLURM_ARRAY_TASK_ID"', options),
    "",
  }, "\n")
end

return sweep
