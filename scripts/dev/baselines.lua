--- baselines.lua: runs the baselines of tasks and publishes them in scripts/TASKS.md. Each arm is a
--- controller with the default evolution or MAP-Elites; each of its repetitions counts with the
--- score of its last champion, the mean over worlds that no run has seen.
---
---   limax scripts/dev/baselines.lua run DIR REPETITIONS TASK[,TASK...] [OPTION...]
---   limax scripts/dev/baselines.lua publish DIR
---   limax scripts/dev/baselines.lua pages DIR
---
--- run      skips arms that are in DIR; further options are those of `limax task run`, such as
---          --set generations=50. It leaves the scores of each arm in DIR/scores, and its best
---          champion in DIR/champions; DIR/runs may then be removed. An arm with "-me" is
---          MAP-Elites.
--- publish  adds the arms in DIR to scripts/baselines/scores.json and writes the table of all into
---          scripts/TASKS.md; beside the scores are the best robot of each controller and a film
---          strip of the best of all
--- pages    writes DIR/TASK.html for each task: those robots side by side in 3D

local bootstrap = require "limax.base.statistics.bootstrap"
local engine = require "limax.engine"
local experiments = require "limax.experiment.experiment"
local holm = require "limax.base.statistics.holm"
local host = require "limax.host"
local html = require "limax.tools.report.html"
local motion = require "limax.draw.motion"
local robot = require "limax.robot.robot"
local robots = require "limax.tools.report.robots"
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
-- The controller that the others are compared with, under the same method.
local OPEN_LOOP = "sine"
local METHODS = { { name = "", words = "default", sets = {} },
  { name = "-me", words = "MAP-Elites", sets = { "survival=map_elites", "supervisor=fixed",
    'archive=["grid"]', 'archive.descriptors=["muscle_share","contact"]' },
    -- where nothing can be touched
    swim = { 'archive.descriptors=["muscle_share","voxel_share"]' } } }
local PAGE = host.home .. "/scripts/TASKS.md"
local FROM, TO = "<!-- baselines -->\n", "<!-- end of baselines -->"
local KEPT = host.home .. "/scripts/baselines"
local SCORES = KEPT .. "/scores.json" -- of all arms
local STRIP = 840 -- pixels wide

local function read(path)
  local file = assert(io.open(path, "rb"))
  local text = file:read "*a"
  file:close()
  return text
end

local function write(path, text) assert(host.file.write_atomic(path, text)) end

-- Runs a command of limax.
local function run_limax(words)
  local quoted = {}
  for k, word in ipairs(words) do quoted[k] = shell.quoted(word) end
  assert(os.execute(shell.quoted(host.executable) .. " " .. table.concat(quoted, " ")) == 0)
end

-- Runs an arm of a task unless it has been.
local function run_arm(out, name, controller, method, repetitions, options)
  if host.file.exists(out) then return end
  local words = { "task", "run", name, "--controller", controller, "--out", out, "--quiet",
    "--set", "repetitions=" .. repetitions }
  for _, sets in ipairs { method.sets, method[name] or {}, HAS_GENES[controller] and OF_GENES
    or {} } do
    for _, set in ipairs(sets) do words[#words + 1], words[#words + 2] = "--set", set end
  end
  for _, option in ipairs(options) do words[#words + 1] = option end
  run_limax(words)
end

-- Scores the champions of an arm, keeps the scores and the best of them, and returns the scores.
local function score_arm(folder, name, arm, out, device)
  local list = runs.finished { runs.read(out) }
  local experiment = scripts.run_copy(list[1].folder):override(list[1].config.run.overrides)
  local champions, scores, best = {}, {}, nil
  for r, run in ipairs(list) do
    champions[r] = assert(runs.description(run, run.lines[#run.lines]))
    champions[r].materials = run.config.materials
  end
  local all, wrong = task.scores(experiment, champions, task.worlds(experiment), device)
  for r, run in ipairs(list) do
    if wrong[r] then error(("%s, repetition %d: %s"):format(out, run.repetition, wrong[r]), 0) end
    scores[r] = sample.mean(all[r])
    if scores[r] == math.max(unpack(scores)) then
      best = runs.champion(run, run.lines[#run.lines])
    end
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

-- The p value of each arm against open loop, after Holm over those of the task. The tests are those
-- of `limax compare`.
local function tested(results)
  local p_values, names, adjusted = {}, {}, {}
  for _, method in ipairs(METHODS) do
    local open_loop = results[OPEN_LOOP .. method.name]
    for _, controller in ipairs(CONTROLLERS) do
      local own = results[controller .. method.name]
      if own and open_loop and controller ~= OPEN_LOOP then
        local differences = {}
        for r, score in ipairs(own.scores) do differences[r] = score - open_loop.scores[r] end
        p_values[#p_values + 1] = signed_rank.test(differences).p
        names[#names + 1] = controller .. method.name
      end
    end
  end
  for i, p in ipairs(holm.adjust(p_values)) do adjusted[names[i]] = p end
  return adjusted
end

-- The rows of a task, one for each method.
local function add_rows(lines, name, results)
  local p_values = tested(results)
  for _, method in ipairs(METHODS) do
    local open_loop, cells = results[OPEN_LOOP .. method.name], {}
    for k, controller in ipairs(CONTROLLERS) do
      local own = results[controller .. method.name]
      cells[k] = own and cell(own.scores, open_loop and open_loop.scores,
        p_values[controller .. method.name]) or ""
    end
    if open_loop then
      lines[#lines + 1] = ("| `%s` | %s | %d x %d | %s |"):format(name, method.words,
        #open_loop.scores, open_loop.evaluations, table.concat(cells, " | "))
    end
  end
end

-- Adds the arms of a task in a folder to `results`, [arm] = { evaluations, scores }, and keeps the
-- best robot of each controller among all. Returns the best of these; nil without one.
local function take(folder, name, results)
  local best, best_score
  for _, controller in ipairs(CONTROLLERS) do
    local score, champion
    for _, method in ipairs(METHODS) do
      local arm = controller .. method.name
      local path = ("%s/scores/%s-%s.json"):format(folder, name, arm)
      local is_new = host.file.exists(path) == "file"
      if is_new then results[arm] = host.json.decode(read(path)) end
      local most = results[arm] and math.max(unpack(results[arm].scores))
      if most and (not score or most > score) then
        score, champion = most, is_new and ("%s/champions/%s-%s.json"):format(folder, name, arm)
      end
    end
    local path = ("%s/%s-%s.json"):format(KEPT, name, controller)
    if champion then
      write(path, host.json.encode(host.json.decode(read(champion))) .. "\n")
    end
    if score and not (best_score and best_score >= score) then best, best_score = path, score end
  end
  return best, best_score
end

local function task_names()
  local names = {}
  for _, file in ipairs(host.file.list(host.home .. "/scripts/tasks")) do
    names[#names + 1] = file:match "^(.*)%.lua$"
  end
  return names
end

local function publish(folder)
  local lines = { ("| task | evolution | robots | %s |"):format(table.concat(CONTROLLERS, " | ")),
    "|" .. ("---|"):rep(#CONTROLLERS + 3) }
  local all, strips = host.file.exists(SCORES) and host.json.decode(read(SCORES)) or {}, {}
  host.file.mkdir(KEPT)
  for _, name in ipairs(task_names()) do
    local results = all[name] or {}
    local best, score = take(folder, name, results)
    if best then
      all[name] = results
      add_rows(lines, name, results)
      run_limax { "picture", best, "--view", "iso", "--width", tostring(STRIP), "--out",
        ("%s/%s.png"):format(KEPT, name) }
      strips[#strips + 1] = ("\n`%s`: the best of all, %s, with a score of %.2f\n\n![%s]("
        .. "baselines/%s.png)\n"):format(name, best:match "-(%l+)%.json$", score, name, name)
    end
  end
  write(SCORES, host.json.encode(all) .. "\n")
  local page = read(PAGE)
  local _, from = page:find(FROM, 1, true)
  write(PAGE, page:sub(1, from) .. table.concat(lines, "\n") .. "\n" .. table.concat(strips)
    .. page:sub((page:find(TO, 1, true))))
end

-- A page of the best robots of a task in the viewer of the report.
local function write_page(folder, name)
  local shown = {}
  for _, controller in ipairs(CONTROLLERS) do
    local path = ("%s/%s-%s.json"):format(KEPT, name, controller)
    if host.file.exists(path) == "file" then
      local walker = robot(path)
      local walked = assert(motion.simulate(walker, { device = "cpu",
        trial = walker.description.trials and 1 }))
      shown[#shown + 1] = { name = ("%s, %s"):format(name, controller), score = "first world",
        walked = walked }
    end
  end
  if #shown == 0 then return end
  local section = robots.side_by_side(shown)
  write(("%s/%s.html"):format(folder, name), html.page { title = name .. " - limax task",
    style = html.read "style.css",
    scripts = { html.read "charts.js", unpack(section.scripts) }, -- shows what scripts need
    body = ("<main><h1>%s</h1>\n%s</main>\n"):format(name, section.body) })
end

local action, folder, repetitions, names = unpack(arg)
assert(folder and (action == "publish" or action == "pages" or action == "run" and names),
  "see the head of this script")
if action == "publish" then return publish(folder) end
host.file.mkdir(folder)
if action == "pages" then
  for _, name in ipairs(task_names()) do write_page(folder, name) end
  return
end
for _, path in ipairs { "/champions", "/scores", "/runs" } do host.file.mkdir(folder .. path) end
for name in names:gmatch "[^,]+" do
  host.file.mkdir(("%s/runs/%s"):format(folder, name))
  run_task(folder, name, repetitions, { unpack(arg, 5) })
end
experiments.idle = false -- none of those read is to be run
