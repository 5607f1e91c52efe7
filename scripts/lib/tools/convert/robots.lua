--- robots.lua: a robot from whatever `limax convert` may be handed: a robot file, a file of another
--- program, or a run folder, which stands for its champion.

local body = require "limax.robot.body"
local defaults = require "limax.settings.defaults"
local engine = require "limax.engine"
local evogym = require "limax.tools.convert.evogym"
local failure = require "limax.base.failure"
local host = require "limax.host"
local input = require "limax.tools.convert.input"
local robot = require "limax.robot.robot"
local robot_file = require "limax.robot.robot_file"
local run_folder = require "limax.run.run_folder"
local schema = require "limax.base.schema"
local voxcad_read = require "limax.tools.convert.voxcad_read"

local robots = {}

local check_duration = schema.number(defaults.fields.simulation.duration)

local function ending_of(path) return (path:match "%.([%w]+)$" or ""):lower() end
robots.ending_of = ending_of

local function of_json(path, _, notes)
  local text = input.read(path)
  local lists = select(2, text:gsub("[%[{]", "%0"))
  if lists > input.MOST_LISTS then
    input.refuse(path, "has %d lists and objects; at most %d are read", lists, input.MOST_LISTS)
  end
  local decoded, message = host.json.decode(text, path)
  if decoded == nil then failure.raise(2, message) end
  if evogym.is_world(decoded) then return evogym.of_world(path, decoded, notes) end
  local description, wrong = robot_file.check(decoded)
  if not description then input.refuse(path, "%s", wrong) end
  return description
end

-- The champion of a run: of its last generation unless another is named.
local function champion_of(folder, options)
  local repetition = options.repetition or 1
  local kind = ("%s/r%02d/champions"):format(folder, repetition)
  local names = host.file.list(kind) or {}
  if #names == 0 then
    input.refuse(folder, "repetition %d has no champion", repetition)
  end
  local path = kind .. "/" .. names[#names]
  if options.generation then
    path = folder .. "/" .. run_folder.place(repetition, "champions", options.generation, ".json")
    if host.file.exists(path) ~= "file" then
      input.refuse(folder, "generation %d of repetition %d has no champion; legal are 0 to %d",
        options.generation, repetition, tonumber(names[#names]:match "%d+"))
    end
  end
  return of_json(path)
end

local READERS = {
  json = of_json,
  vxa = voxcad_read.read,
  vxd = voxcad_read.read,
  npy = evogym.read_npy,
  npz = evogym.read_npz,
}

--- Is this the folder of a run?
---@param path string
---@return boolean
function robots.is_run(path)
  return host.file.exists(path) == "folder" and run_folder.is_run(path)
end

--- Reads a robot; what is wrong ends the command with the file, the field and what is legal.
---@param path string
---@param options { base?: string, repetition?: integer, generation?: integer }
---@param notes string[] receives what limax cannot carry
---@return limax.robot
function robots.read(path, options, notes)
  local description
  if robots.is_run(path) then
    description = champion_of(path, options)
  else
    local reader = READERS[ending_of(path)]
    if not reader then
      local endings = {}
      for ending in pairs(READERS) do endings[#endings + 1] = "." .. ending end
      table.sort(endings)
      input.refuse(path, "its ending is no robot's; legal are %s and a run folder",
        table.concat(endings, ", "))
    end
    description = reader(path, options, notes)
  end
  local size, wrong = body.measure_layers(description.voxels,
    input.about(path, engine.materials, description.materials))
  if not size then input.refuse(path, "%s", wrong) end
  if description.scene then input.about(path, engine.scene, description.scene) end
  local duration = (description.simulation or {}).duration
  if duration ~= nil then
    duration, wrong = check_duration(duration, "robot.simulation.duration")
    if not duration then input.refuse(path, "%s", wrong) end
  end
  return input.about(path, robot.of, description)
end

return robots
