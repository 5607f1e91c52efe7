--- voxcad_read.lua: a robot from .vxa or .vxd of VoxCad and voxcraft-sim, as the table of a robot
--- file. SI units; voxcad.lua says how its materials become limax's.

local defaults = require "limax.settings.defaults"
local document = require "limax.tools.convert.voxcad_document"
local engine = require "limax.engine"
local failure = require "limax.base.failure"
local input = require "limax.tools.convert.input"
local robot_file = require "limax.robot.robot_file"
local schema = require "limax.base.schema"
local settings = require "limax.settings.settings"
local voxcad = require "limax.tools.convert.voxcad"
local voxcad_losses = require "limax.tools.convert.voxcad_losses"
local voxcad_palette = require "limax.tools.convert.voxcad_palette"

local at, child, text_of = document.at, document.child, document.text_of
local number_at = document.number_at

local voxcad_read = {}

local check_duration = schema.number(defaults.fields.simulation.duration)

-- ---- voxels -------------------------------------------------------------------------------------

local function layers_at(file, structure, name, lattice)
  local found = child(structure, name)
  local layers = {}
  for _, layer in ipairs(found or {}) do
    if layer.name == "Layer" then layers[#layers + 1] = layer.text end
  end
  if found and #layers ~= lattice[3] then
    input.refuse(file, "Structure.%s has %d layers; Z_Voxels is %d", name, #layers, lattice[3])
  end
  return found and layers
end

-- Indices of the palette [z][i], i = x + (y - 1) nx.
local function data_of(file, structure, lattice, materials)
  local layers = layers_at(file, structure, "Data", lattice)
  if not layers then input.refuse(file, "Structure.Data is missing") end
  local data = {}
  for z, text in ipairs(layers) do
    text = text:gsub("%s", "")
    if #text ~= lattice[1] * lattice[2] then
      input.refuse(file, "Structure.Data: layer %d has %d voxels; X_Voxels times Y_Voxels is %d", z,
        #text, lattice[1] * lattice[2])
    end
    data[z] = {}
    for i = 1, #text do
      local index = text:byte(i) - 48
      if index < 0 or index > materials then
        input.refuse(file, "Structure.Data: layer %d, voxel %d is %q; legal are 0 (empty) to %d,"
          .. " the materials of the palette", z, i, text:sub(i, i), materials)
      end
      data[z][i] = index
    end
  end
  return data
end

-- Numbers of every voxel [z][i]; nil where the element is missing.
local function numbers_of(file, structure, name, lattice)
  local layers = layers_at(file, structure, name, lattice)
  if not layers then return nil end
  local grid, count = {}, lattice[1] * lattice[2]
  for z, text in ipairs(layers) do
    local list = {}
    for word in text:gmatch "[^%s,]+" do
      local value = tonumber(word)
      if not value or value ~= value or math.abs(value) == math.huge then
        input.refuse(file, "Structure.%s: layer %d holds %q; expected numbers", name, z,
          word:sub(1, 40))
      end
      list[#list + 1] = value
    end
    if #list ~= count then
      input.refuse(file, "Structure.%s: layer %d has %d numbers; X_Voxels times Y_Voxels is %d",
        name, z, #list, count)
    end
    grid[z] = list
  end
  return grid
end

-- ---- the whole ----------------------------------------------------------------------------------

-- Phases in radians [z][i] and the material of each voxel, by what a sine allows: a phase beyond
-- half a period is the opposite muscle's, half a period earlier.
local function phases_of(offsets, data, list, letters, names)
  local phases, used = {}, {}
  for z, layer in ipairs(data) do
    phases[z], used[z] = {}, {}
    for i, index in ipairs(layer) do
      local material, turn = list[index], offsets and offsets[z][i] or 0
      turn = turn - math.floor(turn)
      if turn > 0.5 and material and material.kind ~= "passive" then
        material, turn = voxcad_palette.twin_of(material, list, letters, names), turn - 0.5
      end
      phases[z][i], used[z][i] = 2 * math.pi * math.min(turn, 0.5), material
    end
  end
  -- a largest phase that is too small for a voxel is not this file's
  for z, layer in ipairs(used) do
    for i, material in pairs(layer) do
      if material.phase and phases[z][i] > material.phase * (1 + 1e-12) then
        material.phase = math.pi
      end
    end
  end
  return phases, used
end

-- Where the numbers of a scene come from, for messages.
local SOURCES = {
  ["gravity.acceleration"] = ": Environment.Gravity.GravAcc",
  ["friction.static"] = ": uStatic of VXC.Palette.Material 1",
  ["friction.kinetic"] = ": uDynamic of VXC.Palette.Material 1",
  ["actuation.frequency"] = ": 1 / Environment.Thermal.TempPeriod",
}

local function scene_of(file, root, swings, first)
  local environment = child(root, "Environment") or { name = "Environment" }
  local function number(path, default) return number_at(file, environment, path, default) end
  local scene = { damping = true }
  if number("Gravity.GravEnabled", 0) ~= 0 then
    scene.gravity = { acceleration = { 0, 0, number("Gravity.GravAcc", -9.81) } }
  end
  if number("Gravity.FloorEnabled", 0) ~= 0 then
    scene.ground = true
    scene.friction = { static = first.static, kinetic = first.kinetic }
  end
  if swings then
    local period = number("Thermal.TempPeriod", 0.1)
    if not (period > 0) then
      input.refuse(file, "Environment.Thermal.TempPeriod is %g; legal is above 0 s", period)
    end
    scene.actuation = { frequency = voxcad.rounded(1 / period), ramp = 0 }
  end
  local fine, made = failure.attempt(engine.scene, scene)
  if fine then return made:table() end
  local message = failure.bare(made)
  input.refuse(file, "%s%s", message, SOURCES[message:match "^scene%.([%w_.]+)"] or "")
end

-- Degrees by which the temperature swings, and whether it does.
local function swing_of(file, root)
  local thermal = at(root, "Environment.Thermal")
  if not thermal then return 0, false end
  local swings = number_at(file, thermal, "VaryTempEnabled", 0) ~= 0
    and number_at(file, thermal, "TempEnabled", 1) ~= 0
  if child(thermal, "TempAmplitude") then
    return number_at(file, thermal, "TempAmplitude"), swings
  end
  -- VoxCad's older files state the highest temperature
  local base = number_at(file, thermal, "TempBase", 25)
  return number_at(file, thermal, "TempAmp", base) - base, swings
end

-- Weights [z][y][x] from [z][i].
local function grid_of(lattice, value)
  local grid = {}
  for z = 1, lattice[3] do
    grid[z] = {}
    for y = 1, lattice[2] do
      grid[z][y] = {}
      for x = 1, lattice[1] do grid[z][y][x] = value(z, x + (y - 1) * lattice[1]) end
    end
  end
  return grid
end

--- Reads a robot. `notes` receives what limax cannot carry.
---@param path string .vxa or .vxd
---@param options { base: string|nil } the .vxa of a .vxd
---@param notes string[]
---@return limax.robot.description
function voxcad_read.read(path, options, notes)
  local root = document.open(path, options.base)
  local structure = at(root, "VXC.Structure")
  if not structure then input.refuse(path, "VXC.Structure is missing") end
  local compression = structure.attributes.Compression or "ASCII_READABLE"
  if compression ~= "ASCII_READABLE" then
    input.refuse(path, "Structure: Compression is %q; legal is \"ASCII_READABLE\"",
      compression:sub(1, 40))
  end
  local lattice = {}
  for axis, name in ipairs { "X_Voxels", "Y_Voxels", "Z_Voxels" } do
    lattice[axis] = number_at(path, structure, name)
  end
  input.check_lattice(path, lattice)
  local edge = number_at(path, root, "VXC.Lattice.Lattice_Dim")
  if not (edge >= 1e-6 and edge <= 1e3) then
    input.refuse(path, "VXC.Lattice.Lattice_Dim is %g; legal are 1e-6 to 1000 m", edge)
  end

  local swing, swings = swing_of(path, root)
  local list, letters, names = voxcad_palette.read(path, root, edge, swing,
    swings)
  local data = data_of(path, structure, lattice, #list)
  voxcad_losses.note(path, root, list, notes)
  local offsets = numbers_of(path, structure, "PhaseOffset", lattice)
  local scene = scene_of(path, root, swings, list[1])
  local before = #list
  local phases, used = phases_of(offsets, data, list, letters, names)
  if #list > voxcad.MOST_OF_LIMAX then
    input.refuse(path, "Structure.PhaseOffset: with the opposites of muscles whose phase is beyond"
      .. " half a period there are %d materials, %d without; limax holds up to %d", #list, before,
      voxcad.MOST_OF_LIMAX)
  end

  local weights = { stiffness = 1, amplitude = 1 }
  for _, each in ipairs(voxcad.WEIGHTS) do
    local grid = numbers_of(path, structure, each[2], lattice)
    if grid then
      weights[each[1]] = grid_of(lattice, function(z, i) return grid[z][i] end)
    end
  end
  weights.phase = grid_of(lattice, function(z, i)
    local most = used[z][i] and used[z][i].phase or math.pi
    return most > 0 and math.min(phases[z][i] / most, 1) or 0
  end)
  local voxels = {}
  for z = 1, lattice[3] do
    voxels[z] = {}
    for y = 1, lattice[2] do
      local line = {}
      for x = 1, lattice[1] do
        local material = used[z][x + (y - 1) * lattice[1]]
        line[x] = material and material.letter or "."
      end
      voxels[z][y] = table.concat(line)
    end
  end

  local simulation = { edge = edge }
  local formula = at(root, "Simulator.StopCondition.StopConditionFormula.mtSUB")
  if formula and text_of(formula, "mtVAR") == "t" then
    local wrong
    simulation.duration, wrong = check_duration(number_at(path, formula, "mtCONST"),
      "Simulator.StopCondition.StopConditionFormula")
    if wrong then input.refuse(path, "%s", wrong) end
  end
  return { schema = robot_file.schema, lattice = lattice, edge = edge, voxels = voxels,
    weights = weights, materials = voxcad_palette.table(list), scene = scene,
    simulation = input.about(path, settings.simulation_options, simulation) }
end

return voxcad_read
