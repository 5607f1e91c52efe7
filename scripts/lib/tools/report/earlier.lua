--- earlier.lua: the robot that a command names: a robot file, the champion of a run folder, or any
--- robot of it by its id: its genes are in the files of its first generation, whose champion's file
--- has the world in which it was simulated.

local bytes = require "limax.base.bytes"
local failure = require "limax.base.failure"
local host = require "limax.host"
local robot = require "limax.robot.robot"
local robot_of_genome = require "limax.experiment.robot_of_genome"
local rows = require "limax.robot.rows"
local runs = require "limax.tools.report.runs"
local shell = require "limax.base.shell"
local stored = require "limax.tools.report.stored"

local earlier = {}

-- Refuses an encoding that only the script can express.
local function check_encoding(run, encoding)
  if type(encoding) ~= "table" then return end
  if encoding["function"] or encoding.express then
    failure.raise(1, ("%s: its encoding is a function of the script, which is not run here; in a"
      .. " loop of limax.start, run.history[generation + 1].population[index]:save(FILE) writes a"
      .. " robot"):format(run.path))
  end
  for _, part in pairs(encoding) do check_encoding(run, part) end
end

--- The description of a robot.
function earlier.robot(run, id)
  local config = run.config
  local generation = math.floor((id - 1) / config.population)
  local index, line = id - generation * config.population, run.lines[generation + 1]
  if not line then
    failure.raise(1, ("%s has no robot %d: it has 1 to %d"):format(run.path, id,
      #run.lines * config.population))
  end
  check_encoding(run, config.genome.encoding)
  local row = run.folder:rows(run.repetition, generation)[index]
  if not row or row.id ~= id then
    failure.raise(1, ("%s has no robot %d in generation %d"):format(run.path, id, generation))
  end
  local record = rows.record(row)
  local description, message = runs.description(run, line)
  if not description then failure.raise(1, message) end
  local genome, control = config.genome, {}
  local genomes = run.folder:genomes_of(run.repetition, generation, { [index] = true })
  local numbers = bytes.unpack("float", genomes[index])
  for k = #(description.control or {}), 1, -1 do control[k] = table.remove(numbers) end
  description.control = control[1] and control
  local body = genome.body and description or robot_of_genome.describe { genome = numbers,
    lattice = description.lattice, materials = description.materials, edge = description.edge,
    encoding = stored.spec_of(genome.encoding), features = genome.features, sigma = genome.sigma,
    hidden = genome.hidden, initial_scale = genome.initial_scale, seed = config.seed,
    repetition = run.repetition }
  description.voxels, description.weights = body.voxels, body.weights
  for _, name in ipairs { "id", "parents", "origin", "outcome" } do
    description[name] = record[name]
  end
  description.generation, description.score = generation, record.fitness
  return description
end

-- The robot of a file or folder: the path of a robot file, or a description; and its name.
local function source_of(word, id)
  if not runs.is_folder(word) then
    if host.file.exists(word) ~= "file" then
      failure.raise(2, word .. " is neither a robot file nor a run folder")
    elseif id then
      failure.raise(2, ("--robot: %s is a robot file; a run folder has several robots"):format(
        word))
    end
    return word, shell.path(word)
  end
  local folder = runs.read(word)
  if #folder.runs == 0 then failure.raise(1, word .. ": no generation has been scored yet") end
  local leading = runs.leading(folder.runs)
  if id then return earlier.robot(leading, id), ("robot %d of %s"):format(id, shell.path(word)) end
  local path = runs.champion(leading, runs.result(leading))
  return path, shell.path(path)
end

--- The robot of a robot file or of a run folder, whose champion it is without an id.
---@return limax.robot
---@return string name of it
function earlier.named(word, id)
  local from, name = source_of(word, id)
  local read, made = failure.attempt(id and robot.of or robot, from)
  if not read then failure.raise(1, failure.bare(made)) end
  return made, name
end

return earlier
