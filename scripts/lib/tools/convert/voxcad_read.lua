--- voxcad_read.lua: a robot of VoxCad or voxcraft-sim (.vxa) as the table of a robot file.
--- SI units.

local body = require "limax.robot.body"
local document = require "limax.tools.convert.voxcad_document"
local engine = require "limax.engine"
local input = require "limax.tools.convert.input"
local robot_file = require "limax.robot.robot_file"
local voxcad = require "limax.tools.convert.voxcad_materials"

local at, number_at = document.at, document.number_at

local voxcad_read = {}

-- Numbers of every voxel [z][i], i = x + (y - 1) nx, each matching a pattern; nil without the
-- element.
local function numbers_of(file, structure, name, lattice, pattern)
  local found, count, layers = at(structure, name), lattice[1] * lattice[2], {}
  if not found then return nil end
  for z, layer in ipairs(document.children(found, "Layer")) do
    local list = {}
    for word in layer.text:gmatch(pattern or "[^%s,]+") do
      list[#list + 1] = document.number_of(word) or input.refuse(file,
        "Structure.%s: layer %d holds %q; expected numbers", name, z, word:sub(1, 40))
    end
    if #list ~= count then
      input.refuse(file, "Structure.%s: layer %d has %d numbers; X_Voxels times Y_Voxels is %d",
        name, z, #list, count)
    end
    layers[z] = list
  end
  if #layers ~= lattice[3] then
    input.refuse(file, "Structure.%s has %d layers; Z_Voxels is %d", name, #layers, lattice[3])
  end
  return layers
end

-- Indices into the palette [z][i], 0 where a voxel is empty.
local function indices_of(file, structure, lattice, materials)
  local layers = numbers_of(file, structure, "Data", lattice, "%S")
  if not layers then input.refuse(file, "Structure.Data is missing") end
  for z, layer in ipairs(layers) do
    for i, index in ipairs(layer) do
      if index > materials then
        input.refuse(file, "Structure.Data: layer %d, voxel %d is %d; expected 0 (empty) to %d", z,
          i, index, materials)
      end
    end
  end
  return layers
end

-- A list [z][y][x] of values of every voxel, by z and i.
local function grid_of(lattice, value)
  return body.grid({ lattice[3], lattice[2], lattice[1] }, function(z, y, x)
    return value(z, x + (y - 1) * lattice[1])
  end)
end

-- The phase (radians) and the material of every voxel [z][i]. A phase beyond half a period becomes
-- the opposite muscle, half a period earlier.
local function phases_of(offsets, indices, palette)
  local phases, used = {}, {}
  for z, layer in ipairs(indices) do
    phases[z], used[z] = {}, {}
    for i, index in ipairs(layer) do
      local material, periods = palette[index], offsets and offsets[z][i] or 0
      periods = periods - math.floor(periods)
      if periods > 0.5 and material and material.kind ~= "passive" then
        material, periods = voxcad.opposite_of(palette, material), periods - 0.5
      end
      phases[z][i], used[z][i] = 2 * math.pi * math.min(periods, 0.5), material
    end
  end
  -- a material's own largest phase holds only if no voxel exceeds it
  for z, layer in ipairs(used) do
    for i, material in pairs(layer) do
      if material.phase and phases[z][i] > material.phase * (1 + 1e-12) then
        material.phase = math.pi
      end
    end
  end
  return phases, used
end

-- Amplitude of the temperature, degrees, whether it varies, and its period, s.
local function temperature_of(file, root)
  local thermal = at(root, "Environment.Thermal")
  if not thermal then return 0, false end
  local function number(path, default) return number_at(file, thermal, path, default) end
  local varies = number("VaryTempEnabled", 0) ~= 0 and number("TempEnabled", 1) ~= 0
  local period, base = number("TempPeriod", 0.1), number("TempBase", 25)
  -- older files state the highest temperature
  local amplitude = number("TempAmplitude", number("TempAmp", base) - base)
  if varies and not (period > 0) then
    input.refuse(file, "Environment.Thermal.TempPeriod is %g; expected more than 0 s", period)
  end
  return amplitude, varies, period
end

local function scene_of(file, root, period, material)
  local environment = at(root, "Environment") or { name = "Environment" }
  local acceleration = number_at(file, environment, "Gravity.GravAcc", -9.81)
  local scene = { damping = true }
  if number_at(file, environment, "Gravity.GravEnabled", 0) ~= 0 then
    scene.gravity = { acceleration = { 0, 0, acceleration } }
  end
  if number_at(file, environment, "Gravity.FloorEnabled", 0) ~= 0 then
    scene.ground = true
    scene.friction = { static = material.static, kinetic = material.kinetic }
  end
  if period then scene.actuation = { frequency = voxcad.rounded(1 / period), ramp = 0 } end
  return input.about(file, engine.scene, scene):table()
end

-- Seconds of a StopConditionFormula t - seconds.
local function duration_of(file, root)
  local formula = at(root, "Simulator.StopCondition.StopConditionFormula.mtSUB")
  if formula and document.text_at(formula, "mtVAR") == "t" then
    return number_at(file, formula, "mtCONST")
  end
end

local function structure_of(file, root)
  local structure = at(root, "VXC.Structure")
  if not structure then input.refuse(file, "VXC.Structure is missing") end
  local compression = structure.attributes.Compression or "ASCII_READABLE"
  if compression ~= "ASCII_READABLE" then
    input.refuse(file, 'Structure: Compression is %q; expected "ASCII_READABLE"',
      compression:sub(1, 40))
  end
  local lattice = {}
  for axis, name in ipairs { "X_Voxels", "Y_Voxels", "Z_Voxels" } do
    lattice[axis] = number_at(file, structure, name)
  end
  input.check_lattice(file, lattice)
  return structure, lattice
end

local function note_losses(root, palette, notes)
  for _, name in ipairs(document.unread(root)) do notes[#notes + 1] = name end
  for _, material in ipairs(palette) do
    if material.static ~= palette[1].static or material.kinetic ~= palette[1].kinetic then
      notes[#notes + 1] = "uStatic and uDynamic of all materials but the first"
      break
    end
  end
  notes[#notes + 1] = "Simulator: all but a StopConditionFormula t - seconds"
end

--- Reads a robot.
---@param file string .vxa
function voxcad_read.read(file, notes)
  local root = document.open(file)
  local structure, lattice = structure_of(file, root)
  local edge = number_at(file, root, "VXC.Lattice.Lattice_Dim")
  if not (edge >= 1e-6 and edge <= 1e3) then
    input.refuse(file, "VXC.Lattice.Lattice_Dim is %g; expected 1e-6 to 1000 m", edge)
  end
  local amplitude, actuated, period = temperature_of(file, root)
  local palette = voxcad.read(file, root, edge, amplitude, actuated)
  local indices = indices_of(file, structure, lattice, #palette)
  local scene = scene_of(file, root, actuated and period, palette[1])
  local phases, used = phases_of(numbers_of(file, structure, "PhaseOffset", lattice), indices,
    palette)

  local weights = { stiffness = 1, amplitude = 1 }
  for _, each in ipairs(voxcad.WEIGHTS) do
    local numbers = numbers_of(file, structure, each[2], lattice)
    if numbers then
      weights[each[1]] = grid_of(lattice, function(z, i) return numbers[z][i] end)
    end
  end
  weights.phase = grid_of(lattice, function(z, i)
    local largest = used[z][i] and used[z][i].phase or math.pi
    return largest > 0 and math.min(phases[z][i] / largest, 1) or 0
  end)
  local voxels = grid_of(lattice, function(z, i) return used[z][i] and used[z][i].letter or "." end)
  for _, layer in ipairs(voxels) do
    for y, line in ipairs(layer) do layer[y] = table.concat(line) end
  end
  local duration = duration_of(file, root)
  note_losses(root, palette, notes)
  return { schema = robot_file.schema, lattice = lattice, edge = edge, voxels = voxels,
    weights = weights, materials = voxcad.table(palette), scene = scene,
    simulation = { edge = edge, duration = duration } }
end

return voxcad_read
