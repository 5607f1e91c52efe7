--- input.lua: reads the input of `limax convert`: files of other programs, with errors that name
--- the file, the field and the valid range, champions of runs, and the checks of a robot of any
--- format.

local body = require "limax.robot.body"
local defaults = require "limax.settings.defaults"
local engine = require "limax.engine"
local failure = require "limax.base.failure"
local robot = require "limax.robot.robot"
local runs = require "limax.tools.report.runs"
local schema = require "limax.engine.schema"
local source = require "limax.base.source"

local input = {}

local check_duration = schema.number(defaults.fields.simulation.duration)

--- Most voxels of a lattice: a hundred along each axis.
input.MAX_VOXELS = 1e6

--- Ends the command with an error about a file. Control characters are not printed.
function input.refuse(path, pattern, ...)
  failure.raise(2, ("%s: %s"):format(path, (pattern:format(...):gsub("%c", "?"))))
end

function input.read(path)
  local text, message = source.read(path)
  if not text then failure.raise(2, ("%s (is it a folder?)"):format(message)) end
  return text
end

--- Calls a function; an error of it ends the command with the name of the file.
function input.about(path, call, ...)
  local succeeded, value = failure.attempt(call, ...)
  if succeeded then return value end
  local text = failure.bare(value)
  if text:sub(1, #path) == path then text = text:sub(#path + 3) end
  input.refuse(path, "%s", text)
end

--- Checks the size of a lattice.
---@param lattice integer[] voxels along x, y, z
function input.check_lattice(path, lattice)
  for axis, name in ipairs { "x", "y", "z" } do
    local count = lattice[axis]
    if count < 1 or count ~= math.floor(count) then
      input.refuse(path, "%s voxels along %s; expected a whole number from 1", count, name)
    end
  end
  if lattice[1] * lattice[2] * lattice[3] > input.MAX_VOXELS then
    input.refuse(path, "%g x %g x %g voxels; at most %d are read", lattice[1], lattice[2],
      lattice[3], input.MAX_VOXELS)
  end
end

--- The file of a champion: that of the run, if no generation is named.
---@param folder string of a run
---@param options { repetition?: integer, generation?: integer }
function input.champion(folder, options)
  local repetition = options.repetition or 1
  for _, run in ipairs(runs.read(folder).runs) do
    local line = runs.result(run)
    if options.generation then line = run.lines[options.generation + 1] end
    if run.repetition == repetition and line then return runs.champion(run, line) end
    if run.repetition == repetition then
      input.refuse(folder, "generation %d of repetition %d has no champion; expected 0 to %d",
        options.generation, repetition, #run.lines - 1)
    end
  end
  input.refuse(folder, "repetition %d has no champion", repetition)
end

--- A robot of a description, checked.
function input.robot_of(path, description)
  local size, message = body.measure_layers(description.voxels,
    input.about(path, engine.materials, description.materials))
  if not size then input.refuse(path, "%s", message) end
  if description.scene then input.about(path, engine.scene, description.scene) end
  local duration = (description.simulation or {}).duration
  message = duration and select(2, check_duration(duration, "robot.simulation.duration"))
  if message then input.refuse(path, "%s", message) end
  return input.about(path, robot.of, description)
end

return input
