--- replay.lua: `robot:replay()` simulates and scores a robot that was read from a file. The module
--- returns the robot library with this method and with robots of genomes, as `limax.robot`.

local engine = require "limax.engine"
local fault = require "limax.engine.fault"
local fitness = require "limax.fitness"
local output = require "limax.base.output"
local robot = require "limax.robot.robot"
local robot_of_genome = require "limax.experiment.robot_of_genome"
local schema = require "limax.engine.schema"
local scoring = require "limax.robot.scoring"
local source = require "limax.base.source"

local Robot = robot.methods
local OPTIONS = { fitness = true, state = true, device = true }
robot.describe_genome = robot_of_genome.describe

-- Converts a stored fitness for fitness.get: { name = "walk", axis = "x" } to
-- { "walk", axis = "x" }.
local function fitness_of(stored)
  if type(stored) ~= "table" then return stored end
  if stored["function"] or not stored.name then return nil end
  local spec = { stored.name }
  for key, value in pairs(stored) do
    if key ~= "name" then spec[key] = value end
  end
  return spec
end

--- Simulates a robot read from a file exactly as it was scored: same scene, settings and materials,
--- and, on the same build and kind of device, the same score to the bit. A file does not hold a
--- fitness that is a function of a script: pass that function, for instance from the copy of the
--- script in the run folder: `fitness = dofile("runs/mine-1/scripts/mine.lua").fitness.call`. If
--- that function reads a state, pass one too: a table, or a file of the run folder. The score is
--- the same only if the state is what it was when the robot was scored.
---@param options? { fitness?: any, state?: table|string, device?: string|limax.device }
---@return limax.scored_robot robot its `fitness` is set
---@return number|nil score the one in the file
function Robot:replay(options)
  options = options or {}
  schema.known(options, OPTIONS, "replay", function()
    return "; replay repeats what was: simulate { ... } changes it"
  end)
  local description = self.description
  if not description.scene or not description.simulation then
    engine.fail "replay: this robot has no scene of its own; use simulate { scene = ... }"
  end
  local replayed = self:simulate { device = options.device }
  local spec = options.fitness or fitness_of(description.fitness)
  if spec == nil and description.fitness ~= nil then
    local own = description.fitness["function"] or {}
    engine.fail(('replay: its fitness is the function at %s:%s, which a robot file does not hold;'
      .. ' pass it: replay { fitness = dofile("RUN/scripts/%s").fitness.call }, where RUN is the'
      .. ' folder of the run'):format(own.file, own.first_line, own.file))
  end
  if spec ~= nil and replayed.status == "done" then
    local call, state = fitness.get(spec).call, options.state
    if type(state) == "string" then state = assert(source.read_json(state)) end
    if state == nil and debug.getinfo(call, "u").nparams > 1 then
      engine.fail('replay: its fitness takes a state; pass it: replay { state = "RUN/r01/state/'
        .. 'gNNNN.json" }, the state after a generation, or a table')
    end
    local score, extra = call(replayed, state)
    replayed.row.fitness = score
    replayed.row.cases, replayed.row.measures = scoring.parts(extra)
    if options.fitness == nil and description.score and score ~= description.score then
      output.warn(("%s: replay: the score is %.9g, and the file's is %.9g: the file was"
        .. " edited, or another build or kind of device scored the robot\n"):format(
        fault.where(), score, description.score))
    end
  end
  return replayed, description.score
end

return robot
