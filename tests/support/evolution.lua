--- evolution.lua: what the suites of the evolution loop share: a small experiment, and its run.

local limax = require "limax"

local evolution = {}

--- A small experiment with fields changed: a generation takes a few hundredths of a second.
function evolution.small(fields)
  local given = { fitness = "distance", lattice = { 2, 2, 2 }, population = 6, generations = 3,
    repetitions = 1, simulation = { duration = 0.4, settle = 0.1, accuracy = "preview" },
    supervisor = "fixed" }
  for name, value in pairs(fields or {}) do given[name] = value end
  return limax.experiment(given)
end

function evolution.silent() end

--- The history of a whole run, and the run.
function evolution.finished(fields, options)
  options = options or {}
  options.say = options.say or evolution.silent
  local run = limax.start(evolution.small(fields), options)
  return run:finish(), run
end

--- A finished run of three short generations of six robots.
---@param folder string
---@param fields? table of the experiment
---@return string folder
function evolution.run(folder, fields)
  local options = { simulation = { duration = 0.2, settle = 0.05, accuracy = "preview" } }
  for name, value in pairs(fields or {}) do options[name] = value end
  limax.start(evolution.small(options), { out = folder, say = evolution.silent }):finish()
  return folder
end

return evolution
