--- runs.lua: what `limax report`, `watch` and `list` read of a run folder: whole lines of its
--- files, in whatever state the run is. Nothing is locked and nothing is written, so that a run
--- that goes on does not notice.

local arms = require "limax.tools.compare.arms"
local choice = require "limax.base.choice"
local compare_runs = require "limax.tools.compare.runs"
local failure = require "limax.base.failure"
local host = require "limax.host"
local run_folder = require "limax.run.run_folder"
local run_lines = require "limax.run.run_lines"
local robot_file = require "limax.robot.robot_file"
local shape = require "limax.tools.report.shape"
local source = require "limax.base.source"

local runs = {}

---@class limax.report.run one repetition of a run folder
---@field path string of its folder
---@field name string of the experiment
---@field seed string
---@field repetition integer
---@field config table
---@field status table of STATUS
---@field lines table[] metrics, generation by generation
---@field ledger table[] likewise
---@field timing table[] likewise
---@field evaluations integer so far, `before` included
---@field before integer that a study spent on tuning, which is not in the folder

---@class limax.report.folder
---@field path string
---@field config table
---@field status table
---@field environment table
---@field runs limax.report.run[] those that have a generation

-- The value of a JSON file; nil, message where it is not there or not whole.
local function json_of(path)
  local text, message = source.read(path)
  if not text then return nil, message end
  return host.json.decode(text, path)
end

-- Adds the whole lines of a file to `by_repetition`. A last line without its end is being written.
local function add_lines(path, kind, by_repetition)
  local text, count = source.read(path), 0
  for line in (text or ""):gmatch "([^\n]*)\n" do
    count = count + 1
    local value, message = host.json.decode(line)
    local repetition, generation
    if type(value) == "table" then repetition, generation = shape.place(value) end
    if not repetition then
      failure.raise(1, ("%s, line %d: %s"):format(path, count, generation
        or message and message:gsub("^.-line 1, ", "") or "expected a JSON object"))
    end
    local list = by_repetition[repetition] or {}
    by_repetition[repetition] = list
    -- a line that is moved to its place stands in two files for a moment
    if not list[generation + 1] then list[#list + 1] = shape[kind](value) end
  end
end

-- Lines of one kind by repetition, those that wait for their turn included.
local function lines_of(path, kind)
  local by_repetition = {}
  add_lines(("%s/%s.jsonl"):format(path, kind), kind, by_repetition)
  for _, name in ipairs(host.file.list(path) or {}) do
    local repetition = tonumber(name:match "^r(%d+)$")
    if repetition then
      add_lines(("%s/%s/%s.jsonl"):format(path, run_lines.folder_of(repetition), kind),
        kind, by_repetition)
    end
  end
  return by_repetition
end

--- Is this path a run folder?
---@param path string
---@return boolean
function runs.is_folder(path) return host.file.exists(path .. "/config.json") == "file" end

--- A run folder as it is now.
---@param path string
---@return limax.report.folder
function runs.read(path)
  path = #path > 1 and path:gsub("/+$", "") or path
  local config, message = json_of(path .. "/config.json")
  if not config then
    failure.raise(2, ("%s is no run folder: %s"):format(path, tostring(message)))
  end
  if type(config) ~= "table" or config.schema ~= "limax.config/1" then
    failure.raise(2, ("%s/config.json: expected schema limax.config/1, got %s"):format(path,
      tostring(type(config) == "table" and config.schema)))
  end
  config = shape.config(config)
  local folder = { path = path, config = config, runs = {},
    status = shape.status(json_of(path .. "/STATUS")),
    environment = shape.environment(json_of(path .. "/environment.json")) }
  folder.status.state = folder.status.state or "unknown"
  local metrics, ledger = lines_of(path, "metrics"), lines_of(path, "ledger")
  local timing = lines_of(path, "timing")
  for _, repetition in ipairs(choice.sorted_keys(metrics)) do
    local evaluations = 0
    for _, line in ipairs(metrics[repetition]) do evaluations = evaluations + line.evaluations end
    table.insert(folder.runs, { path = path, name = config.name or shape.word(source.name_of(path)),
      config = config, seed = tostring(config.seed or "-"), repetition = repetition,
      status = folder.status, lines = metrics[repetition], ledger = ledger[repetition] or {},
      timing = timing[repetition] or {}, evaluations = evaluations, before = 0 })
  end
  return folder
end

-- The runs of a study that have begun, and what the study says of each.
local function add_study(list, word)
  local path = word .. "/" .. compare_runs.STUDY
  local study, message = json_of(path)
  if type(study) ~= "table" or type(study.runs) ~= "table" then
    failure.raise(2, message or path .. ": expected an object with a list of runs")
  end
  for k, given in ipairs(study.runs) do
    if type(given) ~= "table" or type(given.path) ~= "string" then
      failure.raise(2, ("%s: runs[%d]: expected an object with a path"):format(path, k))
    end
    if runs.is_folder(word .. "/" .. given.path) then
      local folder = runs.read(word .. "/" .. given.path)
      for _, run in ipairs(folder.runs) do
        run.arm, run.before = given.arm, given.tuning_evaluations or 0
        run.donor = given.donor
        run.evaluations = run.evaluations + run.before
      end
      list[#list + 1] = folder
    end
  end
end

--- The run folders that these words name; a study's folder stands for its runs, those that have
--- begun.
---@param words string[]
---@return limax.report.folder[]
function runs.read_all(words)
  local list = {}
  for _, word in ipairs(words) do
    word = #word > 1 and word:gsub("/+$", "") or word
    if host.file.exists(word .. "/" .. compare_runs.STUDY) == "file" then
      add_study(list, word)
    else
      list[#list + 1] = runs.read(word)
    end
  end
  return list
end

---@class limax.report.arm
---@field name string
---@field runs limax.report.run[]

--- Runs as arms, as `limax compare` groups them; where it would refuse, each folder is an arm, and
--- the second result says why.
---@param folders limax.report.folder[]
---@return limax.report.arm[]
---@return string|nil message
function runs.arms(folders)
  local all = {}
  for _, folder in ipairs(folders) do
    for _, run in ipairs(folder.runs) do all[#all + 1] = run end
  end
  if #all == 0 then return {} end
  local fine, groups = failure.attempt(arms.group, all)
  if fine then
    for _, arm in ipairs(groups) do arm.name = shape.word(arm.name) end
    return groups
  end
  local list = {}
  for _, folder in ipairs(folders) do
    if #folder.runs > 0 then
      list[#list + 1] = { name = shape.word(source.name_of(folder.path)), runs = folder.runs }
    end
  end
  return list, failure.bare(groups)
end

--- The champion's score under the first materials where it is known.
---@param line table of metrics
---@return number
function runs.score(line) return line.best_standard or line.best end

--- The repetition whose last generation has the best score.
---@param list limax.report.run[]
---@return limax.report.run
function runs.leading(list)
  local found = list[1]
  for _, run in ipairs(list) do
    local score, best = runs.score(run.lines[#run.lines]), runs.score(found.lines[#found.lines])
    if score and (not best or score > best) then found = run end
  end
  return found
end

--- The robot file of a generation's champion.
---@param run limax.report.run
---@param line table of metrics
---@return string
function runs.champion(run, line)
  return run.path .. "/" .. run_folder.place(run.repetition, "champions", line.generation, ".json")
end

--- The champion of a generation as its robot file describes it; nil, message where the file is
--- missing or damaged.
---@param run limax.report.run
---@param line table of metrics
---@return limax.robot.description|nil
---@return string|nil message
function runs.description(run, line)
  local path = runs.champion(run, line)
  local value, message = json_of(path)
  if value == nil then return nil, message end
  value, message = robot_file.check(value)
  if not value then return nil, ("%s: %s"):format(path, message) end
  return value
end

return runs
