--- robots.lua: robots that `limax convert` reads: robot files, champions of runs, and the checks of
--- descriptions from any format.

local body = require "limax.robot.body"
local defaults = require "limax.settings.defaults"
local engine = require "limax.engine"
local evogym = require "limax.tools.convert.evogym"
local failure = require "limax.base.failure"
local host = require "limax.host"
local input = require "limax.tools.convert.input"
local robot = require "limax.robot.robot"
local robot_file = require "limax.robot.robot_file"
local runs = require "limax.tools.report.runs"
local schema = require "limax.engine.schema"

local robots = {}

local check_duration = schema.number(defaults.fields.simulation.duration)

--- Reads a robot file, or a world of EvoGym.
function robots.read_json(path, _, notes)
  local decoded, message = host.json.decode(input.read(path), path)
  if decoded == nil then failure.raise(2, message) end
  if evogym.is_world(decoded) then return evogym.of_world(path, decoded, notes) end
  local description
  description, message = robot_file.check(decoded)
  if not description then input.refuse(path, "%s", message) end
  return description
end

--- The file of a champion, of the last generation if none is named.
---@param folder string of a run
---@param options { repetition?: integer, generation?: integer }
function robots.champion(folder, options)
  local repetition = options.repetition or 1
  for _, run in ipairs(runs.read(folder).runs) do
    local last = #run.lines - 1
    local line = run.lines[(options.generation or last) + 1]
    if run.repetition == repetition and line then return runs.champion(run, line) end
    if run.repetition == repetition then
      input.refuse(folder, "generation %d of repetition %d has no champion; expected 0 to %d",
        options.generation, repetition, last)
    end
  end
  input.refuse(folder, "repetition %d has no champion", repetition)
end

--- A robot of a description, checked.
function robots.of(path, description)
  local size, message = body.measure_layers(description.voxels,
    input.about(path, engine.materials, description.materials))
  if not size then input.refuse(path, "%s", message) end
  if description.scene then input.about(path, engine.scene, description.scene) end
  local duration = (description.simulation or {}).duration
  message = duration and select(2, check_duration(duration, "robot.simulation.duration"))
  if message then input.refuse(path, "%s", message) end
  return input.about(path, robot.of, description)
end

return robots
