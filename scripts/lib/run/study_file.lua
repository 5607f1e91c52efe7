--- study_file.lua: study.json, which lists the runs of a sweep or a study below its folder. It is
--- sealed: the script that it names takes effect only under the user's own seal.

local failure = require "limax.base.failure"
local host = require "limax.host"
local record_rules = require "limax.settings.record_rules"
local records = require "limax.settings.records"
local seal = require "limax.base.seal"
local source = require "limax.base.source"

local study_file = {}

study_file.NAME = "study.json"

local rule = record_rules.rule(records.study)

--- Does a folder have a study?
function study_file.exists(folder)
  return host.file.exists(folder .. "/" .. study_file.NAME) == "file"
end

-- Is a run reached through a link?
local function has_link(folder, path)
  local place = folder
  for part in path:gmatch "[^/]+" do
    place = place .. "/" .. part
    if host.file.exists(place, true) == "other" then return true end
  end
  return false
end

--- Reads the study of a folder.
---@return table study
---@return "own"|"other"|"edited"|"none" owner
---@return string|nil key name of the key that sealed it
function study_file.read(folder)
  local path, seen = folder .. "/" .. study_file.NAME, {}
  source.refuse_links(folder, 1)
  local text, message = source.read_own(path)
  if not text then failure.raise_damaged(message) end
  local study, owner, key = seal.open(text, "")
  local problem
  if type(study) ~= "table" then
    problem = study == nil and owner:gsub("^: ", "") or "expected a JSON object"
  else
    problem = select(2, rule(study, ""))
  end
  for k, run in ipairs(not problem and study.runs or {}) do
    if has_link(folder, run.path) then
      problem = ("runs[%d].path: expected a folder below this one, without links"):format(k)
    elseif seen[run.path] then
      problem = ("runs[%d].path: is that of runs[%d] too"):format(k, seen[run.path])
    end
    seen[run.path] = k
  end
  if problem then failure.raise_damaged(("%s: %s"):format(path, (problem:gsub("%c", "?")))) end
  return study, owner, key
end

--- Writes the study of a folder, sealed.
---@param study { script: table|nil, runs: table[] }
function study_file.write(folder, study)
  study.schema, study.seal = "limax.study/2", nil
  source.write(folder .. "/" .. study_file.NAME, seal.add(study))
end

return study_file
