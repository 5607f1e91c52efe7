--- runs.lua: what `limax compare` reads: each repetition of each run folder, and the folders that a
--- study lists. Only runs that are done count: a run that is still going on has no last generation.

local choice = require "limax.base.choice"
local failure = require "limax.base.failure"
local host = require "limax.host"
local run_folder = require "limax.run.run_folder"
local source = require "limax.base.source"

local runs = {}

--- The file in which a study lists its run folders.
runs.STUDY = "study.json"

---@class limax.compare.given one run folder, and what only a study knows about it
---@field path string
---@field arm? string its name in the study
---@field before? integer evaluations spent on this run before its first generation (tuning)
---@field donor? string "parameters of another repetition of rules"

---@class limax.compare.run one repetition of a run
---@field path string of its folder
---@field seed string
---@field repetition integer
---@field config table
---@field lines table[] metrics, generation by generation
---@field ledger table[] likewise
---@field evaluations integer of the whole run, `before` included
---@field before integer
---@field arm string|nil
---@field donor string|nil

local function json_of(path)
  local text, message = source.read(path)
  local value
  if text then value, message = host.json.decode(text, path) end
  if value == nil then failure.raise(2, tostring(message)) end
  return value
end

-- The lines of a file, by repetition.
local function lines_of(path)
  local text, message = source.read(path)
  if not text then failure.raise(2, tostring(message)) end
  local by_repetition = {}
  for line in text:gmatch "[^\n]+" do
    local value, wrong = host.json.decode(line, path)
    if not value then failure.raise(2, tostring(wrong)) end
    by_repetition[value.repetition] = by_repetition[value.repetition] or {}
    table.insert(by_repetition[value.repetition], value)
  end
  return by_repetition
end

-- The folders that a study lists; it says itself which of them are not there yet.
local function of_study(path)
  local study, list, missing = json_of(path .. "/" .. runs.STUDY), {}, 0
  for _, each in ipairs(study.runs) do
    local folder = path .. "/" .. each.path
    local status = source.read(folder .. "/STATUS")
    local state = status and (host.json.decode(status) or {}).state
    if state ~= "done" then missing = missing + 1 end
    list[#list + 1] = { path = folder, arm = each.arm, before = each.tuning_evaluations,
      donor = each.donor }
  end
  if missing > 0 then
    failure.raise(2, ("%s: %d of its %d runs are not done; start the study again in this folder"
      .. " and it goes on"):format(path, missing, #list))
  end
  return list
end

--- Run folders from words: a study's folder stands for all its runs.
---@param words string[]
---@return limax.compare.given[]
function runs.expand(words)
  local list = {}
  for _, word in ipairs(words) do
    local path = #word > 1 and word:gsub("/+$", "") or word
    if host.file.exists(path .. "/" .. runs.STUDY) == "file" then
      for _, given in ipairs(of_study(path)) do list[#list + 1] = given end
    elseif host.file.exists(path .. "/config.json") == "file" then
      list[#list + 1] = { path = path }
    else
      failure.raise(2, ("%s is no run folder and no study: it has neither config.json nor %s")
        :format(path, runs.STUDY))
    end
  end
  return list
end

-- Whose parameters a run without a study repeats, as its ledger says: "parameters of random".
local function donor_of(ledger)
  local line = ledger and ledger[2]
  local reads = line and (line.supervisor == "yoked" or line.supervisor == "shuffled"
    or line.supervisor == "constant_median")
  local name = reads and (line.reason or ""):match "repetition %d+ of .+ %(([%w_]+)%)"
  return name and "parameters of " .. name or nil
end

--- Everything that the comparison needs of these folders, repetition by repetition.
---@param given limax.compare.given[]
---@return limax.compare.run[]
function runs.read(given)
  local list = {}
  for _, each in ipairs(given) do
    local path = each.path
    local config, status = json_of(path .. "/config.json"), json_of(path .. "/STATUS")
    if status.state ~= "done" then
      failure.raise(2, ("%s is not done (%s); only whole runs are compared"):format(path,
        tostring(status.state)))
    end
    local metrics, ledger = lines_of(path .. "/metrics.jsonl"), lines_of(path .. "/ledger.jsonl")
    for _, repetition in ipairs(choice.sorted_keys(metrics)) do
      local evaluations = each.before or 0
      for _, line in ipairs(metrics[repetition]) do evaluations = evaluations + line.evaluations end
      list[#list + 1] = { path = path, seed = tostring(config.seed), repetition = repetition,
        config = config, lines = metrics[repetition], ledger = ledger[repetition] or {},
        evaluations = evaluations, before = each.before or 0, arm = each.arm,
        donor = each.donor or donor_of(ledger[repetition]) }
    end
  end
  return list
end

--- The best of a generation under the run's first materials; nil where its champion did not end
--- well under them.
---@param line table of metrics.jsonl
---@return number|nil
function runs.score(line) return line.best_standard end

--- The champion of the last generation: a robot file.
---@param run limax.compare.run
---@return string
function runs.champion(run)
  return run.path .. "/" .. run_folder.place(run.repetition, "champions",
    run.lines[#run.lines].generation, ".json")
end

return runs
