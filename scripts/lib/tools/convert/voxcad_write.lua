--- voxcad_write.lua: a robot as .vxa (robot, materials and world) or .vxd (the robot alone) of
--- VoxCad and voxcraft-sim. What only limax has stands in elements that those leave out: Limax in
--- a material, StiffnessWeight and AmplitudeWeight beside PhaseOffset.

local choice = require "limax.base.choice"
local defaults = require "limax.settings.defaults"
local engine = require "limax.engine"
local input = require "limax.tools.convert.input"
local losses = require "limax.tools.convert.losses"
local palette = require "limax.draw.palette"
local voxcad = require "limax.tools.convert.voxcad"
local xml = require "limax.tools.convert.xml"

local voxcad_write = {}

-- As few digits as give the same number back.
local function number(value)
  local short = ("%.15g"):format(value)
  return tonumber(short) == value and short or ("%.17g"):format(value)
end

-- Lines of <name>value</name>.
local function fields(list)
  local lines = {}
  for i, field in ipairs(list) do
    local value = field[2]
    if type(value) == "number" then value = number(value) end
    lines[i] = ("<%s>%s</%s>"):format(field[1], value, field[1])
  end
  return table.concat(lines, "\n")
end

local function element(name, ...)
  return ("<%s>\n%s\n</%s>"):format(name, table.concat({ ... }, "\n"), name:match "^%S+")
end

-- ---- the world ----------------------------------------------------------------------------------

local CARRIED = { gravity = true, ground = true, friction = true, actuation = true, damping = true }

local function environment(scene, notes)
  local gravity = scene.gravity and scene.gravity.acceleration or { 0, 0, 0 }
  if gravity[1] ~= 0 or gravity[2] ~= 0 then
    notes[#notes + 1] = "scene.gravity: its parts along x and y"
  end
  if scene.ground and scene.ground.height ~= 0 then
    notes[#notes + 1] = "scene.ground.height: VoxCad's floor is at z = 0"
  end
  if scene.friction and not scene.ground then
    notes[#notes + 1] = "scene.friction: VoxCad's is that of its floor"
  end
  if not scene.damping then notes[#notes + 1] = "scene: that nothing damps; limax reads damping" end
  if scene.ground then notes[#notes + 1] = "scene.ground: stiffness and damping_ratio" end
  for _, name in ipairs(choice.sorted_keys(scene)) do
    if not CARRIED[name] then notes[#notes + 1] = "scene." .. name end
  end
  local actuation = scene.actuation
  if actuation and actuation.ramp ~= 0 then
    notes[#notes + 1] = "scene.actuation.ramp: muscles begin at once"
  end
  return element("Environment",
    element("Gravity", fields { { "GravEnabled", scene.gravity and 1 or 0 },
      { "GravAcc", gravity[3] }, { "FloorEnabled", scene.ground and 1 or 0 } }),
    element("Thermal", fields { { "TempEnabled", actuation and 1 or 0 },
      { "TempAmplitude", voxcad.DEGREES }, { "TempBase", 25 },
      { "VaryTempEnabled", actuation and 1 or 0 },
      { "TempPeriod", 1 / (actuation and actuation.frequency or 1) } }))
end

-- ---- materials ----------------------------------------------------------------------------------

local function material_element(material, id, edge, color, friction)
  local display = {}
  for k, name in ipairs { "Red", "Green", "Blue" } do
    display[k] = { name, voxcad.rounded(tonumber(color.hex:sub(2 * k, 2 * k + 1), 16) / 255) }
  end
  display[4] = { "Alpha", 1 }
  local own = { { "Letter", xml.escaped(material.letter) }, { "Kind", material.kind },
    { "DampingRatio", material.damping_ratio }, { "StiffnessFloor", material.stiffness_floor } }
  if material.kind ~= "passive" then own[#own + 1] = { "Phase", material.phase } end
  return element(("Material ID=\"%d\""):format(id),
    fields { { "Name", xml.escaped(material.name) } },
    element("Display", fields(display)),
    element("Mechanical", fields {
      { "MatModel", 0 },
      { "Elastic_Mod", voxcad.rounded(voxcad.MODULUS * material.stiffness / edge) },
      { "Fail_Stress", 0 },
      { "Density", voxcad.rounded(material.mass_per_site / edge ^ 3) },
      { "Poissons_Ratio", voxcad.POISSON },
      { "CTE", voxcad.strain_of(material) / voxcad.DEGREES },
      { "MaterialTempPhase", 0 },
      { "uStatic", friction.static }, { "uDynamic", friction.kinetic } }),
    element("Limax", fields(own)))
end

-- ---- voxels -------------------------------------------------------------------------------------

local function layers_of(name, lattice, value, separator)
  local layers = {}
  for z = 1, lattice[3] do
    local values = {}
    for y = 1, lattice[2] do
      for x = 1, lattice[1] do values[#values + 1] = value(x, y, z) end
    end
    layers[z] = ("<Layer><![CDATA[%s]]></Layer>"):format(table.concat(values, separator))
  end
  -- not as arguments: there may be a million
  return element(name, table.concat(layers, "\n"))
end

local function weight_at(weight, x, y, z)
  if type(weight) == "number" then return weight end
  return weight[z][y][x]
end

local function structure(description, list, attributes)
  local lattice, weights = description.lattice, description.weights
  local index, by_letter = {}, {}
  for i, material in ipairs(list) do
    index[material.letter], by_letter[material.letter] = i - 1, material
  end
  local function letter(x, y, z) return description.voxels[z][y]:sub(x, x) end
  local parts = {
    fields { { "X_Voxels", lattice[1] }, { "Y_Voxels", lattice[2] }, { "Z_Voxels", lattice[3] } },
    layers_of("Data", lattice, function(x, y, z) return index[letter(x, y, z)] end, ""),
    -- in periods
    layers_of("PhaseOffset", lattice, function(x, y, z)
      local most = by_letter[letter(x, y, z)].phase or math.pi
      return number(most * weight_at(weights.phase, x, y, z) / (2 * math.pi))
    end, ", "),
  }
  for _, each in ipairs(voxcad.WEIGHTS) do
    if weights[each[1]] ~= 1 then
      parts[#parts + 1] = layers_of(each[2], lattice, function(x, y, z)
        return number(weight_at(weights[each[1]], x, y, z))
      end, ", ")
    end
  end
  return element("Structure" .. attributes, unpack(parts))
end

-- Notes on weights: in the file, but VoxCad and voxcraft-sim leave them out.
local function note_weights(weights, notes)
  for _, name in ipairs { "stiffness", "amplitude" } do
    if weights[name] ~= 1 then
      notes[#notes + 1] = ("weights.%s: read back by limax alone; elsewhere every voxel has its"
        .. " material's full %s"):format(name, name)
    end
  end
end

local function materials_of(robot, path)
  local list = robot.materials:table().materials
  if #list - 1 > voxcad.MOST_MATERIALS then
    input.refuse(path, "the robot's table has %d materials; .vxa and .vxd hold up to %d", #list - 1,
      voxcad.MOST_MATERIALS)
  end
  return list
end

local function edge_of(description)
  return description.edge or defaults.fields.simulation.edge.value
end

--- A robot with its materials and world. `notes` receives what the file cannot carry.
---@param robot limax.robot
---@param path string for messages
---@param notes string[]
---@return string
function voxcad_write.vxa(robot, path, notes)
  local description, list = robot:table(), materials_of(robot, path)
  local edge, colors = edge_of(description), palette.of(list)
  local scene = engine.scene(description.scene or defaults.scene):table()
  local own = description.simulation or {}
  local friction = scene.friction or { static = 0, kinetic = 0 }
  local entries = {}
  for i = 2, #list do
    entries[i - 1] = material_element(list[i], i - 1, edge, colors[list[i].letter], friction)
  end
  local duration = own.duration or defaults.fields.simulation.duration.value
  local stop = "<StopCondition><StopConditionFormula><mtSUB><mtVAR>t</mtVAR><mtCONST>%s</mtCONST>"
    .. "</mtSUB></StopConditionFormula></StopCondition>"
  local world = environment(scene, notes)
  note_weights(description.weights, notes)
  if description.simulation then
    notes[#notes + 1] = "simulation: all but its duration (settling, integrator, time step)"
  end
  notes[#notes + 1] = "materials: the table's name, and where its numbers come from"
  notes[#notes + 1] = losses.fields(robot, { scene = true, simulation = true })
  return '<?xml version="1.0" encoding="UTF-8"?>\n' .. element('VXA Version="1.1"',
    element("Simulator", stop:format(number(duration))),
    world,
    element('VXC Version="0.94"',
      element("Lattice", fields { { "Lattice_Dim", edge } }),
      element("Palette", unpack(entries)),
      structure(description, list, ' Compression="ASCII_READABLE"'))) .. "\n"
end

--- The robot alone, which takes the place of the structure of a base.vxa.
---@param robot limax.robot
---@param path string
---@param notes string[]
---@return string
function voxcad_write.vxd(robot, path, notes)
  local description, list = robot:table(), materials_of(robot, path)
  note_weights(description.weights, notes)
  notes[#notes + 1] = "materials and scene: voxcraft-sim reads them from the base.vxa beside it,"
    .. " which a .vxa of this robot can be"
  notes[#notes + 1] = losses.fields(robot, { scene = true })
  return element("VXD", structure(description, list,
    ' replace="VXA.VXC.Structure" Compression="ASCII_READABLE"')) .. "\n"
end

return voxcad_write
