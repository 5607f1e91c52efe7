--- baselines.lua: runs the baselines of tasks and writes their table into scripts/TASKS.md. Each arm
--- is a controller with the default evolution or MAP-Elites; each of its repetitions counts with the
--- score of its last champion, the mean over worlds that no run has seen.
---
---   limax scripts/dev/baselines.lua run DIR REPETITIONS TASK[,TASK...] [OPTION...]
---   limax scripts/dev/baselines.lua table DIR
---
--- The first command skips arms that are in DIR; further options are those of `limax task run`, such
--- as --set generations=50. It leaves DIR/TASK.json and the best champion of each arm in
--- DIR/champions. The second one needs only these.

local arms_of = require "limax.tools.report.arms"
local bootstrap = require "limax.base.statistics.bootstrap"
local engine = require "limax.engine"
local experiments = require "limax.experiment.experiment"
local host = require "limax.host"
local runs = require "limax.tools.report.runs"
local sample = require "limax.base.statistics.sample"
local scripts = require "limax.run.scripts"
local shell = require "limax.base.shell"
local task = require "limax.experiment.task"
local verdict = require "limax.tools.compare.verdict"

local CONTROLLERS = { "sine", "reflex", "network", "central" }
-- The arm that the others are compared with.
local OPEN_LOOP = "sine"
local METHODS = { { name = "", sets = {} }, { name = " me", sets = { "survival=map_elites",
  "supervisor=fixed", 'archive=["grid"]', 'archive.descriptors=["muscle_share","contact"]' } } }
local PAGE, FROM, TO = "/scripts/TASKS.md", "<!-- baselines -->\n", "<!-- end of baselines -->"

local function read(path)
  local file = assert(io.open(path, "rb"))
  local text = file:read "*a"
  file:close()
  return text
end

-- Runs an arm of a task unless it has been.
local function run_arm(out, name, controller, method, repetitions, options)
  if host.file.exists(out) then return end
  local words = { "task", "run", name, "--controller", controller, "--out", out, "--quiet",
    "--set", "repetitions=" .. repetitions }
  for _, set in ipairs(method.sets) do
    words[#words + 1], words[#words + 2] = "--set", set
  end
  for _, option in ipairs(options) do words[#words + 1] = option end
  for k, word in ipairs(words) do words[k] = shell.quoted(word) end
  assert(os.execute(shell.quoted(host.executable) .. " " .. table.concat(words, " ")) == 0)
end

-- An arm as the comparison takes it, and the score of each of its runs.
local function score_arm(out, label, outcomes, device)
  local list = runs.finished { runs.read(out) }
  local experiment = scripts.run_copy(list[1].folder):override(list[1].config.run.overrides)
  local worlds = task.worlds(experiment)
  local arm = { name = label, runs = list, by_pair = {}, fields = {} }
  for _, run in ipairs(list) do
    local description = assert(runs.description(run, run.lines[#run.lines]))
    description.materials = run.config.materials
    local scores, message = task.scores(experiment, description, worlds, device)
    if not scores then print(("%s, repetition %d: %s"):format(out, run.repetition, message)) end
    outcomes[run] = scores and sample.mean(scores)
    arm.by_pair[arms_of.pair(run)] = run
  end
  return arm, experiment
end

local function run_task(folder, name, repetitions, options)
  local arms, outcomes, device, evaluations = {}, {}, engine.device "auto", nil
  for _, method in ipairs(METHODS) do
    for _, controller in ipairs(CONTROLLERS) do
      local label = controller .. method.name
      local out = ("%s/runs/%s/%s"):format(folder, name, (label:gsub(" ", "-")))
      run_arm(out, name, controller, method, repetitions, options)
      local arm, experiment = score_arm(out, label, outcomes, device)
      evaluations = experiment.config.population * experiment.config.generations
      table.insert(arms, label == OPEN_LOOP and 1 or #arms + 1, arm)
    end
  end
  local compared = {}
  for _, row in ipairs(verdict.compare(arms, outcomes, { baseline = OPEN_LOOP }).arms) do
    compared[row.name] = row
  end
  local result = { task = name, evaluations = evaluations, arms = {} }
  for k, arm in ipairs(arms) do
    local scores, best = {}, arm.runs[1]
    for r, run in ipairs(arm.runs) do
      scores[r] = outcomes[run]
      if outcomes[run] > outcomes[best] then best = run end
    end
    local row = compared[arm.name]
    result.arms[k] = { name = arm.name, scores = scores, p_holm = row.test and row.test.p_holm,
      better = row.claimed and row.test.difference > 0 or false }
    assert(host.file.write_atomic(("%s/champions/%s-%s.json"):format(folder, name,
      (arm.name:gsub(" ", "-"))), read(runs.champion(best, best.lines[#best.lines]))))
  end
  assert(host.file.write_atomic(("%s/%s.json"):format(folder, name), host.json.encode(result)))
end

-- "1.23 (1.1 to 1.4)", bold where it is better than open loop.
local function cell(arm)
  local low, high = bootstrap.interval(arm.scores, sample.mean)
  local text = ("%.2f (%.2f to %.2f)"):format(sample.mean(arm.scores), low, high)
  return arm.better and ("**%s**"):format(text) or text
end

local function write_table(folder)
  local lines, header = {}, nil
  for _, file in ipairs(host.file.list(folder)) do
    if file:match "%.json$" then
      local result = host.json.decode(read(folder .. "/" .. file))
      local cells, names = {}, {}
      for k, arm in ipairs(result.arms) do
        cells[k], names[k] = cell(arm), arm.name
      end
      header = header or ("| task | robots | %s |\n|%s"):format(table.concat(names, " | "),
        ("---|"):rep(#names + 2))
      lines[#lines + 1] = ("| `%s` | %d x %d | %s |"):format(result.task, #result.arms[1].scores,
        result.evaluations, table.concat(cells, " | "))
    end
  end
  local page = read(host.home .. PAGE)
  local first, last = page:find(FROM, 1, true), page:find(TO, 1, true)
  assert(first and last, "TASKS.md has no place for the table")
  assert(host.file.write_atomic(host.home .. PAGE, page:sub(1, first + #FROM - 1) .. header .. "\n"
    .. table.concat(lines, "\n") .. "\n" .. page:sub(last)))
end

local action, folder, repetitions, names = unpack(arg)
assert(folder and (action == "table" or action == "run" and names), "see the head of this script")
if action == "table" then return write_table(folder) end
for _, path in ipairs { folder, folder .. "/champions", folder .. "/runs" } do
  host.file.mkdir(path)
end
for name in names:gmatch "[^,]+" do
  host.file.mkdir(("%s/runs/%s"):format(folder, name))
  run_task(folder, name, repetitions, { unpack(arg, 5) })
end
experiments.idle = false -- none of those read is to be run
