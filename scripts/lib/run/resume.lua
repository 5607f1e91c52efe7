--- resume.lua: continuing a run folder: how its configuration and scripts differ from the current
--- ones, and which differences are refused.

local changes = require "limax.run.changes"
local config = require "limax.run.config"
local failure = require "limax.base.failure"
local flat = require "limax.base.flat"
local host = require "limax.host"
local run_folder = require "limax.run.folder"
local scripts = require "limax.run.scripts"

local resume = {}

-- If one of these changes, the genomes and bodies on disk are meaningless.
local fixed_fields = { genome = true, islands = true, lattice = true, population = true,
  seed = true }

-- Longest list of differing fields that a message shows.
local most_shown = 12

local function flatten(made)
  local texts = {}
  for name, value in pairs(made) do
    if name ~= "run" then flat.add(value, name, texts, flat.text) end
  end
  return texts
end

--- Fields in which two configurations differ, except those of `run`, in alphabetical order.
function resume.differences(before, now)
  -- through JSON, so that both sides have the types of a file
  return flat.differences(flatten(before), flatten(host.json.decode(host.json.encode(now))))
end

-- Adds a script that has another text than its copy to the lines of a message.
local function add_change(lines, folder, file)
  lines[#lines + 1] = ("  %s has changed: the run has %s/%s"):format(file, folder:scripts_path(),
    file)
end

-- Adds changed, missing and new scripts to the lines of a message.
local function add_script_changes(lines, folder, current)
  local kept, now = {}, {}
  for _, copy in ipairs(folder.config.run.scripts) do kept[copy.file] = copy.sha256 end
  for _, copy in ipairs(current) do
    now[copy.file] = true
    if not kept[copy.file] then
      lines[#lines + 1] = ("  %s is new"):format(copy.file)
    elseif kept[copy.file] ~= copy.sha256 then
      add_change(lines, folder, copy.file)
    end
  end
  for _, copy in ipairs(folder.config.run.scripts) do
    if not now[copy.file] then lines[#lines + 1] = ("  %s is gone"):format(copy.file) end
  end
end

local function refuse_changes(folder, lines, switch)
  failure.raise(2, ("%s was made by another configuration or script:\n%s\n%s continues with the"
    .. " new one"):format(folder.path, table.concat(lines, "\n"), switch or "--changed"))
end

---@class limax.resume.comparison
---@field changed boolean does anything differ?
---@field text string one line per difference

-- Compares a run folder with the current experiment. Refuses what cannot be continued (status 2):
-- any difference unless `allowed`, and one of `fixed_fields` always.
local function compare(folder, made, current, allowed, switch)
  local list, lines = {}, {}
  for k, field in ipairs(resume.differences(folder.config, made)) do
    list[k] = ("%s: was %s, is %s"):format(field.path, field.before, field.now)
    local top = field.path:match "^[^%.]+"
    if fixed_fields[top] then
      failure.raise(2, ("%s cannot be continued with another %s (%s)")
        :format(folder.path, top, list[k]))
    end
  end
  for k = 1, math.min(#list, most_shown) do lines[k] = "  " .. list[k] end
  local more = #list - most_shown
  if more > 0 then lines[#lines + 1] = ("  ... and %d more"):format(more) end
  add_script_changes(lines, folder, current)
  local names = changes.between(folder.config, host.json.decode(host.json.encode(made)))
  if names[1] then
    lines[#lines + 1] = ("  scores before and after cannot be compared, since %s changed; `limax"
      .. " compare` refuses such a run"):format(changes.names { fields = names })
  end
  if #lines > 0 and not allowed then refuse_changes(folder, lines, switch) end
  return { changed = #lines > 0, text = table.concat(lines, "\n") }
end

--- Refuses a folder whose original scripts differ from those that ran, before any of them runs.
function resume.check_scripts(folder)
  local path, is_original = scripts.chosen(folder)
  local lines = {}
  for _, file in ipairs(is_original and scripts.changed(path, folder.config.run.scripts) or {}) do
    add_change(lines, folder, file)
  end
  if lines[1] then refuse_changes(folder, lines) end
end

--- Cuts a folder to its last generation and stores the current configuration.
---@param options { repetition: integer|nil, overrides: string[]|nil, from: integer|nil } of the
--- run; `from` is the last generation to keep
---@param allowed boolean may configuration and script differ?
---@param switch? string what would allow it
function resume.continue(folder, experiment, options, allowed, switch)
  local made, current = config.of(experiment, options)
  local comparison = compare(folder, made, current, allowed, switch)
  folder:continue(made, current, comparison.changed, options.from)
  return comparison
end

--- Opens the folder of a repetition that a script computes by itself, and continues it.
function resume.open(path, experiment, repetition, allowed, from)
  local folder = run_folder.open(path)
  local before = folder.config.run.repetition
  if before ~= repetition then
    failure.raise(2, ("%s holds %s, not repetition %d%s"):format(path,
      before and "repetition " .. before or "all repetitions", repetition,
      before and "" or "; limax run --resume continues it"))
  end
  resume.continue(folder, experiment, { repetition = repetition, from = from, own_loop = true },
    allowed, "changed = true")
  return folder
end

return resume
