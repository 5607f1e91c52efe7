--- run_configuration.lua: what a run folder stores of its experiment: configuration, options of
--- the run, and copies of the scripts.

local failure = require "limax.base.failure"
local host = require "limax.host"
local source = require "limax.base.source"

local run_configuration = {}

-- Changing these does not affect scores.
local UNSCORED = { breeding = true, evaluations = true, generations = true, name = true,
  not_in_paper = true, record_population = true, repetitions = true, run = true, schema = true,
  selection = true, supervision = true, supervisor = true, survival = true }

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
---@param options { repetition: integer|nil, overrides: string[]|nil,
--- own_loop: true|nil }
---@return table config
---@return table[] scripts file, path, sha256, text
function run_configuration.of(experiment, options)
  local config = source.copy(experiment.config)
  local scripts, kept = copies(experiment), host.json.array {}
  local script
  for i, copy in ipairs(scripts) do
    kept[i] = { file = copy.file, sha256 = copy.sha256 }
    if copy.path == experiment.origin then script = copy.file end
  end
  config.run = { repetition = options.repetition, path = experiment.origin, script = script,
    scripts = kept, overrides = host.json.array(options.overrides or {}),
    own_loop = options.own_loop }
  return config, scripts
end

--- A hash of what affects the scores: fields of the configuration, and the texts of all scripts,
--- since any of them may hold a part of the fitness.
---@return string
function run_configuration.scored_by(config)
  local scored = { scripts = host.json.array {} }
  for name, value in pairs(config) do
    if not UNSCORED[name] then scored[name] = value end
  end
  for i, script in ipairs(config.run.scripts) do scored.scripts[i] = script.sha256 end
  return host.xxh3(host.json.encode(scored))
end

return run_configuration
