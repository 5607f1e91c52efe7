--- resume.lua: going on with a run folder: what differs between the configuration and scripts that
--- made it and those of now, which differences are refused, and which of the old scores still
--- stand.

local failure = require "limax.base.failure"
local flat = require "limax.base.flat"
local host = require "limax.host"
local run_configuration = require "limax.run.run_configuration"
local run_folder = require "limax.run.run_folder"
local source = require "limax.base.source"

local resume = {}

-- Genomes and bodies on disk mean nothing under another one of these.
local fixed_fields = { "genome", "lattice", "population", "seed" }

-- Changing these leaves what a score means as it was.
local scores_stand_under = { breeding = true, evaluations = true, generations = true, name = true,
  not_in_paper = true, repetitions = true, selection = true, supervision = true,
  supervisor = true }

-- Longest list of differing lines or fields that a message shows.
local most_shown = 12

--- Fields in which two configurations differ, the entry `run` left out, in alphabetical order.
---@param before table
---@param now table
---@return { path: string, before: string, now: string }[]
function resume.differences(before, now)
  -- one turn through JSON, so that both sides are what a file can hold
  now = host.json.decode(host.json.encode(now))
  local old, new = {}, {}
  for name, value in pairs(before) do
    if name ~= "run" then flat.add(value, name, old, flat.text) end
  end
  for name, value in pairs(now) do
    if name ~= "run" then flat.add(value, name, new, flat.text) end
  end
  return flat.differences(old, new)
end

local function split(text)
  local list = {}
  for line in (text:gsub("\n$", "") .. "\n"):gmatch "(.-)\n" do list[#list + 1] = line end
  return list
end

--- The lines in which two texts differ, between their common beginning and end.
---@param before string
---@param now string
---@return string[] "-12: text" for a line that is gone, "+12: text" for one that is new
function resume.line_differences(before, now)
  local old, new, list = split(before), split(now), {}
  local first, last_old, last_new = 1, #old, #new
  while first <= last_old and first <= last_new and old[first] == new[first] do
    first = first + 1
  end
  while last_old >= first and last_new >= first and old[last_old] == new[last_new] do
    last_old, last_new = last_old - 1, last_new - 1
  end
  for k = first, last_old do list[#list + 1] = ("-%d: %s"):format(k, old[k]) end
  for k = first, last_new do list[#list + 1] = ("+%d: %s"):format(k, new[k]) end
  return list
end

local function shorten(list)
  local more = #list - most_shown
  while #list > most_shown do table.remove(list) end
  if more > 0 then list[#list + 1] = ("... and %d more"):format(more) end
  return list
end

-- Changed, missing and new scripts, as lines of a message.
local function script_changes(folder, scripts)
  local list, kept, now = {}, {}, {}
  for _, copy in ipairs(folder.config.run.scripts) do kept[copy.file] = copy.sha256 end
  for _, copy in ipairs(scripts) do
    now[copy.file] = true
    if not kept[copy.file] then
      list[#list + 1] = ("  %s is new"):format(copy.file)
    elseif kept[copy.file] ~= copy.sha256 then
      list[#list + 1] = ("  %s has changed:"):format(copy.file)
      local before = source.read(folder.path .. "/scripts/" .. copy.file) or ""
      for _, line in ipairs(shorten(resume.line_differences(before, copy.text))) do
        list[#list + 1] = "    " .. line
      end
    end
  end
  for _, copy in ipairs(folder.config.run.scripts) do
    if not now[copy.file] then list[#list + 1] = ("  %s is gone"):format(copy.file) end
  end
  return list
end

--- The script to load: where it was, else the copy in the folder.
---@param folder limax.run_folder
---@return string path
---@return string|nil note
function resume.script(folder)
  local run = folder.config.run
  if run.path and host.file.exists(run.path) == "file" then return run.path end
  local copy = run.script and folder.path .. "/scripts/" .. run.script
  if copy and host.file.exists(copy) == "file" then
    return copy, ("%s is gone; going on with the copy %s"):format(run.path, copy)
  end
  failure.raise(2, folder.path .. " was not started from a script that returns an experiment,"
    .. " so it cannot be continued")
end

---@class limax.resume.verdict
---@field changed boolean does anything differ?
---@field text string what, one line per difference
---@field scores_stand boolean do old scores still mean the same?

--- Compares a run folder with the experiment of now. Refuses what cannot be continued (status 2):
--- any difference unless `allowed`, and one of genome, lattice, population or seed always.
---@param folder limax.run_folder
---@param config table configuration of now
---@param scripts table[] scripts of now
---@param allowed boolean --changed was given
---@param switch? string what would allow it; "--changed" if left out
---@return limax.resume.verdict
function resume.judge(folder, config, scripts, allowed, switch)
  local fields = resume.differences(folder.config, config)
  local list, scores_stand = {}, true
  for _, field in ipairs(fields) do
    list[#list + 1] = ("  %s: was %s, is %s"):format(field.path, field.before, field.now)
    local top = field.path:match "^[^%.]+"
    if not scores_stand_under[top] then scores_stand = false end
    for _, name in ipairs(fixed_fields) do
      if top == name then
        failure.raise(2, ("%s cannot go on with another %s (%s: was %s, is %s)")
          :format(folder.path, name, field.path, field.before, field.now))
      end
    end
  end
  shorten(list)
  local changes = script_changes(folder, scripts)
  -- a changed script may hold a changed fitness
  if #changes > 0 then scores_stand = false end
  for _, line in ipairs(changes) do list[#list + 1] = line end
  local text = table.concat(list, "\n")
  if #list > 0 and not allowed then
    failure.raise(2, ("%s was made by another configuration or script:\n%s\n%s goes on"
      .. " with the new one"):format(folder.path, text, switch or "--changed"))
  end
  return { changed = #list > 0, text = text, scores_stand = scores_stand }
end

--- Opens the folder of a repetition that a script computes by itself, cut to its last whole
--- generation.
---@param path string
---@param experiment limax.experiment
---@param repetition integer
---@param allowed boolean may configuration and script differ?
---@return limax.run_folder
---@return limax.resume.verdict
function resume.open(path, experiment, repetition, allowed)
  local folder = run_folder.open(path)
  local before = folder.config.run.repetition
  if before ~= repetition then
    failure.raise(2, ("%s holds %s, not repetition %d"):format(path,
      before and "repetition " .. before or "all repetitions", repetition))
  end
  local config, scripts = run_configuration.of(experiment, { repetition = repetition })
  local verdict = resume.judge(folder, config, scripts, allowed, "changed = true")
  folder:continue(config, scripts, verdict)
  folder:status "running"
  return folder, verdict
end

return resume
