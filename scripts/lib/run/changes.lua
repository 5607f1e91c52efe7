--- changes.lua: the generations from which a run, continued by `--changed`, had other fields that
--- decide what a score means: scores before and after cannot be compared.

local config = require "limax.run.config"
local failure = require "limax.base.failure"
local flat = require "limax.base.flat"
local journal = require "limax.run.journal"
local settings = require "limax.settings.settings"
local source = require "limax.base.source"
local terminal = require "limax.base.terminal"

local changes = {}

-- Longest list of fields that a message shows.
local MOST_SHOWN = 4

---@class limax.run.change
---@field generation integer the first one after the change; there may be none yet
---@field fields string[] their paths: "fitness", "simulation.duration"

-- A function is compared by its text, not by its lines.
local function shown(value)
  local is_function = type(value) == "table" and type(value.sha256) == "string" and value.first_line
  if is_function then return value.sha256 end
  return flat.text(value)
end

local function scored_fields(made)
  local fields = {}
  for name, value in pairs(made) do
    if config.is_scored(name) then flat.add(value, name, fields, shown) end
  end
  return fields
end

-- A configuration that the journal names.
local function config_of(read, begin)
  if begin.config_hash == read.config_hash then return read.config end
  local path = read.path .. "/" .. begin.config
  local text, message = source.read_own(path)
  if not text then failure.raise_damaged(message) end
  if config.hash(text) ~= begin.config_hash then
    failure.raise_damaged(("%s does not match its hash in %s"):format(path, journal.FILE))
  end
  local made, problem = config.parse(text, "")
  if made then return made end
  failure.raise_damaged(("%s: %s"):format(path, (problem:gsub("^: ", ""):gsub("%c", "?"))))
end

--- The fields that change what a score means from one configuration to another, without those below
--- another one ("fitness" before "fitness.function"), or that another tier sets.
---@return string[]
function changes.between(before, now)
  local paths, of_tier = {}, {}
  for _, name in ipairs(before.simulation.accuracy ~= now.simulation.accuracy
    and settings.of_tier or {}) do
    of_tier["simulation." .. name] = true
  end
  for _, each in ipairs(flat.differences(scored_fields(before), scored_fields(now))) do
    local path, above = terminal.word(each.path), paths[#paths]
    local is_below = above and path:sub(1, #above + 1) == above .. "."
    if not is_below and not of_tier[path] then paths[#paths + 1] = path end
  end
  return paths
end

--- The changes in a repetition, oldest first. One after its last generation counts: the
--- configuration in force is not that of its scores.
---@param read limax.run.reader
---@return limax.run.change[]
function changes.of(read, repetition)
  local list, by_hash, before = {}, {}, nil
  local entries, begins = read.journal, read.journal.begins
  for generation = 0, read:last(repetition) + 1 do
    local entry = entries:entry(repetition, generation)
    local begin = entry and entries.begin_of[entry] or begins[#begins]
    if before and begin.config_hash ~= before.config_hash then
      for _, each in ipairs { before, begin } do
        by_hash[each.config_hash] = by_hash[each.config_hash] or config_of(read, each)
      end
      local fields = changes.between(by_hash[before.config_hash], by_hash[begin.config_hash])
      if fields[1] then list[#list + 1] = { generation = generation, fields = fields } end
    end
    before = begin
  end
  return list
end

--- The changed fields: "fitness, simulation.duration".
---@param change limax.run.change
function changes.names(change)
  local more = #change.fields - MOST_SHOWN
  return table.concat(change.fields, ", ", 1, math.min(#change.fields, MOST_SHOWN))
    .. (more > 0 and (" and %d more"):format(more) or "")
end

--- A list of changes: "fitness from generation 4 on; scene.drag from generation 7 on".
---@param list limax.run.change[]
function changes.text(list)
  local texts = {}
  for k, change in ipairs(list) do
    texts[k] = ("%s from generation %d on"):format(changes.names(change), change.generation)
  end
  return table.concat(texts, "; ")
end

return changes
