--- limax.lua: the result of `require "limax"`, the public interface of the library. Modules are
--- loaded when they are first used; an unknown name raises with a suggestion.

local engine = require "limax.engine"
local host = require "limax.host"
local strict = require "limax.engine.strict"
local suggest = require "limax.engine.suggest"

-- the module of each public name, and the field of it
local public = {
  archive = { "limax.archive" },
  control = { "limax.control" },
  defaults = { "limax.settings.defaults" },
  diversity = { "limax.run.diversity" },
  encoding = { "limax.encoding" },
  experiment = { "limax.experiment.experiment" },
  fitness = { "limax.fitness" },
  rescore = { "limax.evolution.rescore" },
  robot = { "limax.experiment.replay" },
  scenes = { "limax.scenes" },
  selection = { "limax.selection" },
  start = { "limax.evolution.evolve", "start" },
  supervise = { "limax.supervise" },
  survival = { "limax.survival" },
  task = { "limax.experiment.task", "new" },
  test = { "limax.test" },
  variation = { "limax.variation" },
}

---@class limax
---@field version string of limax
---@field home string folder of scripts, materials and prompts
---@field engine limax.engine the low-level objects
---@field archive table archives by name
---@field control table controllers by name, as a scene's `control` takes them
---@field defaults table every default of an experiment
---@field diversity table measures of how different the robots of a population are
---@field encoding table encodings by name
---@field experiment fun(spec: table): limax.experiment checks and completes an experiment
---@field fitness table fitness functions by name
---@field rescore table robots of a population scored again under another accuracy
---@field robot fun(description: table|string): limax.robot a robot by hand, or from a robot file
---@field scenes table ready scenes
---@field selection table selection schemes by name
---@field start fun(experiment: limax.experiment, options: table|nil): table a run, looped by hand
---@field supervise table supervisors by name
---@field survival table survival schemes by name
---@field task fun(spec: table): limax.experiment an experiment with a score to reach for
---@field test table suites of scripted regressions
---@field variation table mutations and crossovers by name
local limax = { version = host.version, home = host.home, engine = engine }

local names = { "version", "home", "engine" }
for name in pairs(public) do names[#names + 1] = name end
table.sort(names)

return setmetatable(limax, {
  -- the public names, for completion and help
  __fields = names,
  __index = function(self, name)
    local place = public[name]
    if not place then
      engine.fail(("limax has no %q%s"):format(tostring(name), suggest.ending(name, names)))
    end
    local value = require(place[1])
    if place[2] then value = value[place[2]] end
    rawset(self, name, value)
    return value
  end,
  __newindex = strict.read_only("limax", "keep your own values in local variables"),
})
