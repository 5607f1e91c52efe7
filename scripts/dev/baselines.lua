--- baselines.lua: runs the baselines of tasks and writes their table into scripts/TASKS.md. Each
--- arm is a controller with the default evolution or MAP-Elites; each of its repetitions counts
--- with the score of its last champion, the mean over worlds that no run has seen.
---
---   limax scripts/dev/baselines.lua run DIR REPETITIONS TASK[,TASK...] [OPTION...]
---   limax scripts/dev/baselines.lua table DIR
---
--- The first command skips arms that are in DIR; further options are those of `limax task run`,
--- such as --set generations=50. It leaves the scores of each arm in DIR/scores, and its best
--- champion in DIR/champions; DIR/runs may then be removed. An arm with "-me" is MAP-Elites.

local bootstrap = require "limax.base.statistics.bootstrap"
local engine = require "limax.engine"
local experiments = require "limax.experiment.experiment"
local holm = require "limax.base.statistics.holm"
local host = require "limax.host"
local runs = require "limax.tools.report.runs"
local sample = require "limax.base.statistics.sample"
local scripts = require "limax.run.scripts"
local shell = require "limax.base.shell"
local signed_rank = require "limax.base.statistics.signed_rank"
local task = require "limax.experiment.task"
local verdict = require "limax.tools.compare.verdict"

local CONTROLLERS = { "sine", "reflex", "network", "central" }
-- Of controllers with genes: weights that begin at random and change faster than the default's.
local OF_GENES = { "genome.control_spread=0.3", "breeding.control_mutation_scale=0.3" }
local HAS_GENES = { network = true, central = true }
-- The arm that the others are compared with.
local OPEN_LOOP = "sine"
local METHODS = { { name = "", sets = {} }, { name = "-me", sets = { "survival=map_elites",
  "supervisor=fixed", 'archive=["grid"]', 'archive.descriptors=["muscle_share","contact"]' } } }
local ARMS = {}
for _, method in ipairs(METHODS) do
  for _, controller in ipairs(CONTROLLERS) do ARMS[#ARMS + 1] = controller .. method.name end
end
local PAGE, FROM, TO = "/scripts/TASKS.md", "<!-- baselines -->\n", "<!-- end of baselines -->"

local function read(path)
  local file = assert(io.open(path, "rb"))
  local text = file:read "*a"
  file:close()
  return text
end

local function write(path, text) assert(host.file.write_atomic(path, text)) end

-- Runs an arm of a task unless it has been.
local function run_arm(out, name, controller, method, repetitions, options)
  if host.file.exists(out) then return end
  local words = { "task", "run", name, "--controller", controller, "--out", out, "--quiet",
    "--set", "repetitions=" .. repetitions }
  for _, sets in ipairs { method.sets, HAS_GENES[controller] and OF_GENES or {} } do
    for _, set in ipairs(sets) do words[#words + 1], words[#words + 2] = "--set", set end
  end
  for _, option in ipairs(options) do words[#words + 1] = option end
  for k, word in ipairs(words) do words[k] = shell.quoted(word) end
  assert(os.execute(shell.quoted(host.executable) .. " " .. table.concat(words, " ")) == 0)
end

-- Scores the champions of an arm, keeps the scores and the best of them, and returns the scores.
local function score_arm(folder, name, arm, out, device)
  local list = runs.finished { runs.read(out) }
  local experiment = scripts.run_copy(list[1].folder):override(list[1].config.run.overrides)
  local worlds, scores, best = task.worlds(experiment), {}, nil
  for r, run in ipairs(list) do
    local line = run.lines[#run.lines]
    local description = assert(runs.description(run, line))
    description.materials = run.config.materials
    local own, message = task.scores(experiment, description, worlds, device)
    if not own then error(("%s, repetition %d: %s"):format(out, run.repetition, message), 0) end
    scores[r] = sample.mean(own)
    if scores[r] == math.max(unpack(scores)) then best = runs.champion(run, line) end
  end
  write(("%s/champions/%s-%s.json"):format(folder, name, arm), read(best))
  write(("%s/scores/%s-%s.json"):format(folder, name, arm), host.json.encode {
    evaluations = experiment.config.population * experiment.config.generations,
    scores = scores })
end

local function run_task(folder, name, repetitions, options)
  local device = engine.device "auto"
  for _, method in ipairs(METHODS) do
    for _, controller in ipairs(CONTROLLERS) do
      local arm = controller .. method.name
      local out = ("%s/runs/%s/%s"):format(folder, name, arm)
      if host.file.exists(("%s/scores/%s-%s.json"):format(folder, name, arm)) ~= "file" then
        run_arm(out, name, controller, method, repetitions, options)
        score_arm(folder, name, arm, out, device)
      end
    end
  end
end

-- "1.23 (1.1 to 1.4)", bold where it is better than open loop by this p value.
local function cell(scores, open_loop, p)
  local low, high = bootstrap.interval(scores, sample.mean)
  local text = ("%.2f (%.2f to %.2f)"):format(sample.mean(scores), low, high)
  local better = p and p <= verdict.LEVEL and sample.mean(scores) > sample.mean(open_loop)
  return better and ("**%s**"):format(text) or text
end

-- The row of a task; nil without an arm of it. The tests are those of `limax compare`.
local function row_of(folder, name)
  local results, cells, p_values, tested = {}, {}, {}, {}
  local open_loop
  for k, arm in ipairs(ARMS) do
    local path = ("%s/scores/%s-%s.json"):format(folder, name, arm)
    results[k] = host.file.exists(path) == "file" and host.json.decode(read(path))
    if arm == OPEN_LOOP then open_loop = results[k] end
  end
  if not open_loop then return nil end
  for k, arm in ipairs(ARMS) do
    if results[k] and arm ~= OPEN_LOOP then
      local differences = {}
      for r, score in ipairs(results[k].scores) do
        differences[r] = score - open_loop.scores[r]
      end
      p_values[#p_values + 1], tested[#tested + 1] = signed_rank.test(differences).p, k
    end
  end
  local adjusted = {}
  for i, p in ipairs(holm.adjust(p_values)) do adjusted[tested[i]] = p end
  for k in ipairs(ARMS) do
    cells[k] = results[k] and cell(results[k].scores, open_loop.scores, adjusted[k]) or ""
  end
  return ("| `%s` | %d x %d | %s |"):format(name, #open_loop.scores, open_loop.evaluations,
    table.concat(cells, " | "))
end

local function write_table(folder)
  local lines = { ("| task | robots | %s |"):format(table.concat(ARMS, " | ")),
    "|" .. ("---|"):rep(#ARMS + 2) }
  for _, file in ipairs(host.file.list(host.home .. "/scripts/tasks")) do
    lines[#lines + 1] = row_of(folder, file:match "^(.*)%.lua$")
  end
  local page = read(host.home .. PAGE)
  local _, from = page:find(FROM, 1, true)
  local to = page:find(TO, 1, true)
  write(host.home .. PAGE, page:sub(1, from) .. table.concat(lines, "\n") .. "\n" .. page:sub(to))
end

local action, folder, repetitions, names = unpack(arg)
assert(folder and (action == "table" or action == "run" and names), "see the head of this script")
if action == "table" then return write_table(folder) end
for _, path in ipairs { "", "/champions", "/scores", "/runs" } do
  host.file.mkdir(folder .. path)
end
for name in names:gmatch "[^,]+" do
  host.file.mkdir(("%s/runs/%s"):format(folder, name))
  run_task(folder, name, repetitions, { unpack(arg, 5) })
end
experiments.idle = false -- none of those read is to be run
