--- config.lua: config.json of a run folder and its later versions: the resolved experiment, the
--- options of the run, and its scripts. It is sealed (base/seal.lua); each process that begins to
--- write the folder names it in the journal with the hash of its text.

local failure = require "limax.base.failure"
local host = require "limax.host"
local record_rules = require "limax.settings.record_rules"
local records = require "limax.settings.records"
local seal = require "limax.base.seal"
local source = require "limax.base.source"

local config = {}

local rule = record_rules.rule(records.run)

--- The first configuration of a folder; those that replace it are config-2.json, ...
config.FILE = "config.json"

-- Changing these does not affect scores.
local UNSCORED = { breeding = true, evaluations = true, generations = true, name = true,
  not_in_paper = true, record_population = true, repetitions = true, run = true, schema = true,
  selection = true, supervision = true, supervisor = true, survival = true }

--- Does this field of an experiment decide what a score means?
function config.is_scored(name) return not UNSCORED[name] and name ~= "record" end

-- Copies of the scripts, named by their path below the experiment's folder, or by the file's name.
local function copies(experiment)
  local base = experiment.origin and source.folder_of(experiment.origin) .. "/"
  local list, taken = {}, {}
  for _, path in ipairs(experiment.scripts) do
    local inside = base and path:find(base, 1, true) == 1
    local name = inside and path:sub(#base + 1) or source.name_of(path)
    while taken[name] do name = "_" .. name end
    taken[name] = true
    local text, message = source.read(path)
    if not text then failure.raise(1, message) end
    list[#list + 1] = { file = name, path = path, sha256 = host.sha256(text), text = text }
  end
  return list
end

--- The configuration that a run folder holds, and the scripts.
---@param options { repetition: integer|nil, overrides: string[]|nil, own_loop: true|nil }
---@return table config
---@return table[] scripts file, path, sha256, text
function config.of(experiment, options)
  local made = source.copy(experiment.config)
  local scripts, kept = copies(experiment), host.json.array {}
  local script
  for i, copy in ipairs(scripts) do
    kept[i] = { file = copy.file, sha256 = copy.sha256 }
    if copy.path == experiment.origin then script = copy.file end
  end
  made.schema = "limax.config/2"
  made.run = { repetition = options.repetition, path = experiment.origin, script = script,
    scripts = kept, overrides = host.json.array(options.overrides or {}),
    own_loop = options.own_loop }
  return made, scripts
end

--- The hash of a text of config.json, whoever sealed it.
function config.hash(text) return host.xxh3(seal.without(text)) end

--- Reads the text of a configuration.
---@param path string names it in messages
---@return table|nil config
---@return string owner "own", "other", "edited" or "none" of seal.open, or what is wrong
---@return string|nil key name of the key that sealed it
function config.parse(text, path)
  local found, owner, key = seal.open(text, path)
  if type(found) ~= "table" then return nil, found == nil and owner or "expected a JSON object" end
  local _, message = rule(found, "")
  if message then return nil, message end
  return found, owner, key
end

--- A hash of what affects the scores: fields of the configuration, and the texts of all scripts,
--- since any of them may hold a part of the fitness.
function config.scored_by(made)
  local scored = { scripts = host.json.array {} }
  for name, value in pairs(made) do
    if not UNSCORED[name] then scored[name] = value end
  end
  for _, script in ipairs(made.run.scripts) do
    -- a prompt affects no score
    if not script.file:match "%.md$" then table.insert(scored.scripts, script.sha256) end
  end
  return host.xxh3(host.json.encode(scored))
end

return config
